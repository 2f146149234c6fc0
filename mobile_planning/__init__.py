"""Motion planning for mobile robots on a shared map, with or without ROS.

Every public name is importable from here and loaded when it is first used, so
that ``import mobile_planning`` costs nothing but this table.
"""
from importlib import import_module

_HOMES = {
    'errors': (
        'PlanningError', 'InvalidPlanner', 'UnknownFrame', 'StartOutside', 'GoalOutside',
        'StartOccupied', 'GoalOccupied', 'PlanningTimeout', 'NoPath', 'NoMap', 'InvalidInput',
        'ApproximateOnly', 'Cancelled', 'LimitExceeded', 'MapError', 'MapNotFound',
        'InvalidMapData', 'InvalidMapMetadata', 'NotBuilt', 'StrategyLocked'),
    'world.occupancy_grid': ('OccupancyGrid',),
    'world.map_io': ('load_map', 'save_map'),
    'world.obstacles': ('Obstacle', 'RoundObstacle', 'PolygonObstacle', 'RectangleObstacle'),
    'world.moving_obstacle': ('MovingObstacle',),
    'world.footprint': ('Footprint',),
    'world.boundary': ('Boundary',),
    'world.environment': ('Environment',),
    'world.cost_to_go': ('cost_to_go', 'shortcut'),
    'grid.planner': ('PlannerBase',),
    'grid.distance_transform': ('DistanceTransformPlanner',),
    'grid.lattice': ('LatticePlanner',),
    'grid.lattice_status': ('LatticeStatus', 'LatticeEdge'),
    'grid.bug2': ('Bug2', 'Bug2Step'),
    'grid.dstar': ('DstarPlanner',),
    'grid.astar': ('astar',),
    'grid.clearance_costs': ('clearance_costs',),
    'grid.resample': ('resample',),
    'sampling.dubins': ('DubinsPath', 'dubins_shortest', 'dubins_options', 'dubins_lengths'),
    'sampling.reeds_shepp': (
        'ReedsSheppPath', 'reeds_shepp_shortest', 'reeds_shepp_options', 'reeds_shepp_lengths'),
    'sampling.curve': ('Curve', 'Segment'),
    'sampling.rrt': ('RRT',),
    'sampling.steering': ('Steering',),
    'sampling.rrt_graph': ('Edge', 'Node'),
    'sampling.rrt_moves': ('EdgeRule',),
    'sampling.plan_result': ('PlanResult', 'PlanStatus'),
    'sampling.smoothing': ('smooth',),
    'sampling.problem': ('Problem', 'load_problem'),
    'sampling.prm': ('PRMPlanner',),
    'sampling.spaces': ('JointSpace', 'joint_weights'),
    'path_server': ('PathServer',),
    'fleet.kinematics': ('UnicycleKineModel',),
    'fleet.message': ('RobotMsg',),
    'fleet.robot': ('Robot',),
    'fleet.verification': ('Report', 'verify'),
    'fleet.world_sim': ('WorldSim',),
}
_HOME_OF = {name: module for module, names in _HOMES.items() for name in names}

__version__ = '0.1.0'
__all__ = sorted(_HOME_OF)


def __getattr__(name):
    """Import the public ``name`` from its home at first use."""
    if name not in _HOME_OF:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    value = getattr(import_module(f'{__name__}.{_HOME_OF[name]}'), name)
    globals()[name] = value
    return value


def __dir__():
    """Return the public names, loaded or not."""
    return sorted({*globals(), *__all__})
