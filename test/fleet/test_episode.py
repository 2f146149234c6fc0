"""The event loop: who is asked what and when, with robots that only write it down."""
from dataclasses import dataclass, field
from types import SimpleNamespace

import numpy as np
import pytest
from mobile_planning import GoalOutside, InvalidInput
from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.channel import Channel, Cut
from mobile_planning.fleet.episode import ANSWER_DELAY, Episode
from mobile_planning.fleet.faults import Faults, Join, Kill, SolveTime
from mobile_planning.fleet.link import Terms
from mobile_planning.fleet.message import Contracts, Death, Link
from mobile_planning.fleet.solution import Solution

TC = 0.25
AT_ONCE = SolveTime(0.0, 0.0)


@dataclass(eq=False)
class Scribe:
    """A robot that stays where it is, says one message a cycle, and writes down what befalls it."""

    eyed: int
    at: tuple = (0.0, 0.0)
    epoch: int = 1
    answers_to: int = 0
    sensor_range: float = np.inf
    Tc: float = TC
    phase: float = 0.1
    margin: float = 0.005
    says_to: tuple = tuple(range(1, 10))
    plan: Plan = None
    request: object = None
    log: list = field(default_factory=list)

    def __post_init__(self):
        self.rho, self.is_done, self.has_answers, self._sequence = 0.2, False, False, 0
        self.method, self.cycle = 'contracts', self.Tc
        self.goal = np.array([*self.at, 0.0])
        self.limits = SimpleNamespace(radius=0.2 + self.margin, v_max=1.0)
        self.plan = Plan.at_rest(0, self.Tc, np.array([*self.at, 0.0])) if self.plan is None else self.plan
        self.protocol = SimpleNamespace(epoch=self.epoch, rest_time=3.75, terms=Terms(rest_time=3.75), sides={},
                                        links=lambda now: {}, may_move=lambda now, at_rest: False)

    def of(self, kind):
        return [entry[1:] for entry in self.log if entry[0] == kind]

    def start(self, roster, start_time, resting):
        self.log.append(('start', roster, start_time, resting))

    def set_goal(self, goal, now):
        self.log.append(('goal', now, tuple(goal)))
        if goal[0] > 99:
            raise GoalOutside('far out')
        self.goal, self.is_done = np.array(goal), False

    def expect_losses(self, are_any):
        self.log.append(('losses', are_any))

    def plan_section(self, now):
        self.log.append(('plan', now))
        return now

    def commit(self, section, now):
        self.log.append(('commit', now, section))
        return [self._say()]

    def take_request(self):
        request, self.request = self.request, None
        return request

    def propose(self, plan, now):
        self.log.append(('propose', now, plan))
        return [self._say()]

    def receive(self, message, now):
        self.log.append(('receive', now, message))
        self.has_answers = message.robot_id == self.answers_to
        return True

    def answers(self, now):
        self.log.append(('answers', now))
        self.has_answers = False
        return [self._say()]

    def observe(self, seen, now):
        self.log.append(('observe', now, seen))

    def state(self, now):
        return self.plan.state(now)

    def restarted(self, epoch, now):
        self.log.append(('restarted', epoch, now))
        return Scribe(self.eyed, tuple(self.plan.end), epoch, log=self.log)

    @property
    def sol(self):
        return Solution(self.eyed, (self.plan,), self.is_done)

    def _say(self):
        self._sequence += 1
        return Contracts(self.eyed, self.epoch, self._sequence, answers=dict.fromkeys(self.says_to, Link()))


def run(*robots, until=2.0, seed=0, channel=None, start_time=0.0, errands=None, **faults):
    faults = Faults(**{'solve': AT_ONCE, 'any_phase': True, **faults})
    episode = Episode(robots, seed, channel or Channel(interruptions=faults.interruptions), faults, start_time,
                      errands=errands)
    episode.run(until)
    return episode


def pair(**options):
    return Scribe(1, (0.0, 0.0), **options), Scribe(2, (5.0, 0.0), **options)


