"""How far a body comes off its plans by the turn acceleration of its base: as tried at the start, and in missions.

    python -m benchmark.turn_lag
"""
from __future__ import annotations

from mobile_planning.fleet.scenarios import scene
from mobile_planning.fleet.solution import Solution
from mobile_planning.fleet.tracking import Tracker
from mobile_planning.fleet.tracking_budget import lag, worst_lag

#: Of commands [s].
_PERIOD = 0.05


def driven() -> list[Solution]:
    """Return what twelve robots drive in three missions."""
    simulations = [scene(name, 1, robots=4).world_sim() for name in ('swap', 'forest', 'doorway')]
    for simulation in simulations:
        simulation.run(seed=1)
    return [solution for simulation in simulations for solution in simulation.solutions.values()]


def main() -> None:
    """Print the table."""
    solutions = driven()
    print(f'{"alpha_max [rad/s2]":>20}{"tried [mm]":>12}{"missions [mm]":>15}')
    for alpha in (5, 10, 15, 20, 25, 30, 40, 60):
        tracker = Tracker(1.2, 6.0, a_max=3.0, alpha_max=alpha)
        tried = worst_lag(tracker, (1.0, 5.0), (2.0, 10.0), 0.25, _PERIOD)
        found = max(lag(solution, tracker, _PERIOD) for solution in solutions)
        print(f'{alpha:>20}{1e3 * tried:>12.1f}{1e3 * found:>15.1f}')


if __name__ == '__main__':
    main()
