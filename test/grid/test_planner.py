"""What every grid planner does with its grid, its endpoints and its axes."""
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mobile_planning.errors import (
    GoalOccupied, GoalOutside, InvalidInput, PlanningError, StartOccupied, StartOutside)
from mobile_planning.grid.planner import PlannerBase
from mobile_planning.world.occupancy_grid import OccupancyGrid

WALL = np.array([[0, 0, 7, 0], [0, 0, 1, 0], [0, 0, 0, 0]])


def test_endpoints_are_cells_of_integers():
    planner = PlannerBase(WALL, start=(0.4, 1.6), goal=[3, 0])
    assert planner.start.tolist() == [0, 2] and planner.goal.tolist() == [3, 0]
    assert planner.validate_endpoint((1, 1), dtype=float).dtype == float


@pytest.mark.parametrize('point', [(4, 0), (-1, 0), (0, 3), (0, -1), (1e300, 0), (-1e300, 0)])
def test_outside_the_grid_is_occupied_and_no_endpoint(point):
    planner = PlannerBase(WALL)
    assert planner.isoccupied(point)
    with pytest.raises(StartOutside):
        planner.start = point
    with pytest.raises(GoalOutside):
        planner.goal = point


def test_an_occupied_cell_is_no_endpoint():
    planner = PlannerBase(WALL)
    assert planner.isoccupied((2, 0)) and not planner.isoccupied((1, 0))
    for name, kind in (('start', StartOccupied), ('goal', GoalOccupied)):
        with pytest.raises(kind, match=rf'{name} \(2, 1\) is occupied') as caught:
            setattr(planner, name, (2, 1))
        assert isinstance(caught.value, ValueError) and isinstance(caught.value, PlanningError)


@pytest.mark.parametrize('point', [(np.nan, 0), (0, np.inf), (0,), (0, 0, 0), 'ab', None, [[0, 0]]])
def test_a_point_that_is_not_two_numbers_is_invalid(point):
    planner = PlannerBase(WALL)
    with pytest.raises(InvalidInput):
        planner.isoccupied(point)
    with pytest.raises(InvalidInput):
        planner.validate_endpoint(point)


def test_without_a_grid_nothing_is_occupied():
    planner = PlannerBase()
    assert not planner.isoccupied((100, -100)) and planner.occgrid is None
    assert planner.validate_endpoint((100, -100)).tolist() == [100, -100]


@given(st.integers(0, 2 ** 30), st.integers(0, 20))
def test_inflation_is_the_disc_and_leaves_the_callers_grid_alone(seed, quarters):
    radius = quarters / 4
    occupied = np.random.default_rng(seed).random((9, 12)) < 0.1
    before = occupied.copy()
    planner = PlannerBase(occupied, inflate=radius)
    y, x = np.indices(occupied.shape)
    expected = np.zeros_like(occupied)
    for row, column in np.argwhere(occupied):
        expected |= (x - column) ** 2 + (y - row) ** 2 <= radius ** 2
    assert np.array_equal(planner.occgrid, expected)
    assert np.array_equal(occupied, before)


def test_an_inflated_cell_is_told_from_an_obstacle():
    with pytest.raises(StartOccupied, match=r'start \(1, 0\) is within 1 cells of an obstacle'):
        PlannerBase(WALL, inflate=1, start=(1, 0))


@pytest.mark.parametrize('inflate', [-1, np.nan, np.inf])
def test_inflation_is_a_number_of_at_least_0(inflate):
    with pytest.raises(InvalidInput):
        PlannerBase(WALL, inflate=inflate)


def test_an_occupancy_grid_is_read_by_threshold_and_unknown_rule():
    grid = OccupancyGrid(np.array([[0, 64, 65, 100, -1]], np.int8))
    assert PlannerBase(grid).occgrid.tolist() == [[False, False, True, True, True]]
    assert PlannerBase(grid, unknown_is_free=True).occgrid.tolist() == [[False, False, True, True, False]]
    assert PlannerBase(grid, occupied_from=100).occgrid.tolist() == [[False, False, False, True, True]]


def test_the_grid_of_a_planner_cannot_be_written():
    with pytest.raises(ValueError):
        PlannerBase(WALL).occgrid[0, 0] = True


def test_a_later_change_of_the_callers_array_changes_nothing():
    occupied = np.zeros((3, 3), bool)
    planner = PlannerBase(occupied)
    occupied[1, 1] = True
    assert not planner.isoccupied((1, 1))


def test_an_unknown_option_is_a_type_error():
    with pytest.raises(TypeError):
        PlannerBase(WALL, inflated=2)


class Rightwards(PlannerBase):
    """Steps to the right until it stands at the goal."""

    def has_plan(self):
        return True

    def _next(self, cell):
        return None if np.array_equal(cell, self.goal) else cell + (1, 0)


def test_a_query_of_any_planner_follows_its_next_to_the_goal():
    planner = Rightwards(np.zeros((1, 5)))
    assert planner.query((1, 0), (4, 0)).tolist() == [[1, 0], [2, 0], [3, 0], [4, 0]]
    assert planner.query((4, 0), dtype=float).dtype == float


def test_a_query_needs_a_start():
    with pytest.raises(InvalidInput, match='no start'):
        Rightwards(np.zeros((1, 5)), goal=(4, 0)).query()


def test_a_planner_prints_its_grid_and_ends():
    text = str(PlannerBase(WALL, start=(0, 0)))
    assert 'PlannerBase' in text and '4 x 3 cells' in text and 'start: (0, 0)' in text and 'goal: none' in text


def test_the_plot_shows_grid_path_and_ends_without_pyplot(tmp_path):
    import sys

    planner = PlannerBase(WALL, start=(0, 0), goal=(3, 0), inflate=0.5)
    axes = planner.plot([(0, 0), (1, 2), (2, 2), (3, 0)])
    assert len(axes.images) == 1
    assert {line.get_label() for line in axes.lines} >= {'path', 'start', 'goal'}
    axes.figure.savefig(tmp_path / 'plan.png')
    assert (tmp_path / 'plan.png').stat().st_size > 1000
    assert 'matplotlib.pyplot' not in sys.modules or not sys.modules['matplotlib.pyplot'].get_fignums()


def test_the_plot_draws_into_given_axes_with_given_styles():
    planner = PlannerBase(WALL)
    axes = planner.plot_bg()
    assert planner.plot([(0, 0), (1, 0)], ax=axes, background=False, start=(0, 0), start_marker={'marker': 's'},
                        line=({'color': 'blue'},)) is axes
    assert [line.get_marker() for line in axes.lines] == ['None', 's']