def times(robot, kind):
    return np.array([entry[0] for entry in robot.of(kind)])


# Cycles


def test_each_robot_has_a_phase_of_its_own_and_cycles_from_there():
    a, b = pair()
    run(a, b, until=5.0)
    for robot in (a, b):
        assert np.diff(times(robot, 'plan')) == pytest.approx(TC)
        # They begin a little before the mission, to agree on who drives where.
        assert -1.0 <= times(robot, 'plan')[0] < TC - 1.0 and len(times(robot, 'plan')) == 24
    assert times(a, 'plan')[0] != times(b, 'plan')[0]


def test_robots_choose_the_phase_by_their_clocks():
    a, b = pair()
    run(a, b, any_phase=False, start_time=100.3, skew=0.003, seed=3)
    for robot in (a, b):
        assert times(robot, 'plan') % TC == pytest.approx(0.1)
        assert times(robot, 'plan')[0] < 100.3 + TC + 0.003


def test_a_section_is_committed_after_the_time_that_it_takes():
    a, b = pair()
    run(a, b, solve=SolveTime(0.05, 0.1), until=10.0)
    took = times(a, 'commit') - np.array([section for _, section in a.of('commit')])
    assert took.min() >= 0.05 and took.max() <= 0.1 and np.ptp(took) > 0.02


def test_a_joint_plan_is_thought_about_beside_the_cycle_once_for_each_request():
    a, b = pair()
    a.request = SimpleNamespace(ids=(1, 2), plan=lambda: 'a plan')
    run(a, b, until=3.0)
    (when, plan), = a.of('propose')
    assert plan == 'a plan' and 0.008 <= when - times(a, 'commit')[0] <= 0.025 and not b.of('propose')
    assert np.diff(times(a, 'plan')) == pytest.approx(TC)


def test_a_section_that_takes_longer_than_a_cycle_costs_the_cycles_in_between():
    a, b = pair()
    run(a, b, solve=SolveTime(late_share=1.0, late=0.4), until=5.0)
    assert np.diff(times(a, 'plan')) == pytest.approx(2 * TC)
    assert times(a, 'commit')[:9] - times(a, 'plan')[:9] == pytest.approx(0.4)


def test_clocks_are_off_by_as_much_as_is_said_and_stay_so():
    found = set()
    for seed in range(12):
        a, b = pair()
        episode = run(a, b, seed=seed, skew=0.004)
        for vehicle in episode.vehicles.values():
            found.add(round(vehicle.skew, 6))
            assert vehicle.clock(2.0) - vehicle.clock(1.0) == pytest.approx(1.0)
    assert found == {-0.004, 0.0, 0.004}


def test_a_radius_that_does_not_allow_for_the_clocks_is_refused():
    with pytest.raises(InvalidInput, match='margin of robot 1'):
        run(*pair(), skew=0.006)
    run(*pair(margin=0.006), skew=0.006)


def test_robots_whose_knots_differ_are_refused():
    with pytest.raises(InvalidInput, match='Tc'):
        run(Scribe(1), Scribe(2, (5.0, 0.0), Tc=0.3))


# Messages


def test_everybody_else_hears_what_is_said_and_nobody_hears_itself():
    robots = [Scribe(eyed, (eyed, 0.0)) for eyed in range(1, 5)]
    episode = run(*robots)
    for robot in robots:
        assert {message.robot_id for _, message in robot.of('receive')} == {1, 2, 3, 4} - {robot.eyed}
    said = sum(len(robot.of('commit')) for robot in robots)
    assert episode.messages == said and 3 * said - 3 <= episode.deliveries <= 3 * said
    # Three numbers, the lengths of no offers and of nine answers, and six numbers for each of these.
    assert episode.message_bytes == (20 + 9 * 24) * said


def test_a_message_takes_its_time():
    a, b = pair()
    run(a, b, channel=Channel(least=0.1, delay=0.5), until=10.0)
    sent = {message.sequence: now for now, message in zip(times(a, 'commit'), map(_nth, range(1, 99)))}
    taken = [now - sent[message.sequence] for now, message in b.of('receive')]
    assert min(taken) >= 0.1 and max(taken) <= 0.6


