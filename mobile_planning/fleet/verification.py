"""Verification: prove from the published control points alone that a mission was safe, or say where it was not.

Proved is all that robots committed themselves to, driven or not: what binds two robots at one instant, each by its last
commit, keeps them apart to the end and for ever after; each plan keeps off the static world and, at every instant,
within the limits of speed, acceleration and turn rate; each goes on where its predecessor was. Not judged is how fast
turn rates change. Samples of what was driven, by another formula, are a second opinion.
"""
from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np
from numpy.linalg import norm

from mobile_planning.fleet.hulls import product, reach, unproved
from mobile_planning.fleet.report import Body, Report
from mobile_planning.fleet.solution import Solution
from mobile_planning.fleet.track import SAME_HEADING, TOLERANCE, Track
from mobile_planning.fleet.visits import visits
from mobile_planning.geometry import wrap_angle
from mobile_planning.world.environment import Environment
from mobile_planning.world.exact_distance import ExactDistance

#: Between two samples [s]; the nearness to the goal that counts as arrived [m, rad]; limits are rounded by so much.
_STEP, _ARRIVED, _TURNED, _ROUNDING = 0.005, 0.05, 0.05, 1 + 1e-7
#: A body that rests is found so near to where its plan has ended [m, rad].
_FOUND = 0.05
#: Position, velocity and acceleration at a knot, of three control points [m per span, m per span^2].
_AT_KNOT = np.array([[1, 4, 1], [-3, 0, 3], [6, -12, 6]]) / 6


def verify(solutions: Mapping[int, Solution], bodies: Sequence[Body], environment: Environment,
           start_time: float = 0.0, name: str = 'mission') -> Report:
    """Return the report on ``solutions``, by robot id, of a mission that began at ``start_time`` [s].

    A robot stands at its start until its first plan, for ever if it has no solution. All robots share their knots.
    """
    plans = {body.eyed: list(solutions[body.eyed].plans) if body.eyed in solutions else [] for body in bodies}
    step = next((plan.step for each in plans.values() for plan in each if 0 < plan.step < np.inf), 1.0)
    commits = {eyed: solution.commits for eyed, solution in solutions.items()}
    tracks = [Track(body, plans[body.eyed], commits.get(body.eyed, ()), start_time, step) for body in bodies]
    world = ExactDistance(environment)
    alone = (track.faults + _jumps(track) + _broken_limits(track, world) for track in tracks)
    violations = sum([*alone, *(_meetings(a, b) for a, b in combinations(tracks, 2))], [])
    separation, closest, clearance, seen = _sampled(tracks, world)
    reached = [visits(track, _ARRIVED, _TURNED) for track in tracks]
    arrivals = {track.body.eyed: track.rests_from() for track, times in zip(tracks, reached) if plans[track.body.eyed]
                and len(times) == len(track.body.goals)
                and norm(track.points[-1, 3] - track.body.goal[:2]) <= _ARRIVED
                and abs(wrap_angle(track.theta[-1] - track.body.goal[2])) <= _TURNED}
    latest = max((times[-1] for times in reached if times), default=0.0)
    times = tuple(seconds for solution in solutions.values() for seconds in solution.section_times)
    return Report(name, not violations + seen and len(arrivals) == len(tracks), len(tracks), tuple(arrivals),
                  separation, clearance, max(arrivals.values(), default=0.0), violations + seen, closest,
                  section_times=times, goals=sum(len(body.goals) for body in bodies), arrivals=sum(map(len, reached)),
                  throughput=60.0 * sum(map(len, reached)) / latest if latest > 0.0 else None)


def visited(solution: Solution, body: Body, start_time: float, until: float) -> int:
    """Return how many of its goals a robot had reached ``until`` [s] by what it has driven since ``start_time`` [s]."""
    step = solution.plans[0].step
    times = visits(Track(body, list(solution.plans), solution.commits, start_time, step), _ARRIVED, _TURNED)
    return sum(start_time + time <= until for time in times)


def _jumps(track):
    """Say where a plan does not start as its predecessor goes on."""
    plans = np.arange(2 if track.body.is_under_way else 1, len(track.first))
    knots = track.first[plans]
    old, new = track.at(plans - 1, knots), track.at(plans, knots)
    jumps = np.abs(_AT_KNOT @ (track.points[new] - track.points[old])[:, :3]).max(axis=2) > TOLERANCE
    turned = np.abs(wrap_angle(track.theta[new] - track.theta[old]))
    jumps = np.column_stack([jumps, turned > SAME_HEADING])
    # A body that rests is found again as well as it is measured.
    gap = norm(track.points[new, 3] - track.points[old, 3], axis=1)
    is_still = ~(track.velocity[new].any(axis=(1, 2)) | track.velocity[old].any(axis=(1, 2)))
    jumps[track.is_found[plans] & is_still & (gap <= _FOUND) & (turned <= _FOUND)] = False
    return [f'robot {track.body.eyed}: {("position", "velocity", "acceleration", "heading")[what]} jumps at '
            f'{track.time(knots[row]):.3f} s, from {"its start" if plans[row] == 1 else "the plan before"}'
            for row, what in np.argwhere(jumps)]


