"""Rapidly exploring random trees over Dubins paths, and over straight lines."""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import Cancelled, InvalidInput, PlanningTimeout
from mobile_planning.sampling.local_planner import LocalPlanner
from mobile_planning.sampling.plan_result import PlanResult, PlanStatus
from mobile_planning.sampling.request import NB_ITERATION, check_run, three_numbers
from mobile_planning.sampling.rrt_graph import Edge, Graph, Node
from mobile_planning.sampling.rrt_moves import RRTMoves
from mobile_planning.sampling.rrt_options import RRTOptions
from mobile_planning.sampling.rrt_search import Search
from mobile_planning.sampling.rrt_setting import Setting
from mobile_planning.sampling.track_result import result_of
from mobile_planning.sampling.tree import Tree, planted
from mobile_planning.stop_flag import StopFlag
from mobile_planning.world.environment import Environment

# Samples drawn before the clock is watched.
_BURST = 200


class RRT(RRTMoves):
    """Class implementing a Rapidely Exploring Random Tree in two dimensions using dubins paths as an expansion method.

    Parameters
    ----------
    environment : Environment
        With a boundary or a grid. Moving obstacles are met where they are when the robot comes by.
    precision : (3,) array_like [m, m, rad]
        Half widths of the goal zone in x, y and psi; 0 is the goal itself.
    **options
        Fields of `RRTOptions`: radius, steering, speed, nb_options, max_extension, scouts, two_trees.

    Attributes
    ----------
    nodes : dict of tuple to Node
        All nodes of the tree, by the reached state (x, y, psi).
    edges : dict of (tuple, tuple) to Edge
    environment : Environment
    goal_rate : float
        The share of samples drawn in the goal zone, of the last run.
    precision : tuple of three float [m, m, rad]
    goal : tuple or None
        Centre of the goal zone.
    root : tuple or None
        Where the tree starts.
    local_planner : LocalPlanner

    Raises
    ------
    InvalidInput
        If a number is not finite or out of its range.

    Notes
    -----
    LaValle (1998), Rapidly-exploring random trees; Karaman and Frazzoli (2011) for ``star``; Kuffner and LaValle (2000)
    for the second tree that grows from the goal where it can (option ``two_trees``), of which only the way to the goal
    is kept. A robot of turning radius 0 goes in straight lines, its positions are (x, y); what has an outline and turns
    on the spot is planned for as the disc that it covers in turning.

    Examples
    --------
    >>> from mobile_planning import Boundary, Environment, RoundObstacle
    >>> world = Environment(Boundary((0, 100), (0, 100)), [RoundObstacle((50, 50), 20)])
    >>> rrt = RRT(world)
    >>> rrt.set_start((10, 50, 0))
    >>> result = rrt.run((90, 50, 0), nb_iteration=5000, seed=1)
    >>> result.status.name, rrt.in_goal_region(tuple(result.path[-1]))
    ('SOLVED', True)
    """

    def __init__(self, environment: Environment, precision: ArrayLike = (5, 5, 1), **options):
        self.options = RRTOptions(**options)
        self.precision = three_numbers(precision, 'precision')
        if min(self.precision) < 0:
            raise InvalidInput(f'precision {self.precision} has a number below 0')
        self.environment = environment
        self.local_planner = LocalPlanner(self.options.radius, self.options.steering)
        self.goal_rate = 0.1
        self.goal = self._tree = self._graph = None
        self._begin = 0.0

    @property
    def environment(self) -> Environment:
        """The world; set it to another when the world has changed, and `prune` the tree."""
        return self._setting.environment

    @environment.setter
    def environment(self, environment: Environment) -> None:
        self._setting = Setting(environment, self.options, self.precision)

    @property
    def root(self) -> tuple[float, ...] | None:
        """The position of the root of the tree."""
        return None if self._tree is None else self._setting.position(self._tree.poses[0])

    @property
    def nodes(self) -> dict[tuple[float, ...], Node]:
        """All nodes of the tree, by their positions; made when first asked for, changing it changes nothing."""
        return self._as_graph().nodes

    @property
    def edges(self) -> dict[tuple[tuple[float, ...], tuple[float, ...]], Edge]:
        """All edges of the tree, by the positions of their ends."""
        return self._as_graph().edges

    def set_start(self, start: ArrayLike, time: float = 0.0) -> None:
        """Resets the graph, and sets the start node as root of the tree.

        Parameters
        ----------
        start : tuple
            The initial position (x, y, psi), used as root.
        time : float [s]
            When the robot is there.

        Raises
        ------
        InvalidInput
            If a number is not finite.
        StartOutside, StartOccupied
            If the robot cannot be there.
        """
        pose = self._setting.pose(start, 'start')
        self._setting.check_start(pose, time)
        self._begin = float(time)
        self._plant(planted(pose, self._setting.bounds))

    def run(
        self, goal: ArrayLike, nb_iteration: int = NB_ITERATION, goal_rate: float = 0.1, metric: str = 'local', *,
        deadline: float | None = None, seed: int | None = None, star: bool = False,
        cancel: NDArray[np.uint8] | None = None, progress: Callable[[float, int, float], None] | None = None,
    ) -> PlanResult:
        """Executes the algorithm with an empty graph, initialized with the start position at least.

        The tree grows on from where the last run left it.

        Parameters
        ----------
        goal : tuple
            The final requested position (x, y, psi).
        nb_iteration : int
            The number of maximal iterations (not using the number of nodes as potentialy the start is in a region of
            unavoidable collision). Beside a deadline the default does not count: the deadline alone ends the run.
        goal_rate : float
            The probability to expand towards the goal rather than towards a randomly selected sample.
        metric : string
            One of 'local' or 'euclidean' ('euclidian' too). The method used to select the closest node on the tree
            from which a path will be grown towards a sample.
        deadline : float, optional [s]
            From now on.
        seed : int, optional
            The same tree, seed and number of iterations give the same answer. Drawn and reported if not given.
        star : bool
            Whether to go on, when a path is found, and make it shorter until the deadline or the iterations are over.
        cancel : (1,) ndarray of uint8, optional
            Set ``cancel[0]`` from another thread to end the run.
        progress : callable, optional
            Called ten times a second with the best cost [m] (infinite before there is one), the number of nodes and
            the time [s] since the run began.

        Returns
        -------
        PlanResult

        Raises
        ------
        InvalidInput
            If a number is out of its range, or there is no start.
        GoalOutside, GoalOccupied
            If no pose of the goal zone is free of what stands still.
        """
        pose = self._setting.pose(goal, 'goal')
        if self._tree is None:
            raise InvalidInput('set_start must come before run')
        check_run(nb_iteration, goal_rate, metric, deadline, seed)
        world, goal_is_free = self._setting.world(self._tree.poses[0], self._begin, pose)
        seed = int(np.random.SeedSequence().entropy % 2**63) if seed is None else int(seed)
        self.goal, self.goal_rate = self._setting.position(pose), float(goal_rate)
        budget = np.inf if deadline is not None and nb_iteration == NB_ITERATION else nb_iteration
        flag = StopFlag(None if deadline is None else float(deadline), cancel)
        task = self._setting.task(pose, self._begin, goal_rate, metric)
        search = Search(world, self._tree, task, seed, budget, flag.array, progress, self.options.scouts,
                        self.options.two_trees and goal_is_free)
        try:
            flag.check()
            # Most queries are answered before a thread that watches the clock would have begun.
            search.to_first_path(_BURST)
            if star or not search.history:
                with flag:
                    search.to_first_path()
                    if star:
                        search.improve()
        except (PlanningTimeout, Cancelled):
            pass
        self._plant(search.tree)
        return self._result(search, cancel)

    def in_goal_region(self, sample: ArrayLike) -> bool:
        """Method to determine if a point is within a goal region or not.

        Parameters
        ----------
        sample : tuple
            (x, y, psi) the position of the point which needs to be tested.
        """
        if self.goal is None:
            raise InvalidInput('there is no goal before the first run')
        setting = self._setting
        return setting.is_in_zone(setting.pose(sample, 'sample'), setting.pose(self.goal, 'goal'))

    def plot(self, file_name: str | Path = '', close: bool = False, nodes: bool = False):
        """Displays the tree using matplotlib, on a currently open figure.

        Parameters
        ----------
        file_name : string
            The name of the file used to save an image of the tree; none is written if it is empty.
        close : bool
            If the plot needs to be automaticaly closed after the drawing.
        nodes : bool
            If the nodes need to be displayed as well.

        Returns
        -------
        matplotlib.figure.Figure
        """
        from mobile_planning.sampling.rrt_plot import plot_tree

        return plot_tree(self, file_name, close, nodes)

    def _plant(self, tree: Tree) -> None:
        """Take a tree in place of the old one."""
        self._tree, self._graph = tree, None

    def _as_graph(self) -> Graph:
        if self._tree is None:
            raise InvalidInput('there is no tree before set_start')
        if self._graph is None:
            self._graph = Graph(self._tree, self._setting.car, self._begin, self.options.speed)
        return self._graph

    def _result(self, search: Search, cancel: NDArray[np.uint8] | None) -> PlanResult:
        if search.history:
            status, track, end = PlanStatus.SOLVED, search.track, search.end
        else:
            node = search.nearest_to_goal()
            track, end = search.track_to(node), search.tree.poses[node]
            status = PlanStatus.APPROXIMATE if search.iterations >= search.budget else PlanStatus.TIMEOUT
            if cancel is not None and cancel[0]:
                status = PlanStatus.CANCELLED
        return replace(
            result_of(track, end, self._setting.car), status=status, seed=search.seed,
            history=tuple(search.history), iterations=search.iterations, nodes=search.tree.count,
            elapsed=search.elapsed)