def _nth(number):
    return SimpleNamespace(sequence=number)


def test_answers_are_collected_a_moment_after_they_fell_due_and_once():
    a, b = pair(answers_to=2)
    run(a, b)
    due = times(a, 'receive')
    assert len(times(a, 'answers')) == len(due[due + ANSWER_DELAY <= 2.0])
    assert times(a, 'answers') - due[:len(times(a, 'answers'))] == pytest.approx(ANSWER_DELAY)
    assert not b.of('answers')


@pytest.mark.parametrize('is_threaded', [True, False])
def test_messages_during_a_section_wait_for_its_end_where_there_is_one_thread(is_threaded):
    a, b = pair(answers_to=1)
    run(a, b, solve=SolveTime(0.2, 0.2), is_threaded=is_threaded, until=10.0)
    busy = [(began, began + 0.2) for began in times(b, 'plan')]
    inside = [now for now in times(b, 'receive') if any(low + 1e-9 < now < high - 1e-9 for low, high in busy)]
    asked = [now for now in times(b, 'answers') if any(low + 1e-9 < now < high - 1e-9 for low, high in busy)]
    assert bool(inside) is is_threaded and (is_threaded or not asked)
    assert {message.sequence for _, message in b.of('receive')} >= set(range(1, 35))


def test_a_cut_is_deaf_in_one_direction():
    a, b = pair()
    run(a, b, interruptions=(Cut(1, 2, 0.0, 1.0),))
    assert not ((times(b, 'receive') > 0.01) & (times(b, 'receive') < 1.0)).any() and times(b, 'receive').max() > 1.0
    assert ((times(a, 'receive') > 0.01) & (times(a, 'receive') < 0.5)).any()


def test_out_of_radio_range_nothing_is_heard():
    a, b = pair()
    assert run(a, b, radio_range=4.9).deliveries == 0
    assert run(*pair(), radio_range=5.1).deliveries > 0


# Life and death


def moving(eyed, spans=20):
    """Return a robot on its way to rest at the knot ``spans``."""
    points = np.column_stack([np.linspace(0, 2, spans), np.full(spans, 3.0 * eyed)])
    return Scribe(eyed, plan=Plan(0, TC, np.concatenate([points[:1], points[:1], points, points[-1:], points[-1:]])))


def test_a_killed_robot_does_and_says_nothing_more_and_its_body_drives_on():
    a, b = moving(1), Scribe(2, (9.0, 0.0))
    episode = run(a, b, kills=(Kill(1, 1.0),), until=4.0)
    assert times(a, 'plan').max() <= 1.0 and times(a, 'receive').max() <= 1.0
    assert episode.dead == [1] and not b.of('restarted')
    body = episode.vehicles[1]
    assert body.place(4.0)[0] > body.place(1.0)[0]


def test_a_section_that_a_robot_died_over_is_never_committed():
    a, b = pair()
    run(a, b, solve=SolveTime(0.1, 0.1), kills=(Kill(1, 0.9), Kill(2, 0.95)))
    for robot in (a, b):
        assert times(robot, 'commit').max(initial=0.0) < 1.0


@pytest.mark.parametrize('is_certified', [True, False])
def test_a_certificate_comes_when_the_body_must_rest_and_again_while_it_lasts(is_certified):
    a, b = moving(1, spans=8), Scribe(2, (9.0, 0.0))
    run(a, b, kills=(Kill(1, 1.0, is_certified=is_certified),), skew=0.004, until=8.0, start_time=50.0)
    deaths = [(now, message) for now, message in b.of('receive') if isinstance(message, Death)]
    if not is_certified:
        assert not deaths
        return
    assert [now for now, _ in deaths] == pytest.approx([54.75, 55.75, 56.75, 57.75], abs=0.02)
    for now, death in deaths:
        assert (death.robot_id, death.boot_epoch, death.radius) == (1, 1, a.limits.radius)
        assert (death.place == a.plan.end).all() and now - 0.02 < death.issued + 0.004 < now + 0.004


