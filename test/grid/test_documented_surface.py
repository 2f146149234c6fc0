"""The toolbox's documents name methods, parameters and defaults: code written for them finds them all here."""
import inspect

import pytest

from mobile_planning import Bug2, DistanceTransformPlanner, DstarPlanner, LatticePlanner

PLOT = {'path': None, 'line': None, 'line_r': None, 'configspace': False, 'unwrap': True, 'direction': None,
        'background': True, 'path_marker': None, 'path_marker_reverse': None, 'start_marker': None,
        'goal_marker': None, 'start_vehicle': None, 'goal_vehicle': None, 'start': None, 'goal': None, 'ax': None,
        'block': None, 'bgargs': None}
PLOT_BG = {'distance': None, 'cmap': 'gray', 'ax': None, 'inflated': True, 'colorbar': True, 'block': None}
EVERY = {'plot': PLOT, 'plot_bg': PLOT_BG, 'isoccupied': {'p': ...}, 'validate_endpoint': {'p': ..., 'dtype': None}}
DOCUMENTED = {
    DistanceTransformPlanner: {
        **EVERY, '__init__': {'occgrid': None, 'metric': 'euclidean'},
        'plan': {'goal': None, 'animate': False, 'summary': False}, 'next': {'position': ...},
        'plot_3d': {'path': None, 'ls': None},
        'query': {'start': None, 'goal': None, 'dtype': None, 'next': True, 'animate': False, 'movie': None}},
    DstarPlanner: {
        **EVERY, '__init__': {'costmap': None},
        'plan': {'goal': None, 'animate': False, 'progress': True, 'summary': False},
        'query': {'start': ..., 'sensor': None, 'animate': False, 'verbose': False}},
    LatticePlanner: {
        **EVERY, '__init__': {'costs': None, 'root': (0, 0, 0)},
        'plan': {'iterations': None, 'verbose': False, 'summary': False}, 'query': {'start': ..., 'goal': ...}},
    Bug2: {**EVERY, 'run': {'start': ..., 'goal': ..., 'animate': False, 'movie': None}},
}


@pytest.mark.parametrize('planner', DOCUMENTED, ids=lambda planner: planner.__name__)
def test_every_documented_parameter_is_there_with_its_default(planner):
    for name, documented in DOCUMENTED[planner].items():
        signature = inspect.signature(getattr(planner, name)).parameters
        assert list(documented) == [parameter for parameter in signature if parameter in documented], name
        for parameter, default in documented.items():
            assert default is ... or signature[parameter].default == default, (name, parameter)


@pytest.mark.parametrize('planner', DOCUMENTED, ids=lambda planner: planner.__name__)
def test_every_planner_has_the_documented_properties_and_prints_itself(planner):
    made = planner()
    assert (made.start, made.goal, made.occgrid, made.verbose) == (None, None, None, False)
    made.verbose = True
    assert made.verbose and str(made).startswith(planner.__name__)


@pytest.mark.parametrize('planner', DOCUMENTED, ids=lambda planner: planner.__name__)
def test_no_planner_swallows_an_option_that_it_does_not_know(planner):
    with pytest.raises(TypeError, match='colour'):
        planner(colour='red')
