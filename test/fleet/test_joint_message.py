"""Joint messages: what cannot be carried out is refused."""
import numpy as np
import pytest
from joint_plans import NEEDS, WAYS, joint_plan

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.joint_message import MAX_MEMBERS, MAX_MOVES, JointStatus


@pytest.mark.parametrize('change', [
    dict(epoch=0), dict(members=(1, 1, 3)), dict(members=(2, 4, 3)), dict(members=(1, 2)),
    dict(ways=(WAYS[0], WAYS[1], [(0, np.nan)])), dict(ways=(WAYS[0], WAYS[1], np.zeros((0, 2)))),
    dict(ways=(WAYS[0], WAYS[1], np.zeros((MAX_MOVES + 2, 2))), needs=(NEEDS[0], NEEDS[1], ((),) * (MAX_MOVES + 1))),
    dict(needs=(NEEDS[0], NEEDS[1], ())), dict(needs=((((2, 2),),), ((),), ((),))),
    dict(needs=((((1, 1),),), ((),), ((),))), dict(needs=((((9, 1),),), ((),), ((),))),
    dict(needs=((((2, 0),),), ((),), ((),))), dict(members=tuple(range(1, MAX_MEMBERS + 2))),
])
def test_a_joint_plan_that_cannot_be_carried_out_is_refused(change):
    with pytest.raises(InvalidInput):
        joint_plan(**change)


@pytest.mark.parametrize('fields', [dict(epoch=-1), dict(stalled=np.nan), dict(stalled=-1.0), dict(progress={1: -1}),
                                    dict(progress=dict.fromkeys(range(MAX_MEMBERS + 1), 0)), dict(proposer=0.5)])
def test_a_status_out_of_range_is_refused(fields):
    with pytest.raises(InvalidInput):
        JointStatus(**fields)