def test_a_robot_restarts_only_when_its_body_rests_with_a_new_epoch_and_knows_nothing():
    a, b = moving(1), Scribe(2, (9.0, 0.0))
    episode = run(a, b, kills=(Kill(1, 1.0, restart_after=0.5, is_certified=True),), until=9.0)
    (epoch, now), = a.of('restarted')
    assert epoch == 2 and now == pytest.approx(a.plan.end_knot * TC)
    assert [entry[2] for entry in a.of('start')] == [{}, {}]
    assert [message.boot_epoch for _, message in b.of('receive')][-1] == 2
    assert len(episode.vehicles[1].solution.plans) == 2 and episode.dead == []
    certified = [at for at, message in b.of('receive') if isinstance(message, Death)]
    assert all(at <= now + 0.1 for at in certified)


def test_a_robot_that_joins_late_rests_at_its_dock_until_then():
    a, b, late = Scribe(1), Scribe(2, (5.0, 0.0)), Scribe(3, (2.0, 7.0))
    run(a, b, late, joins=(Join(3, 1.0),))
    for robot in (a, b):
        (roster, start_time, resting), = robot.of('start')
        assert roster == [1, 2, 3] and start_time == 0.0 and list(resting) == [3]
        assert resting[3][0] == pytest.approx([2.0, 7.0]) and resting[3][1] == late.limits.radius
    assert late.of('start')[0][2] == {} and late.log[0][0] == 'start'
    assert times(late, 'plan').min() >= 1.0 and times(late, 'receive').min() >= 1.0


def test_what_is_said_to_others_is_heard_and_not_taken_in():
    a, b, c = Scribe(1, (0.0, 0.0), says_to=(2,)), Scribe(2, (2.0, 0.0)), Scribe(3, (4.0, 0.0))
    episode = run(a, b, c)
    assert {message.robot_id for _, message in b.of('receive')} == {1, 3}
    assert {message.robot_id for _, message in c.of('receive')} == {2}
    assert episode.deliveries == 2 * episode.messages


def test_a_robot_is_told_before_each_section_whether_messages_get_lost():
    sure, lossy = pair(), pair()
    run(*sure, until=4.0)
    run(*lossy, until=4.0, channel=Channel(loss=0.3))
    for robot in (*sure, *lossy):
        assert len(robot.of('losses')) == len(robot.of('plan')) > 10
    # In the first second it is too early to tell, and then the channel is known.
    for robot, is_lossy in *((robot, False) for robot in sure), *((robot, True) for robot in lossy):
        told = [are_any for are_any, in robot.of('losses')]
        assert True in told[:5] and told[-1] is is_lossy


def test_the_presence_sensor_sees_bodies_in_its_range_before_each_section_and_each_commit():
    a, near, far = Scribe(1, sensor_range=3.0), Scribe(2, (4.0, 0.0)), Scribe(3, (9.0, 0.0))
    run(a, near, far, kills=(Kill(2, 0.6),))
    assert not near.of('observe')
    order = [entry[0] for entry in a.log if entry[0] in ('observe', 'plan', 'commit')]
    assert order[:8] == ['observe', 'plan', 'observe', 'commit'] * 2
    for _, seen in a.of('observe'):
        # Beyond the range it sees twice the margin, so that it knows who leaves; dead bodies are bodies.
        assert list(seen) == [2] and seen[2][0] == pytest.approx([4.0, 0.0])
        assert seen[2][1] == pytest.approx(0.0)


# The end


def test_it_ends_when_all_have_arrived_who_can():
    a, b = pair()
    a.is_done = b.is_done = True
    assert run(a, b, until=50.0).events < 10
    a, b = pair()
    b.is_done = True
    assert run(a, b, kills=(Kill(1, 1.0),), until=50.0).events < 60
    a, b = pair()
    b.is_done = True
    assert run(a, b, kills=(Kill(1, 1.0, restart_after=1.0),), until=10.0).events > 100


