"""RealBody: a real base, driven by a process of its own, which goes on when this one dies or freezes."""
from __future__ import annotations

import subprocess
import sys
import threading
from collections import Counter
from collections.abc import Callable
from time import monotonic

import numpy as np
from rclpy.node import Node

from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.logbook import Entry
from mobile_planning.fleet.pilot import PilotStatus
from mobile_planning.fleet.pilot_link import PilotLink, PilotNews, PilotTask
from mobile_planning.fleet.tracking import Tracker
from mobile_planning.nodes.guard import Guard
from mobile_planning.nodes.odometry import require_tf
from mobile_planning.nodes.robot_options import RobotOptions

#: Plans that another pilot is given when one has died: the newest may begin a little later.
_PLANS = 5
#: Between two starts of a pilot that ends at once [s].
_BETWEEN = 2.0
_TOPICS = '~/pose', '~/odom', '~/cmd_vel'


class RealBody:
    """One robot's real base and the process of its pilot. See `make_body`.

    A plan is with the pilot before anybody is told of it. When this process is gone the pilot drives to the end of
    the newest plan, and ends. A pilot that dies is started again.

    Raises
    ------
    InvalidInput
        The localisation that is asked for is not installed.
    """

    def __init__(self, node: Node, guard: Guard, options: RobotOptions, robot_id: int, tracker: Tracker,
                 on_pose: Callable[[np.ndarray], None]):
        if options.localisation == 'tf':
            require_tf()
        self._guard, self._options, self._on_pose = guard, options, on_pose
        self._task = PilotTask(
            node.get_name(), node.get_namespace(), node.context.get_domain_id(), _enclave(sys.argv),
            {topic: node.resolve_topic_name(topic) for topic in _TOPICS}, options.frame_id,
            f'{node.get_name()}/base_link', options.localisation, options.control_rate, tracker, options.most_drift,
            bool(node.get_parameter('use_sim_time').value))
        self._plans: tuple[Entry, ...] = ()
        self._status, self._told_at, self._counted = PilotStatus(), -np.inf, Counter()
        self._turn, self._link, self._is_closed = threading.Lock(), None, False
        self._process: subprocess.Popen | None = None
        threading.Thread(target=self._attend, name=f'{node.get_name()} pilot', daemon=True).start()

    @property
    def status(self) -> PilotStatus:
        """How the body keeps to its plan; of a pilot that is not heard nothing is known."""
        return self._status if monotonic() - self._told_at < self._options.pose_timeout else PilotStatus()

    @property
    def pilot(self) -> subprocess.Popen | None:
        """The process of the pilot, None before the first is started."""
        return self._process

    def leave_on(self, plan: Plan) -> None:
        """Do nothing: where the body is its localisation says."""

    def drive(self, entry: Entry) -> None:
        """Hand a plan to the pilot."""
        with self._turn:
            self._plans = (*self._plans, entry)[-_PLANS:]
            self._say(entry)

    def tick(self, period: float) -> None:
        """Do nothing: the pilot drives."""

    def trouble(self) -> str:
        """Return that the pilot is not heard, if there are plans to drive."""
        is_heard = monotonic() - self._told_at < self._options.pose_timeout
        return 'the pilot of the base is not heard: it may stand on its way' if self._plans and not is_heard else ''

    def close(self) -> None:
        """Leave the pilot alone: it ends its plan."""
        with self._turn:
            self._is_closed = True
            if self._link is not None:
                self._link.close()

    def _say(self, content):
        """Tell the pilot; one that does not listen any more is ended, and another one is told all of it."""
        try:
            if self._link is not None:
                self._link.send(content)
        except BlockingIOError as error:
            self._guard.note(error, 'drive')
            self._process.kill()
        except OSError:
            pass  # it has died: who attends to it sees that too

    def _attend(self):
        """Start a pilot, hear what it tells, and start another one when it has died."""
        over = threading.Event()
        while self._start():
            began = monotonic()
            for news in iter(self._link.receive, None):
                self._hear(news)
            code = self._process.wait()
            if not self._is_closed:
                self._guard.note(ChildProcessError(f'the pilot of the base has ended with {code}, another is started'),
                                 'pilot')
                over.wait(max(0.0, began + _BETWEEN - monotonic()))

    def _start(self):
        """Start a pilot and return True, or return False where there is to be none any more."""
        with self._turn:
            if self._is_closed:
                return False
            self._link, theirs = PilotLink.pair()
            # A session of its own: what ends this process by its group, Ctrl-C above all, is not to stop the base.
            self._process = subprocess.Popen(
                [sys.executable, '-m', 'mobile_planning.nodes.robot_pilot', self._task.name, str(theirs.fileno())],
                pass_fds=[theirs.fileno()], start_new_session=True, stdin=subprocess.DEVNULL)
            theirs.leave()
            for content in (self._task, *self._plans):
                self._say(content)
        return True

    def _hear(self, news: PilotNews):
        self._status, self._told_at = news.status, monotonic()
        told = Counter(news.rejected)
        told['faults'] = news.faults
        fresh, self._counted = told - self._counted, told
        self._guard.faults += fresh.pop('faults', 0)
        self._guard.rejected.update(fresh)
        self._guard.newest = news.newest or self._guard.newest
        if news.pose is not None and not self._plans:
            self._on_pose(np.array(news.pose))


def _enclave(args):
    """Return the enclave that a command line names, for which rclpy cannot be asked; empty for none."""
    return next((name for option, name in zip(args, args[1:]) if option in ('--enclave', '-e')), '')
