"""Drives that are judged, and what the judge says of them."""
import numpy as np

from mobile_planning import Boundary, Environment, verify
from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.solution import Solution
from mobile_planning.fleet.verification import Body

HALL = Boundary((-1, 21), (-5, 5))
WORLD = Environment(HALL)
TC = 0.25
#: Steps [m] that start and stop within 2 m/s^2, and keep 1 m/s in between.
STEPS = (0.1, 0.2, *[0.25] * 20, 0.2, 0.1)


def body(eyed, start, goal, **limits):
    return Body(eyed, 0.2, np.array(start, float), np.array(goal, float),
                **{'v_max': 1.0, 'omega_max': 5.0, 'a_max': 2.0, **limits})


def drive(start, direction, steps=STEPS, first_knot=0, rest=0, **options):
    """Return a plan along a straight line, after ``rest`` spans at rest."""
    along = np.cumsum([0] * (3 + rest) + list(steps) + [0, 0])
    points = np.asarray(start, float) + along[:, None] * np.array([np.cos(direction), np.sin(direction)])
    return Plan(first_knot, TC, points, **{'heading': direction, **options})


def braking(old, knot, count):
    """Return a plan that goes on with ``count`` control points of ``old`` from ``knot`` on and then brakes."""
    given = old.control(knot, count)
    return Plan(knot, old.step, np.vstack([given, given[-1] + [(0.2, 0), (0.3, 0), (0.3, 0), (0.3, 0)]]), 0.0)


def judged(*runs, world=WORLD, start_time=0.0, **limits):
    """Return the report on (eyed, start pose, goal pose, plan, plan, ...) each."""
    bodies = [body(run[0], run[1], run[2], **limits) for run in runs]
    solutions = {run[0]: Solution(run[0], tuple(run[3:]), True) for run in runs if len(run) > 3}
    return verify(solutions, bodies, world, start_time)


LENGTH = sum(STEPS)
ALONG = (1, (0, 0, 0), (LENGTH, 0, 0), drive((0, 0), 0.0))


def is_caught(report, *words):
    return not report.valid and len(report.violations) > 0 and all(
        any(word in sentence for sentence in report.violations) for word in words)