# Errands


class Queue:
    """Goals of robot 1; it writes down whom it is asked for, and what is taken."""

    def __init__(self, *goals):
        self.goals, self.asked = list(goals), []

    def next_goal(self, robot_id, now, taken):
        self.asked.append((robot_id, now, [(tuple(place), round(radius, 6)) for place, radius in taken]))
        return self.goals.pop(0) if robot_id == 1 and self.goals else None

    def left(self, robot_id):
        return tuple(self.goals) if robot_id == 1 else ()


class Quick(Scribe):
    """A scribe that has arrived a second after each goal."""

    def commit(self, section, now):
        since = self.of('goal')[-1][0] if self.of('goal') else 0.0
        self.is_done = now > since + 1.0
        return super().commit(section, now)


def test_who_has_arrived_is_given_the_next_goal_at_once_until_there_is_none():
    robot, other = Quick(1), Quick(2, (5.0, 0.0))
    queue = Queue((1.0, 0.0, 0.0), (2.0, 0.0, 1.0))
    episode = run(robot, other, until=20.0, errands=queue)
    assert [goal for _, goal in robot.of('goal')] == [(1, 0, 0), (2, 0, 1)] and other.of('goal') == []
    assert np.diff(times(robot, 'goal')) > 1.0 and (times(robot, 'goal')[0] <= times(robot, 'commit')).any()
    assert [goal.tolist() if hasattr(goal, 'tolist') else list(goal) for goal in episode.goals[1]] == [
        [0, 0, 0], [1, 0, 0], [2, 0, 1]]
    # What is taken are the goals of the others, with their margins.
    assert [taken for asked, _, taken in queue.asked if asked == 1] == [[((5.0, 0.0), 0.205)]] * 3
    assert all(each.is_done for each in (robot, other)) and episode.ended < 5.0


def test_a_dead_robot_is_given_nothing_and_its_place_is_taken():
    robot, other = Quick(1), Quick(2, (5.0, 0.0), plan=Plan.at_rest(0, TC, np.array([7.0, 1.0, 0.0])))
    queue = Queue((1.0, 0.0, 0.0))
    run(robot, other, until=20.0, errands=queue, kills=(Kill(2, 0.5),))
    assert [taken for asked, now, taken in queue.asked if asked == 1 and now > 0.5] == [[((7.0, 1.0), 0.205)]] * 2
    assert 2 not in [asked for asked, _, _ in queue.asked]


def test_goals_that_nobody_was_given_are_counted_and_refused_ones_are_named():
    episode = run(Quick(1), Quick(2, (5.0, 0.0)), until=20.0, errands=Queue((100.0, 0.0, 0.0), (1.0, 0.0, 0.0)))
    assert len(episode.goals[1]) == 3 and episode.refused == ['far out']
    episode = run(Quick(1), Quick(2, (5.0, 0.0)), until=1.5, errands=Queue((1.0, 0.0, 0.0), (2.0, 0.0, 0.0)))
    assert len(episode.goals[1]) == 3 and len(episode.goals[2]) == 1


def test_one_seed_gives_one_episode_and_another_seed_another():
    def story(seed):
        a, b = pair(answers_to=1)
        run(a, b, seed=seed, channel=Channel(0.3, 0.5, duplicates=0.2), skew=0.005, solve=SolveTime())
        return [(entry[0], entry[1]) for entry in a.log + b.log]
    assert story(4) == story(4) != story(5)


def test_the_same_happens_whenever_the_mission_starts():
    early, late = pair(), pair()
    run(*early, seed=2)
    run(*late, seed=2, start_time=1.8e9)
    for a, b in zip(early, late):
        assert [entry[0] for entry in a.log] == [entry[0] for entry in b.log]
        assert times(b, 'plan') - 1.8e9 == pytest.approx(times(a, 'plan'), abs=1e-6)
