"""The way of a message from one process to another: serialised, so that a wrong number shows."""
from rclpy.serialization import deserialize_message, serialize_message


def sent(message):
    """Return the message as the other side gets it."""
    return deserialize_message(serialize_message(message), type(message))
