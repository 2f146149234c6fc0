"""What sections of the receding horizon cost, for ``benchmark.fleet``: time and programs by each of its solvers."""
from dataclasses import replace

import numpy as np

from mobile_planning.fleet.horizon_section import Kind
from mobile_planning.fleet.nonlinear import SOLVERS

#: Solvers, each a planner of its own for the benchmark.
PLANNERS = SOLVERS
HEAD = (f'{"case":<28} {"by":<10} {"first":>7} {"last":>7} {"min":>7} {"mean":>7} {"max [ms]":>8} {"MCT/Tc":>13} '
        f'{"programs":>9} {"infeasible":>10} {"refused":>8}')


def simulation_of(scene, solver):
    """Return the mission of ``scene`` in which all plan by the receding horizon."""
    return replace(scene, method='receding_horizon').world_sim(solver=solver)


def records_of(simulation):
    """Return the record of each section that was planned, and the time Tc [s] between two sections."""
    robots = [vehicle.robot for vehicle in simulation.episode.vehicles.values()]
    return [record for robot in robots for record in robot.sections], robots[0].Tc


def line(case, solver, rows):
    """Return the line of the table for the runs ``rows``."""
    records = [record for row in rows for record in row['sections'][0]]
    of = {kind: [1e3 * record.seconds for record in records if record.kind is kind] for kind in Kind}
    every, early = sum(of.values(), []), of[Kind.FIRST] + of[Kind.INTERMEDIATE]
    solves, tc = max(sum(record.solves for record in records), 1), 1e3 * rows[0]['sections'][1]
    infeasible = sum(record.infeasible for record in records) / solves
    refused = sum(record.refused for record in records) / max(len(records), 1)
    first, last = (np.mean(of[kind] or np.nan) for kind in (Kind.FIRST, Kind.LAST))
    return (f'{case:<28} {solver:<10} {first:>7.1f} {last:>7.1f} '
            f'{min(every):>7.1f} {np.mean(every):>7.1f} {max(every):>8.1f} {max(early, default=np.nan) / tc:>6.2f} '
            f'{max(every) / tc:>6.2f} {solves:>9} {100 * infeasible:>8.1f} % {100 * refused:>6.1f} %')
