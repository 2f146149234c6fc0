"""Making a path shorter."""
from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import InvalidInput
from mobile_planning.sampling.curve import poses_of, radius_of
from mobile_planning.sampling.plan_result import Improvement, PlanResult
from mobile_planning.sampling.steering import Steering, car_of
from mobile_planning.sampling.track import empty_track
from mobile_planning.sampling.track_result import result_of
from mobile_planning.stop_flag import StopFlag
from mobile_planning.world.collision_space import TOUCH
from mobile_planning.world.environment import Environment

_PORTION = 1000


def smooth(
    path: ArrayLike, environment: Environment, radius: float, deadline: float | None = 1.0, seed: int | None = None, *,
    nb_iteration: int = 20_000, speed: float = 1.0, begin: float = 0.0,
    steering: Steering = Steering.DUBINS, cancel: NDArray[np.uint8] | None = None,
) -> PlanResult:
    """Return the path made shorter, from the same start to the same end.

    Parameters
    ----------
    path : (n, 3) or (n, 2) array_like [m, m, rad]
        That a car of this radius can drive from pose to pose, freely. Without headings for a radius of 0.
    environment : Environment
    radius : float [m]
        Least turning radius; 0 for straight lines and turns on the spot.
    deadline : float [s]
        From now on; None is none.
    seed : int, optional
        The same seed gives the same path if the deadline does not end it.
    nb_iteration : int
        Trials to replace a stretch by a shorter one.
    speed : float [m/s]
    begin : float [s]
        When the path is begun, for obstacles that move.
    steering : Steering or str
        Of a car: forwards only, or backwards too.
    cancel : (1,) ndarray of uint8, optional
        Set ``cancel[0]`` from another thread to end it early.

    Returns
    -------
    PlanResult
        Solved; its cost is never above that of the path, which is the first entry of its history.

    Raises
    ------
    InvalidInput
        If a number is out of its range, or the path cannot be driven so or runs into something; the message says
        where.

    Examples
    --------
    >>> from mobile_planning import Boundary
    >>> detour = [(1, 1), (5, 9), (9, 1)]
    >>> round(smooth(detour, Environment(Boundary((0, 10), (0, 10))), 0, seed=1).cost, 3)
    8.0
    """
    from mobile_planning.sampling.graft_kernels import join_poses
    from mobile_planning.sampling.track_kernels import shorten

    begun = time.perf_counter()
    radius = 0.0 if radius in (0, None) else radius_of(radius)
    poses, car = _poses(path, radius), car_of(radius, Steering(steering))
    for value, name in ((speed, 'speed [m/s]'), (nb_iteration, 'nb_iteration')):
        if not (np.isfinite(value) and value > 0):
            raise InvalidInput(f'{name} {value!r} is not a finite number above 0')
    seed = int(np.random.SeedSequence().entropy % 2**63) if seed is None else int(seed)
    random = np.random.default_rng(seed).integers(2**64, size=1, dtype=np.uint64)
    track = empty_track(poses[0], 5 * len(poses) + 256)
    world = environment.surroundings(TOUCH)
    if not environment.free_poses(poses[0], begin):
        raise InvalidInput(f'the path starts in an obstacle, at {poses[0].tolist()}')
    failed = join_poses(world, poses, car, begin, speed, track)
    if failed >= 0:
        raise InvalidInput(f'from pose {failed} of the path, {poses[failed].tolist()}, no free way leads to the next')
    # Only a path that touches something already may touch it.
    strict = environment.surroundings(1e-9)
    if join_poses(strict, poses, car, begin, speed, track.copy()) < 0:
        world = strict
    history = [Improvement(time.perf_counter() - begun, track.length)]
    flag, made, spare = StopFlag(deadline, cancel), 0, track.copy()
    with flag:
        while made < nb_iteration and not flag.array[0]:
            if track.length == 0.0:
                break
            made += max(1, shorten(world, track, spare, random, car, begin, speed,
                                   min(_PORTION, nb_iteration - made), flag.array))
            if track.length < history[-1].cost:
                history.append(Improvement(time.perf_counter() - begun, track.length))
    return replace(result_of(track, poses[-1], car), seed=seed, history=tuple(history), iterations=made,
                   elapsed=time.perf_counter() - begun)


def _poses(path: ArrayLike, radius: float) -> NDArray[np.float64]:
    """Return the path as poses (n, 3), at least one."""
    path = np.asarray(path, float)
    if radius == 0 and path.ndim == 2 and path.shape[1] in (2, 3):
        path = np.column_stack([path[:, :2], np.zeros(len(path))])
    poses = poses_of(path, 'path')
    if not len(poses):
        raise InvalidInput('the path has no pose')
    return poses