def _broken_limits(track, world):
    """Say which limits plans exceed, driven or not, and whether they touch the static world: where first, how many."""
    body, step, moving = track.body, track.step, np.flatnonzero(track.ahead.any(axis=(1, 2)))
    v_max, omega_max, a_max = (limit * _ROUNDING for limit in (body.v_max, body.omega_max, body.a_max))

    def spare_speed(pieces):
        speed = norm(pieces, axis=2) / step
        return v_max - speed.max(axis=1), v_max - speed[:, [0, -1]].max(axis=1)

    def spare_turn_rate(pieces):
        (x, y, dx, dy), most = pieces.transpose(2, 0, 1), np.abs(pieces[..., :2]).max(axis=(1, 2))
        spare = (omega_max * step * (product(x, x) + product(y, y)) - np.abs(product(x, dy) - product(y, dx))
                 + 1e-14 * most[:, None])
        # Where the speed all but vanishes, the heading may turn about.
        return np.where(reach(pieces[..., :2]) > 1e-6 * most, spare.min(axis=1), -1.0), spare[:, [0, -1]].min(axis=1)

    def spare_room(pieces):
        # The square of the distance to any set, less |p|^2, is concave: so much can it fall within a hull.
        ball = norm(pieces - pieces.mean(axis=1, keepdims=True), axis=2).max(axis=1)
        room = world(pieces.reshape(-1, 2)).reshape(-1, 4).clip(0.0) + TOLERANCE
        low = np.sqrt(np.maximum(room.min(axis=1)**2 - ball**2, 0.0))
        return low - body.radius, room[:, [0, -1]].min(axis=1) - body.radius
    w = track.ahead[moving] / np.abs(track.ahead[moving]).max(axis=(1, 2))[:, None, None]
    dw = 2 * np.diff(w, axis=1)
    w = np.concatenate([w, np.stack([dw[:, 0], dw.mean(axis=1), dw[:, 1]], axis=1)], axis=2)
    accelerations = norm(2 * np.diff(track.velocity, axis=1), axis=2).max(axis=1) / step**2
    found = {f'speed exceeds {body.v_max} m/s': moving[unproved(track.velocity[moving], spare_speed)],
             f'acceleration exceeds {body.a_max} m/s^2': np.flatnonzero(accelerations > a_max),
             f'turn rate exceeds {body.omega_max} rad/s': moving[unproved(w, spare_turn_rate)],
             f'turn rate in place exceeds {body.omega_max} rad/s': np.flatnonzero(abs(track.turn) / step > omega_max),
             'static world is touched': unproved(track.curves, spare_room)}
    return [f'robot {body.eyed}: {what} at {track.time(track.knot[spans[0]]):.3f} s, in {len(spans)} spans'
            for what, spans in found.items() if len(spans)]


def _meetings(a, b):
    """Say where two robots, by what binds them at one instant, come too close then or at any time after."""
    changes, need = np.union1d(a.commit[1:], b.commit[1:]), a.body.radius + b.body.radius - TOLERANCE
    moments = np.append(changes.min(initial=0) - 1, changes)
    knots, p, q = np.floor(moments).astype(np.int64), a.bound(moments), b.bound(moments)
    (a_low, a_high), (b_low, b_high) = a.boxes(a.driven(knots), p), b.boxes(b.driven(knots), q)
    near = norm(np.maximum(a_low - b_high, b_low - a_high).clip(0.0), axis=1) < need
    p, q, knots, moments = p[near], q[near], knots[near], moments[near]
    count = np.maximum(np.maximum(a.last[p], b.last[q]) - knots, 0) + 1
    row = np.repeat(np.arange(len(knots)), count)
    span = knots[row] + np.arange(len(row)) - (np.cumsum(count) - count)[row]
    apart = a.curves[a.to_come(p[row], span)] - b.curves[b.to_come(q[row], span)]
    bad = unproved(apart, lambda pieces: (reach(pieces) - need, norm(pieces[:, [0, -1]], axis=2).min(axis=1) - need))
    return [f'robots {a.body.eyed} and {b.body.eyed}: by the plans bound at {a.time(moments[row[bad[0]]]):.3f} s '
            f'they come closer than {need:.4f} m at {a.time(span[bad[0]]):.3f} s'] if len(bad) else []


def _sampled(tracks, world):
    """Return least separation, where it was, least clearance, and what is wrong, by samples of what was driven."""
    times = np.arange(0.0, max(track.rests_from() for track in tracks) + _STEP, _STEP)
    places, separation, closest, clearance, seen = [track.places(times) for track in tracks], np.inf, None, np.inf, []
    for (a, at_a), (b, at_b) in combinations(zip(tracks, places), 2):
        k = int((gaps := norm(at_a - at_b, axis=1)).argmin())
        if gaps[k] < separation:
            separation, closest = float(gaps[k]), {'robots': [a.body.eyed, b.body.eyed], 'time': float(times[k]),
                                                   'places': [at_a[k].tolist(), at_b[k].tolist()]}
        if gaps[k] < a.body.radius + b.body.radius - TOLERANCE:
            seen.append(f'robots {a.body.eyed} and {b.body.eyed} are {gaps[k]:.4f} m apart at {times[k]:.3f} s, '
                        f'their radii need {a.body.radius + b.body.radius:.4f} m')
    for track, path in zip(tracks, places):
        # The room changes by no more than the way: most samples are out of the question.
        coarse, nearest = world(path[::16]), np.arange(len(path)) // 16
        is_near = coarse[nearest] - norm(path - path[::16][nearest], axis=1) <= coarse.min()
        room = float(world(path[is_near]).min()) - track.body.radius
        clearance = min(clearance, room)
        if room < -TOLERANCE:
            seen.append(f'robot {track.body.eyed} is {-room:.4f} m inside the static world')
    return separation, closest, clearance, seen
