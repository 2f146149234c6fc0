"""How each topic travels, by name.

A latched topic keeps its newest message for those who come later, as long as its writer lives; writer and reader must
both ask for it. A topic without keys shares one history among all writers: a reader that must miss nobody needs room
for everybody.
"""
from rclpy.duration import Duration
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy


def latched(depth: int = 1) -> QoSProfile:
    """Return the profile of a topic that late subscribers get too.

    Parameters
    ----------
    depth : int
        How many messages are kept: for a reader, one for each writer.
    """
    return QoSProfile(history=HistoryPolicy.KEEP_LAST, depth=depth, reliability=ReliabilityPolicy.RELIABLE,
                      durability=DurabilityPolicy.TRANSIENT_LOCAL)


def robot_messages(depth: int = 1) -> QoSProfile:
    """Return the profile of what robots tell each other: each message replaces the one before.

    Without a lease of liveliness: whoever falls silent is noticed by what he does not say, and Fast DDS would wake a
    thread of each process for each message that comes in.

    Who comes late gets what was said last, unless it is older than its lifespan. If he did not, Fast DDS 3.2.2 would
    tell him to pass it over, and a process that was killed and started anew, to which fragments come that are for its
    predecessor, would keep a message in its list that it has let go of already: reading it yields nothing, for ever, as
    an object never even returns (its pull request 2239 names how list and history fall apart).

    Parameters
    ----------
    depth : int
        1 for a writer; at least 4 times the number of robots for a reader.
    """
    return QoSProfile(history=HistoryPolicy.KEEP_LAST, depth=depth, reliability=ReliabilityPolicy.RELIABLE,
                      durability=DurabilityPolicy.TRANSIENT_LOCAL, lifespan=Duration(seconds=1.0))


def live(depth: int = 10) -> QoSProfile:
    """Return the profile of a topic that only matters to those who listen now.

    Parameters
    ----------
    depth : int
    """
    return QoSProfile(history=HistoryPolicy.KEEP_LAST, depth=depth, reliability=ReliabilityPolicy.RELIABLE,
                      durability=DurabilityPolicy.VOLATILE)


MAP = latched()
MISSION = latched()
PATH = latched()
SOLUTION_WRITER = latched()
SOLUTION_READER = latched(256)
DIAGNOSTICS = live()
PROGRESS = live()
# Of a service that works on a request while others come in: by default only ten wait, and the rest is lost silently.
REQUESTS = live(100)
