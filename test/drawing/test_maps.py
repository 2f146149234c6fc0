"""Pictures: what is drawn where, checked on the rendered pixels."""
import numpy as np
import pytest

from mobile_planning.drawing import maps


def colour_at(axes, x, y):
    """Return the rendered colour (3,) at a point of the data."""
    axes.figure.canvas.draw()
    pixels = np.asarray(axes.figure.canvas.buffer_rgba())
    column, row = axes.transData.transform((x, y))
    return pixels[len(pixels) - 1 - int(row), int(column), :3] / 255.0


@pytest.mark.parametrize('origin', [(0, 0, 0), (-7, 3, 0), (2, 1, 0.7), (0, 0, -2.5)])
def test_a_map_is_drawn_where_it_lies(origin):
    data = np.zeros((20, 30), np.int8)
    data[15:, :10], data[:5, 20:] = 100, -1
    figure, axes = maps.new_figure(15, 10, 'depot')
    maps.draw_map(axes, data, 0.5, origin)
    x, y, yaw = origin
    turn = np.array([[np.cos(yaw), np.sin(yaw)], [-np.sin(yaw), np.cos(yaw)]])
    for cell, colour in (((5, 17), maps.OCCUPIED_COLOUR), ((25, 2), maps.UNKNOWN_COLOUR), ((15, 10), maps.FREE_COLOUR)):
        point = (np.array(cell) + 0.5) * 0.5 @ turn + (x, y)
        np.testing.assert_allclose(colour_at(axes, *point), colour, atol=0.01)
    corners = np.array([(0, 0), (15, 0), (15, 10), (0, 10)]) @ turn + (x, y)
    np.testing.assert_allclose(axes.get_xlim(), (corners[:, 0].min(), corners[:, 0].max()))
    np.testing.assert_allclose(axes.get_ylim(), (corners[:, 1].min(), corners[:, 1].max()))


def test_values_between_free_and_occupied_are_grey():
    _, axes = maps.new_figure(2, 1)
    maps.draw_map(axes, [[50, 0]])
    grey = np.mean([maps.FREE_COLOUR, maps.OCCUPIED_COLOUR], axis=0)
    np.testing.assert_allclose(colour_at(axes, 0.5, 0.5), grey, atol=0.01)


def test_a_field_shows_obstacles_red_and_what_is_cut_off_pink():
    _, axes = maps.new_figure(3, 1)
    maps.draw_field(axes, [[0.0, np.nan, np.inf]], label='distance [cells]')
    np.testing.assert_allclose(colour_at(axes, 1.5, 0.5), maps.RED, atol=0.01)
    np.testing.assert_allclose(colour_at(axes, 2.5, 0.5), maps.PINK, atol=0.01)
    assert len(axes.figure.axes) == 2


def test_a_path_with_poses_and_a_legend_is_saved(tmp_path):
    figure, axes = maps.new_figure(30, 15, 'a path')
    maps.draw_map(axes, np.zeros((15, 30)), 1.0)
    maps.draw_path(axes, [(1, 1, 0), (5, 5, 0), (20, 5, 0)], label='path')
    maps.draw_pose(axes, (1, 1, 0.5), maps.START_MARKER, label='start')
    maps.draw_pose(axes, (20, 5), maps.GOAL_MARKER, label='goal')
    maps.draw_legend(axes)
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ['path', 'start', 'goal']
    assert axes.get_title(loc='left') == 'a path' and axes.get_xlabel() == 'x [m]'
    maps.save(figure, tmp_path / 'path.png')
    assert (tmp_path / 'path.png').read_bytes().startswith(b'\x89PNG')
