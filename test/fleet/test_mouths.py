"""Mouths of lanes: places to wait at, beside the way of those who come out."""
import numpy as np
import pytest

from mobile_planning import Boundary, Environment, PolygonObstacle
from mobile_planning.fleet.mouths import finer_at_mouths, mouths
from mobile_planning.fleet.roadmap import TIGHT, Roadmap

RADIUS, NEED = 0.205, 0.51


def corridor(angle, width=0.65):
    """Return two rooms joined by a corridor of 3 m along the x axis, all turned by ``angle`` [rad]."""
    cos, sin = np.cos(angle), np.sin(angle)
    walls = [PolygonObstacle(np.array([(-1.5, y), (1.5, y), (1.5, y + 4), (-1.5, y + 4)]) @ [[cos, sin], [-sin, cos]])
             for y in (width / 2, -width / 2 - 4)]
    return Roadmap(Environment(Boundary((-4, 4), (-3, 3)), walls), RADIUS)


@pytest.mark.parametrize('angle', (0.0, 0.3))
def test_both_ends_of_a_corridor_are_found_and_which_way_leads_out(angle):
    found = mouths(corridor(angle), NEED)
    along = np.array([np.cos(angle), np.sin(angle)])
    ends = sorted((float(place @ along), float(outwards @ along)) for place, outwards in found)
    assert [round(outwards) for _, outwards in ends] == [-1, 1]
    assert all(abs(abs(place) - 1.5) < 0.3 and abs(outwards) > 0.95 for place, outwards in ends)


@pytest.mark.parametrize('angle', (0.0, 0.3))
def test_on_each_side_of_a_way_out_there_is_a_place_to_wait_just_far_enough(angle):
    roadmap = corridor(angle)
    finer = finer_at_mouths(roadmap, NEED)
    new = finer.places[len(roadmap.places):]
    assert (finer.environment.clearance(new) >= RADIUS + TIGHT).all()
    for place, outwards in mouths(roadmap, NEED):
        ahead = (finer.places - place) @ outwards
        aside = (finer.places - place) @ np.array([-outwards[1], outwards[0]])
        near = (ahead > 0) & (ahead < 2 * NEED)
        assert ((aside[near] >= NEED - 0.02) & (aside[near] < NEED + 0.1)).any()
        assert ((-aside[near] >= NEED - 0.02) & (-aside[near] < NEED + 0.1)).any()


def test_a_world_without_lanes_needs_no_more_places():
    roadmap = Roadmap(Environment(Boundary((0, 5), (0, 5))), RADIUS)
    assert finer_at_mouths(roadmap, NEED) is roadmap


def test_lanes_of_which_none_has_a_mouth_need_no_more_places(monkeypatch):
    monkeypatch.setattr('mobile_planning.fleet.mouths.mouths', lambda roadmap, apart: [])
    roadmap = corridor(0.0)
    assert finer_at_mouths(roadmap, NEED).places.tolist() == roadmap.places.tolist()
