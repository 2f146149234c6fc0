"""Worlds and robots for the tests of the fleet."""
import numpy as np

from mobile_planning import Boundary, Robot, UnicycleKineModel, WorldSim

ROOM = Boundary((0, 10), (0, 6))
#: Start and goal pose of two robots that swap places.
SWAP = [((1, 3, 0.0), (9, 3, 0.0)), ((9, 3, np.pi), (1, 3, np.pi))]


def robot(eyed, start, goal, *, obstacles=(), boundary=ROOM, u_max=(1.0, 5.0), a_max=(2.0, 10.0), kind=Robot,
          **options):
    return kind(eyed, UnicycleKineModel(start, goal, u_max=u_max, a_max=a_max), obstacles, boundary, **options)


def mission(robots, obstacles=(), boundary=ROOM, grid=None):
    return WorldSim('mission', robots, obstacles, boundary, grid)


def swap(**options):
    """Return a mission of two robots that swap places in a room."""
    return mission([robot(index + 1, *poses, **options) for index, poses in enumerate(SWAP)])


def exchange(robots, until, delivers=lambda now: True, since=0.0, step=0.25):
    """Step robots in turn, hand each message to all at once where ``delivers`` says so; yield (now, robot, said).

    What falls due meanwhile is said before the next robot's step.
    """
    for cycle in range(int(round(until / step))):
        for index, sender in enumerate(robots):
            now = since + (cycle + index / len(robots)) * step
            messages = sender.step(now)
            yield now, sender, messages
            while messages:
                for message in messages if delivers(cycle * step) else ():
                    for peer in robots:
                        peer.receive(message, now)
                messages = [answer for peer in robots if peer.has_answers for answer in peer.answers(now)]


def drive_alone(agent, until, since=0.0):
    """Step a robot without peers until it is done or time is up; return the time."""
    agent.start([agent.eyed], since)
    for cycle in range(int(until / agent.Tc)):
        now = since + cycle * agent.Tc
        agent.step(now)
        if agent.is_done:
            break
    return now


def under_way(count=6):
    """Return a robot that drives alone, and the time of its next cycle."""
    agent = robot(1, *SWAP[0])
    agent.start([1], 0.0)
    for cycle in range(count):
        agent.step(cycle * agent.Tc)
    return agent, count * agent.Tc


def stepped(agent, now):
    """Let an `Agent` take a step and make what it asks for; return what it says."""
    messages = agent.step(lambda: now)
    while (request := agent.take_request()) is not None:
        messages += agent.propose(request.plan(), now)
    return messages
