"""One section side by side: ``python -m benchmark.section``.

Nine robots change places among ten obstacles, so that each has ten obstacles and eight conflicts to heed. Every section
that a moving robot plans on its way is captured as it is planned, without a change to the product: its quadratic
programs, and what the robot knew. Then the same programs are solved by our solver, compiled and in numpy, by OSQP and
by daqp, and the same sections as nonlinear programs by scipy's SLSQP with analytic Jacobians, from the plan in force.
At last sections are timed among more and fewer obstacles, as dense as before in a larger hall, and robots.

Times are the thread's on its processor. "gap" is the objective beyond that of our solver, relative. SLSQP is "bad"
where its answer violates a constraint at a sample by more than 1e-3 or it gives up. Wants daqp; without it that line is
left out.
"""
import argparse
import platform
import sys
import time
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib import metadata, util

import numpy as np

from benchmark.section_nlp import SectionProgram
from mobile_planning import Boundary, RoundObstacle
from mobile_planning.fleet.qp import QuadraticProgram
from mobile_planning.fleet.scene import RobotSpec, Scene

PACKAGES = ('numpy', 'scipy', 'numba', 'osqp', 'daqp')
ROBOTS, OBSTACLES = 9, 10
#: Obstacles and robots of the worlds whose sections are compared; of each so many sections, from the first seconds.
SIZES = (*((count, ROBOTS) for count in (0, 10, 50, 200)), *((OBSTACLES, count + 1) for count in (0, 4, 8, 16, 32)))
SECTIONS, SECONDS = 40, 3.0


@dataclass
class Captured:
    """One section: the plan in force, what was known, the programs that were solved, and the time [s] it all took."""

    old: np.ndarray
    peers: np.ndarray
    circles: np.ndarray
    programs: list = field(default_factory=list)
    seconds: float = 0.0


def crowd(seed, obstacles, robots):
    """Return a scene of robots on a circle of radius 3 m that drive to the place opposite, among random circles.

    Ten circles lie within; more are as dense all over a larger disc. Many robots stand on a larger circle.
    """
    rng = np.random.default_rng(seed)
    centres, radii = np.empty((0, 2)), np.empty(0)
    ring = max(3.0, 0.8 * robots / (2 * np.pi))
    most = 2.2 if obstacles <= OBSTACLES else 2.2 * np.sqrt(obstacles / OBSTACLES) + ring - 2.0
    while len(radii) < obstacles:
        centre, radius = rng.uniform(-most, most, 2), rng.uniform(0.1, 0.2)
        from_middle = np.linalg.norm(centre)
        is_free = from_middle < 2.2 or ring + 0.8 < from_middle < most
        if is_free and (np.linalg.norm(centres - centre, axis=1) - radii - radius >= 0.5).all():
            centres, radii = np.vstack([centres, centre]), np.append(radii, radius)
    angles = 2 * np.pi * np.arange(robots) / robots
    places = ring * np.column_stack([np.cos(angles), np.sin(angles)]) + rng.uniform(-0.1, 0.1, (robots, 2))
    specs = [RobotSpec(index + 1, (*place, angle + np.pi), (-place[0], -place[1], angle + np.pi))
             for index, (place, angle) in enumerate(zip(places.tolist(), angles.tolist()))]
    side = max(5.0, ring + 1.0, most + 1.0)
    hall = Boundary((-side, side), (-side, side))
    return Scene('crowd', tuple(specs), tuple(map(RoundObstacle, centres, radii.tolist())), hall)


@contextmanager
def recorded(programs):
    """Append the arguments of every quadratic program solved meanwhile to ``programs``."""
    solve = QuadraticProgram.solve

    def recording(program, gradient, rows, bounds, equalities=0, guess=()):
        programs.append((np.array(gradient), np.array(rows), np.array(bounds), equalities))
        return solve(program, gradient, rows, bounds, equalities, guess)

    QuadraticProgram.solve = recording
    try:
        yield
    finally:
        QuadraticProgram.solve = solve


