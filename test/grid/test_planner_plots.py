"""Every option of a planner's plots, read back from what was drawn."""
import sys

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.patches import Polygon

from mobile_planning.drawing import maps
from mobile_planning.errors import InvalidInput
from mobile_planning.grid.distance_transform import DistanceTransformPlanner
from mobile_planning.grid.lattice import LatticePlanner
from mobile_planning.grid.planner import PlannerBase

GRID = np.array([[0, 0, 0, 0, 0, 0], [0, 0, 0, 1, 0, 0], [0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 0]])
PATH = [(0, 0, 0.0), (1, 0, 0.0), (2, 0, np.pi / 2), (2, 1, np.pi), (1, 1, -3.0)]


def by_label(axes):
    return {line.get_label(): line for line in axes.lines}


def colours(axes):
    return [to_rgb(line.get_color()) for line in axes.lines]


@pytest.fixture
def planner():
    return PlannerBase(GRID, start=(0, 0), goal=(5, 0))


def test_a_path_is_striped_yellow_on_black(planner):
    axes = planner.plot(PATH)
    black, yellow = axes.lines[:2]
    assert to_rgb(black.get_color()) == to_rgb('black') and to_rgb(yellow.get_color()) == to_rgb('yellow')
    assert black.get_linewidth() > yellow.get_linewidth() and yellow.is_dashed() and not black.is_dashed()


def test_parts_driven_backwards_are_striped_red(planner):
    axes = planner.plot(PATH, direction=[1, 1, -1, -1, 1])
    drawn = [(to_rgb(line.get_color()), line.get_xdata().tolist()) for line in axes.lines if len(line.get_xdata()) > 1]
    assert (to_rgb('yellow'), [0, 1]) in drawn
    assert (to_rgb('red'), [1, 2, 2]) in drawn
    assert (to_rgb('yellow'), [2, 1]) in drawn
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ['path', 'path, backwards', 'start', 'goal']


def test_line_styles_are_one_dict_or_several(planner):
    axes = planner.plot(PATH, line={'color': 'blue'}, line_r=[{'color': 'green'}], direction=[1, 1, 1, -1, -1])
    assert colours(axes)[:2] == [to_rgb('blue'), to_rgb('green')]


def test_points_of_a_path_are_marked_if_asked_for(planner):
    axes = planner.plot(PATH, path_marker={'marker': 's'}, path_marker_reverse={'marker': 'v'},
                        direction=[1, 1, -1, 1, 1])
    counts = {line.get_marker(): len(line.get_xdata()) for line in axes.lines}
    assert counts['s'] == 4 and counts['v'] == 1
    assert 's' not in {line.get_marker() for line in planner.plot(PATH).lines}


def test_a_point_is_a_circle_and_a_star_unless_styled(planner):
    drawn = by_label(planner.plot())
    assert drawn['start'].get_marker() == 'o' and drawn['goal'].get_marker() == '*'
    drawn = by_label(planner.plot(start_marker={'marker': 's'}, goal_marker={'color': 'blue'}))
    assert drawn['start'].get_marker() == 's'
    assert drawn['goal'].get_marker() == '*' and drawn['goal'].get_color() == 'blue'


def test_the_documents_way_to_style_the_start_works(planner):
    start = by_label(planner.plot(PATH, start=dict(marker='s', color='b')))['start']
    assert start.get_marker() == 's' and start.get_color() == 'b' and start.get_xdata().tolist() == [0]


def test_other_ends_are_drawn_without_being_set(planner):
    drawn = by_label(planner.plot(start=(1, 3), goal=(4, 2)))
    assert drawn['start'].get_xdata().tolist() == [1] and drawn['goal'].get_ydata().tolist() == [2]
    assert planner.start.tolist() == [0, 0] and planner.goal.tolist() == [5, 0]


def test_a_configuration_is_a_car_outlined_at_the_start_and_filled_at_the_goal(planner):
    axes = planner.plot(start=(1, 1, 0), goal=(4, 3, np.pi / 2))
    start, goal = (patch for patch in axes.patches if isinstance(patch, Polygon))
    assert not start.get_fill() and goal.get_fill() and 0 < goal.get_alpha() < 1
    # The nose of the first points to +x, that of the second to +y.
    assert np.ptp(start.get_xy()[:, 0]) > np.ptp(start.get_xy()[:, 1])
    assert np.ptp(goal.get_xy()[:, 1]) > np.ptp(goal.get_xy()[:, 0])


def test_a_vehicle_is_a_triangle_of_any_colour_if_asked_for(planner):
    axes = planner.plot(start=(1, 1, 0), start_vehicle={'shape': 'triangle', 'length': 2.0,
                                                        'args': {'filled': True, 'color': 'orange'}})
    (triangle,) = axes.patches
    assert len(triangle.get_xy()) == 4 and triangle.get_fill()  # the first corner again at the end
    assert to_rgb(triangle.get_facecolor()[:3]) == to_rgb('orange')
    assert np.ptp(triangle.get_xy()[:, 0]) == pytest.approx(2.0)
    for wrong in ({'shape': 'bus'}, {'colour': 'red'}):
        with pytest.raises(ValueError, match='vehicle'):
            planner.plot(start=(1, 1, 0), start_vehicle=wrong)


