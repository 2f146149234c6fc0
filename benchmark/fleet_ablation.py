"""What each mechanism of the fleet buys: ``python -m benchmark.fleet_ablation [CASE ...] --seeds 20 23 --loss 0``.

Each row is the fleet without one of them, replaced from outside by what there would be instead; all else is as it is.
Median and greatest time of the last arrival over the lower bound, over the runs in which all arrive; how many of the
runs those are, where it is not all. No row can cause a collision: all that is replaced is advice, or when to say what.
"""
from benchmark.fleet_tuning import Setting, drive, print_tables
from mobile_planning.fleet import course, joint_plan, pebble_search, plan_in_force, repetition
from mobile_planning.fleet.contract_robot import ContractRobot
from mobile_planning.fleet.follower import Follower
from mobile_planning.fleet.guidance import Guidance
from mobile_planning.fleet.proposer import Proposer

CASES = ('swap:robots=8', 'swap:robots=16', 'hall:robots=12', 'forest:robots=8', 'forest:robots=16',
         'doorway:robots=4,gap=0.65', 'doorway:robots=8,gap=0.65', 'corridor:robots=4,width=0.65',
         'corridor:robots=6,width=0.65', 'pockets:robots=4')


def _nobody(*_):
    return None


def _never(*_):
    return False


def _first_found(instance, urgency, rng, limits=pebble_search.LIMITS, times=None):
    return pebble_search.solve(instance, urgency, rng, limits)


def _right_hand_rule(reference):
    """Return the reference that knows no velocity, and so predicts nothing."""
    return lambda self, *args, velocity=None, **options: reference(self, *args, **options)


def _by_body(advance):
    """Return the progress along a joint plan that counts what the body has passed."""
    return lambda self, position, plan_end, now: advance(self, position, position, now)


SETTINGS = (
    Setting('all of it'),
    Setting('no joint plan', ((Proposer, 'request', _nobody),)),
    Setting('joint plans for who stalls only', ((Proposer, '_meets_somebody', _never),)),
    Setting('joint plans as first found', ((joint_plan, 'best_steps', _first_found),)),
    Setting('joint plans pass nobody at speed', ((joint_plan, '_WIDE_LIMITS', (0,)),)),
    Setting('moves released by bodies', ((Follower, 'advance', _by_body(Follower.advance)),)),
    Setting('sections for each second knot', ((ContractRobot, 'cycle', property(lambda robot: robot.Tc)),)),
    Setting('no roundabout', ((course, 'predict_crowd', _nobody),)),
    Setting('right-hand rule for prediction', ((Guidance, 'reference', _right_hand_rule(Guidance.reference)),)),
    Setting('ample contracts renewed, too', ((plan_in_force, '_AMPLE', float('inf')),)),
    Setting('nothing said again at once', ((repetition, 'TIMES', 1),)),
)


def run(task):
    """Return the ratio of one run; ``task`` has the index of its setting first."""
    index, *rest = task
    return drive(SETTINGS[index], *rest)


if __name__ == '__main__':
    print_tables(run, SETTINGS, CASES, __doc__.splitlines()[0], first=20, losses=(0.0,))