@contextmanager
def noted(hessians):
    """Append the Hessian of every quadratic program made meanwhile to ``hessians``."""
    make = QuadraticProgram.__init__

    def noting(program, hessian, *arguments, **options):
        hessians.append(np.array(hessian))
        make(program, hessian, *arguments, **options)

    QuadraticProgram.__init__ = noting
    try:
        yield
    finally:
        QuadraticProgram.__init__ = make


def watch(robot, sections, circles, robots):
    """Let ``robot`` add to ``sections`` whatever it plans while it drives."""
    plan_section = robot.plan_section

    def planning(now):
        section, seconds = timed(plan_section, now)
        spans = len(section.old) - 3
        if not section.seconds or not np.ptp(section.old[:3], axis=0).any():
            return section
        peers = [message.plan.control(max(section.first_knot, message.plan.first_knot), spans + 3)
                 for message in robot.heard().values()]
        captured = Captured(section.old, np.array(peers), circles, seconds=seconds)
        with recorded(captured.programs):
            plan_section(now)               # which changes nothing, so that it can be had twice
        # Sections that end at the goal are searched for by many programs with equations: other instances.
        if len(peers) == robots - 1 and captured.programs and all(program[3] == 0 for program in captured.programs):
            sections.append(captured)
        return section

    robot.plan_section = planning


def capture(seeds, obstacles=OBSTACLES, robots=ROBOTS, timeout=30.0):
    """Return the sections of the missions of some seeds, one of their robots, and the Hessian all have in common."""
    sections, hessians = [], []
    for seed in seeds:
        scene = crowd(seed, obstacles, robots)
        with noted(hessians):
            simulation = scene.world_sim()
        circles = np.array([(*obstacle.centroid, obstacle.radius) for obstacle in scene.obstacles])
        for robot in simulation.robots.values():
            watch(robot, sections, circles, robots)
        simulation.run(seed, timeout=timeout, check=False)
    return sections, robot, hessians[0]


def with_daqp(hessian):
    """Return a function that solves a program by daqp, dense and cold."""
    import daqp

    def solve(gradient, rows, bounds, equalities):
        above, sense = np.full(len(bounds), 1e30), np.zeros(len(bounds), np.int32)
        above[:equalities], sense[:equalities] = bounds[:equalities], 5
        x, _, flag, _ = daqp.solve(hessian, gradient, rows, above, np.maximum(bounds, -1e30), sense)
        return x if flag == 1 else None

    return solve


def solvers_of(hessian):
    """Return by name functions from gradient, rows, bounds and number of equations to the optimum, None for none."""
    def by(program):
        return lambda *data: getattr(program.solve(*data), 'x')

    solvers = {'ours, compiled': by(QuadraticProgram(hessian)),
               'ours, numpy': by(QuadraticProgram(hessian, compiled=False)),
               'OSQP': by(QuadraticProgram(hessian, 'osqp', limit=4000))}
    if util.find_spec('daqp'):
        solvers['daqp'] = with_daqp(hessian)
    return solvers


def timed(function, *arguments):
    """Return the result and the processor's time [s], which other processes do not add to."""
    began = time.thread_time()
    result = function(*arguments)
    return result, time.thread_time() - began


def compare_programs(hessian, programs):
    """Print a line for each solver of the quadratic programs."""
    solvers = solvers_of(hessian)
    for solve in solvers.values():
        solve(*programs[0])
    costs, times = {name: [] for name in solvers}, {name: [] for name in solvers}
    for program in programs:
        for name, solve in solvers.items():
            x, seconds = timed(solve, *program)
            times[name].append(seconds)
            costs[name].append(np.nan if x is None else 0.5 * x @ hessian @ x + program[0] @ x)
    best = np.array(costs['ours, compiled'])
    print(f'{len(programs)} quadratic programs of {len(hessian)} variables and '
          f'{int(np.median([len(bounds) for _, _, bounds, _ in programs]))} rows (median)')
    print(f'{"solver":<18} {"solved":>11} {"min":>8} {"median":>8} {"p99":>8} [ms] {"gap, median":>12} {"worst":>9}')
    for name in solvers:
        gap = np.abs(np.array(costs[name]) - best) / np.maximum(np.abs(best), 1e-6)
        print(f'{name:<18} {np.isfinite(costs[name]).sum():>5}/{len(programs):<5} {milliseconds(times[name])}      '
              f'{np.nanmedian(gap):>12.1e} {np.nanmax(gap):>9.1e}', flush=True)