def test_configuration_space_has_theta_upwards_and_unwrapped(planner):
    axes = planner.plot(PATH, configspace=True, start=PATH[0], goal=PATH[-1])
    assert maps.is_space(axes) and axes.get_zlabel() == 'theta [rad]'
    heights = np.asarray(axes.lines[0].get_data_3d()[2])
    assert np.allclose(heights, np.unwrap([point[2] for point in PATH])) and heights.max() > np.pi
    goal = by_label(axes)['goal'].get_data_3d()
    assert np.allclose(np.ravel(goal), (1, 1, 2 * np.pi - 3))
    wrapped = planner.plot(PATH, configspace=True, unwrap=False).lines[0].get_data_3d()[2]
    assert np.allclose(wrapped, [point[2] for point in PATH])


def test_a_path_that_does_not_fit_the_plot_is_refused(planner):
    with pytest.raises(InvalidInput, match='configspace'):
        planner.plot([(0, 0), (1, 1)], configspace=True)
    with pytest.raises(InvalidInput, match='direction'):
        planner.plot(PATH, direction=[1, 1])
    with pytest.raises(InvalidInput, match='path'):
        planner.plot([1, 2, 3])
    with pytest.raises(TypeError):
        planner.plot(PATH, colour='blue')


def test_the_background_can_be_left_out_or_told_more(planner):
    assert len(planner.plot(background=False).images) == 0
    planner = DistanceTransformPlanner(GRID, goal=(0, 0))
    planner.plan()
    axes = planner.plot(bgargs={'cmap': 'viridis', 'colorbar': False})
    assert axes.images[0].get_cmap().name == 'viridis' and len(axes.figure.axes) == 1


def test_cells_are_white_red_and_pink(planner):
    axes = PlannerBase(GRID, inflate=1).plot_bg()
    image = np.asarray(axes.images[0].get_array())
    assert np.allclose(image[1, 3], maps.RED) and np.allclose(image[0, 3], maps.PINK) and (image[0, 0] == 1).all()
    image = np.asarray(PlannerBase(GRID, inflate=1).plot_bg(inflated=False).images[0].get_array())
    assert np.allclose(image[1, 3], maps.RED) and (image[0, 3] == 1).all()


def test_a_distance_field_has_a_colour_bar_and_is_dark_near_the_goal():
    planner = DistanceTransformPlanner(GRID, goal=(0, 0))
    planner.plan()
    axes = planner.plot_bg()
    assert len(axes.figure.axes) == 2
    grey = axes.images[0].to_rgba(axes.images[0].get_array())[..., 0]
    assert grey[0, 0] < grey[3, 5]
    other = planner.plot_bg(distance=np.full(GRID.shape, 7.0))
    assert (np.asarray(other.images[0].get_array()) == 7).all()


def test_the_cost_surface_carries_the_path(tmp_path):
    planner = DistanceTransformPlanner(GRID, goal=(0, 0))
    with pytest.raises(RuntimeError, match='plan()'):
        planner.plot_3d()
    planner.plan()
    path = planner.query((5, 3))
    axes = planner.plot_3d(path, ls={'color': 'blue'})
    (line,) = axes.lines
    assert line.get_color() == 'blue' and len(line.get_data_3d()[0]) == len(path)
    assert (np.diff(line.get_data_3d()[2]) < 0).all()
    axes.figure.savefig(tmp_path / 'surface.png')


def test_nothing_belongs_to_pyplot_unless_a_window_is_asked_for(planner, monkeypatch):
    from matplotlib import pyplot

    before = pyplot.get_fignums()
    planner.plot(PATH)
    planner.plot_bg()
    assert pyplot.get_fignums() == before
    shown = []
    monkeypatch.setattr(pyplot, 'show', lambda block: shown.append(block))
    for block in (True, False):
        axes = planner.plot(PATH, block=block)
        assert axes.figure.number in pyplot.get_fignums()
        pyplot.close(axes.figure)
    planner.plot_bg(block=False)
    pyplot.close('all')
    assert shown == [True, False, False] and 'matplotlib.pyplot' in sys.modules


def test_an_animation_in_a_window_shows_every_step(planner, monkeypatch):
    from matplotlib import pyplot

    frames = []
    monkeypatch.setattr(pyplot, 'pause', frames.append)
    planner = DistanceTransformPlanner(GRID, goal=(0, 0))
    planner.plan(animate=True)
    assert len(frames) >= 5
    frames.clear()
    path = planner.query((5, 0), animate=True)
    assert len(frames) == len(path)
    pyplot.close('all')


def test_the_graph_of_a_lattice_is_drawn_under_the_path():
    lattice = LatticePlanner(root=(0, 0, 0))
    lattice.plan(3)
    path, _ = lattice.query((0, 0, 0), (1, 2, np.pi / 2))
    axes = lattice.plot(path)
    assert len(axes.collections[0].get_segments()) == lattice.nedges
    # The path is drawn with its arc: every point of it is one away from the arc's centre.
    x, y = axes.lines[1].get_data()
    arc = y <= 1
    assert np.allclose(np.hypot(np.asarray(x)[arc], np.asarray(y)[arc] - 1), 1, atol=1e-9)
