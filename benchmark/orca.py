"""ORCA (the RVO2 library, by pyrvo) on a scene: holonomic discs that choose velocities, for comparison.

Discs are 5 mm larger than the bodies, see 12 neighbours within 5 m, look 2 s ahead for robots and 1 s for walls, and
head for the next way-point of the same grid path as our robots, at most at their greatest speed; there is no limit on
acceleration or turning. A thousandth of noise on the wanted velocity lets symmetric scenes move.
"""
import time
from dataclasses import dataclass

import numpy as np

from mobile_planning.errors import NoPath
from mobile_planning.fleet.guidance import Guidance
from mobile_planning.fleet.search_lattice import SearchLattice
from mobile_planning.world.convex_pieces import ConvexPieces
from mobile_planning.world.obstacles import PolygonObstacle, RoundObstacle

STEP, MARGIN, NOISE, ARRIVED = 0.05, 0.005, 1e-3, 0.05


@dataclass(frozen=True)
class Outcome:
    """What a run came to: robots arrived, least distances [m], the last arrival [s], computing time per step [s]."""

    arrived: int
    min_separation: float
    min_obstacle_clearance: float
    mission_time: float
    step_time: float


def run_orca(scene, seed=0):
    """Return the outcome of ``scene``; distances count between the steps too, where discs drive straight."""
    import pyrvo

    rng = np.random.default_rng(seed)
    specs = scene.robots
    environment = scene.environment()
    places, goals = (np.array([getattr(spec, what)[:2] for spec in specs]) for what in ('start', 'goal'))
    guides = [Guidance(SearchLattice(environment, spec.radius + MARGIN), goal, spec.u_max[0])
              for goal, spec in zip(goals, specs)]
    pieces = _pieces(environment)
    simulator = pyrvo.RVOSimulator(STEP, 5.0, 12, 2.0, 1.0, 0.2, 1.0)
    for spec, place in zip(specs, places):
        agent = simulator.add_agent(tuple(place.tolist()))
        simulator.set_agent_radius(agent, spec.radius + MARGIN)
        simulator.set_agent_max_speed(agent, spec.u_max[0])
    for vertices in [_edge(environment), *(outline for _, outline in pieces)]:
        simulator.add_obstacle([tuple(vertex) for vertex in vertices.tolist()])
    simulator.process_obstacles()
    arrivals, spent, track = np.full(len(specs), np.inf), [], [places]
    targets = goals.copy()
    for count in range(1, int(scene.timeout / STEP) + 1):
        for index, guide in enumerate(guides):
            try:
                targets[index] = guide.path(places[index])[1:][0]
            except NoPath:
                pass                # pushed into a corner: it keeps its last way-point
            wanted, left = targets[index] - places[index], np.linalg.norm(goals[index] - places[index])
            speed = min(specs[index].u_max[0], left / STEP)
            wanted = wanted / max(np.linalg.norm(wanted), 1e-9) * speed + NOISE * rng.normal(size=2)
            simulator.set_agent_pref_velocity(index, tuple(wanted.tolist()))
        began = time.perf_counter()
        simulator.do_step()
        spent.append((time.perf_counter() - began) / len(specs))
        places = np.array([_pair(simulator.get_agent_position(index)) for index in range(len(specs))])
        track.append(places)
        is_there = np.linalg.norm(places - goals, axis=1) < ARRIVED
        arrivals = np.where(is_there, np.minimum(arrivals, count * STEP), np.inf)
        if is_there.all():
            break
    track, radii = np.array(track), np.array([spec.radius for spec in specs])
    rooms = [piece.distance(track).min(axis=0) - radii for piece, _ in pieces]
    if environment.boundary is not None:
        rooms.append(environment.boundary.distance(track).min(axis=0) - radii)
    arrived = np.isfinite(arrivals)
    return Outcome(int(arrived.sum()), _least_separation(track), float(np.min(rooms)),
                   float(arrivals[arrived].max(initial=0.0)), float(np.median(spent)))


def _pair(vector):
    return (vector.x, vector.y) if not callable(vector.x) else (vector.x(), vector.y())


def _edge(environment):
    """Return the corners of the world's edge clockwise: the free side of what RVO2 takes for a wall is inside."""
    x_min, y_min, x_max, y_max = environment.bounds
    return np.array([(x_min, y_min), (x_min, y_max), (x_max, y_max), (x_max, y_min)])


def _pieces(environment):
    """Return the convex pieces of the static world, each with its outline, counter-clockwise; circles as 16-gons."""
    world, result = ConvexPieces(environment), []
    for vertices, count, radius in zip(world.vertices, world.counts, world.radii):
        if count == 1:
            angles = 2 * np.pi * np.arange(16) / 16
            outline = vertices[0] + radius / np.cos(np.pi / 16) * np.column_stack([np.cos(angles), np.sin(angles)])
            result.append((RoundObstacle(vertices[0], float(radius)), outline))
        else:
            outline = vertices[:count]
            (x, y), (x_next, y_next) = outline.T, np.roll(outline, -1, axis=0).T
            turn = (x * y_next - x_next * y).sum()
            result.append((PolygonObstacle(outline), outline if turn > 0 else outline[::-1]))
    return result


def _least_separation(track):
    """Return the least distance [m] of two discs that drive straight from row to row of ``track`` (T, N, 2)."""
    first, second = np.triu_indices(track.shape[1], 1)
    if not len(first):
        return np.inf
    apart = track[:, first] - track[:, second]
    change = np.diff(apart, axis=0)
    share = np.clip(-(apart[:-1] * change).sum(-1) / np.maximum((change**2).sum(-1), 1e-12), 0.0, 1.0)
    return float(np.linalg.norm(apart[:-1] + share[..., None] * change, axis=-1).min())