def compare_sections(hessian, sections, robot):
    """Print a line for our sections as a whole and one for SLSQP on the same ones."""
    spans = len(sections[0].old) - 3
    nonlinear = SectionProgram(hessian, robot.limits, robot.plan.step, spans)
    ours, theirs, bad, steps = [], [], 0, []
    for section in sections:
        start = section.old[3:spans + 1].ravel()
        (result, violation), seconds = timed(nonlinear.solve, section.old, section.programs[-1][0], section.circles,
                                             section.peers, start)
        ours.append(section.seconds)
        theirs.append(seconds)
        steps.append(result.nit)
        bad += not result.success or violation > 1e-3
    programs = np.mean([len(section.programs) for section in sections])
    print(f'\n{len(sections)} sections with {len(sections[0].circles)} obstacles and {len(sections[0].peers)} '
          f'conflicts, {programs:.1f} programs each (mean)')
    print(f'{"planner":<18} {"bad":>11} {"min":>8} {"median":>8} {"p99":>8} [ms]')
    print(f'{"ours, all of it":<18} {"-":>11} {milliseconds(ours)}')
    print(f'{"SLSQP, analytic":<18} {bad:>5}/{len(sections):<5} {milliseconds(theirs)}      '
          f'{np.median(steps):.0f} iterations')
    print(f'SLSQP takes {np.median(theirs) / np.median(ours):.1f}x by medians, '
          f'{np.median(np.divide(theirs, ours)):.1f}x in the median section')


def compare_sizes():
    """Print a line for each number of obstacles and of conflicts."""
    print(f'\n{"obstacles":>9} {"conflicts":>9} {"sections":>9} {"programs":>9} '
          f'{"min":>8} {"median":>8} {"p99":>8} [ms]')
    for obstacles, robots in SIZES:
        sections, seed = [], 0
        while len(sections) < SECTIONS:
            sections += capture([seed], obstacles, robots, SECONDS)[0]
            seed += 1
        programs = np.mean([len(section.programs) for section in sections])
        print(f'{obstacles:>9} {robots - 1:>9} {len(sections):>9} {programs:>9.2f} '
              f'{milliseconds([section.seconds for section in sections])}', flush=True)


def milliseconds(seconds):
    """Return least, median and 99th percentile as text."""
    return ' '.join(f'{1e3 * value:>8.3f}' for value in np.percentile(seconds, (0, 50, 99)))


def main():
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--seeds', type=int, nargs=2, default=(0, 3), metavar=('FIRST', 'END'))
    parser.add_argument('--obstacles', type=int, default=OBSTACLES)
    parser.add_argument('--robots', type=int, default=ROBOTS, help='one more than there are conflicts')
    parser.add_argument('--sizes', action='store_true', help='only compare numbers of obstacles and conflicts')
    parser.add_argument('--sections', type=int, default=200, help='so many of the captured ones, spread evenly')
    options = parser.parse_args()
    installed = {item.metadata['Name'] for item in metadata.distributions()}
    print(f'Python {platform.python_version()},',
          ', '.join(f'{package} {metadata.version(package)}' for package in PACKAGES if package in installed))
    if options.sizes:
        compare_sizes()
        return
    sections, robot, hessian = capture(range(*options.seeds), options.obstacles, options.robots)
    sections = sections[::max(1, len(sections) // options.sections)]
    compare_programs(hessian, [program for section in sections for program in section.programs])
    compare_sections(hessian, sections, robot)
    compare_sizes()


if __name__ == '__main__':
    sys.exit(main())
