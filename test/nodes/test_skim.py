"""At first sight a message says what it says when it is read whole, and what is cut off is refused."""
import pytest
from builtin_interfaces.msg import Time
from hypothesis import given
from hypothesis import strategies as st
from mobile_planning_msgs.msg import Contracts, JointPlan, RobotMsg
from rclpy.serialization import serialize_message

from mobile_planning.errors import InvalidInput
from mobile_planning.nodes import skim
from mobile_planning.nodes.convert import seconds

numbers = st.integers(0, 2**32 - 1)
frames = st.text(st.characters(codec='utf-8', exclude_characters='\0'), max_size=9)
contents = {'peer': numbers, 'peer_epoch': numbers, 'base_sequence': numbers, 'contract': numbers,
            'first_span': st.integers(-2**63, 2**63 - 1), 'spans': st.integers(0, 2**16 - 1), 'normals': st.floats(),
            'offsets': st.floats(), 'reach': st.floats(), 'middles': st.floats(), 'answer_peer': numbers,
            'answer_epoch': numbers, 'answer_mode': st.integers(0, 255)}


@st.composite
def spoken(draw, kind):
    """Return a message with any head."""
    message = kind(version=draw(st.integers(0, 2**16 - 1)), robot_id=draw(numbers), boot_epoch=draw(numbers),
                   sequence=draw(numbers))
    message.header.frame_id = draw(frames)
    message.header.stamp = Time(sec=draw(st.integers(-2**31, 2**31 - 1)), nanosec=draw(st.integers(0, 10**9 - 1)))
    return message


@st.composite
def contracts(draw):
    """Return Contracts whose arrays have any lengths, whether they fit each other or not."""
    message = draw(spoken(Contracts))
    for name, entries in contents.items():
        setattr(message, name, draw(st.lists(entries, max_size=5)))
    return message


@given(st.one_of(spoken(RobotMsg), contracts(), spoken(JointPlan)))
def test_the_head_is_that_of_the_message(message):
    found = skim.head(serialize_message(message))
    assert found[:-1] == (seconds(message.header.stamp), message.header.frame_id, message.version, message.robot_id,
                          message.boot_epoch, message.sequence)


@given(contracts(), st.data())
def test_contracts_concern_those_whom_they_offer_or_answer_something(message, data):
    named = {*message.peer, *message.answer_peer}
    ids = data.draw(st.frozensets(st.sampled_from(sorted(named)) if named else numbers, max_size=2)
                    | st.frozensets(numbers, max_size=2))
    content = serialize_message(message)
    assert skim.concerns(content, skim.head(content).size, ids) == bool(named & ids)


@given(contracts(), st.data())
def test_what_is_cut_off_before_its_last_peer_is_refused(message, data):
    message.answer_peer, message.answer_granted = [0xFEEDC0DE], []
    content = serialize_message(message)
    cut = content[:data.draw(st.integers(2, content.rindex((0xFEEDC0DE).to_bytes(4, 'little')) + 3))]
    with pytest.raises(InvalidInput, match='cut off'):
        skim.concerns(cut, skim.head(cut).size, ())


@pytest.mark.parametrize('size', range(4))
def test_what_is_too_short_to_tell_its_encoding_is_cut_off(size):
    with pytest.raises(InvalidInput, match=f'cut off after {size} bytes'):
        skim.head(serialize_message(RobotMsg())[:size])


def test_another_encoding_is_refused():
    content = serialize_message(RobotMsg())
    with pytest.raises(InvalidInput, match='encoding 0000, which is not plain CDR'):
        skim.head(b'\0\0' + content[2:])
