"""Agents for the tests of the fleet."""
import numpy as np
from missions import stepped

from mobile_planning.fleet.agent import Agent
from mobile_planning.fleet.announcement import Announcement, State
from mobile_planning.fleet.logbook import Logbook
from mobile_planning.fleet.scene import RobotSpec, Scene
from mobile_planning.world.environment import Boundary
from mobile_planning.world.occupancy_grid import OccupancyGrid

FREE = OccupancyGrid(np.zeros((40, 40), np.int8), 0.1)


def scene(on_map=True):
    """Return two robots that pass each other."""
    specs = RobotSpec(1, (1, 1, 0), (2, 1, 0)), RobotSpec(2, (2, 3, 0), (1, 3, 0))
    return Scene('m', specs, boundary=None if on_map else Boundary((0, 4), (0, 4)), on_map=on_map)


def agent(robot_id=1, on_map=True, epoch=5):
    """Return an agent switched on at 0 s."""
    return Agent(scene(on_map), robot_id, epoch, 0.0)


def drive(agents, begin, end):
    """Let the agents talk for a while, in logical time [s]; what falls due in between is said at once."""
    for now in np.arange(begin, end, 0.25):
        for sender in agents:
            messages = stepped(sender, now)
            while messages:
                for message in messages:
                    for each in agents:
                        each.receive(message, now)
                messages = [message for each in agents if each.has_answers for message in each.answers(now)]


def restarted(book, start, epoch=6, listed=scene(False), moved=0.0):
    """Return robot 1 started anew, when its body rests, in the mission of ``start``, and when that is.

    Somebody has ``moved`` it [m] meanwhile.
    """
    left = Logbook(book).read()[-1].plan
    now = left.end_knot * left.step + 1.0
    one = Agent(listed, 1, epoch, now, book=Logbook(book), is_placed=False)
    one.place(left.state(now)[:3] + np.array([moved, 0, 0]), now)
    one.follow(Announcement('m', State.STARTED, (1,), start), now)
    return one, now
