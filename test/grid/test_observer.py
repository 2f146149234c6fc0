"""Progress, films and lines of text, which the algorithms know nothing of."""
import io
import sys
import threading
import time

import numpy as np
import pytest
from PIL import Image

from mobile_planning.errors import Cancelled, InvalidInput
from mobile_planning.grid.distance_transform import DistanceTransformPlanner
from mobile_planning.grid.lattice import LatticePlanner
from mobile_planning.grid.observer import film_of, with_progress

GRID = np.zeros((20, 30))


class Terminal(io.StringIO):
    """A stream that says it is a terminal."""

    def isatty(self):
        return True


def wait_until(condition):
    deadline = time.monotonic() + 20
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.001)


def test_progress_rises_to_1_in_the_callers_thread():
    shares, threads = [], set()
    reported = threading.Event()

    def work(stop, done):
        done[1] = 4
        for part in range(4):
            reported.clear()
            done[0] = part
            assert reported.wait(20)
        return 'result'

    def report(share):
        shares.append(share)
        threads.add(threading.current_thread())
        reported.set()

    assert with_progress(work, report, None, 'work') == 'result'
    assert shares == sorted(shares) and shares[-1] == 1.0 and {0.25, 0.5, 0.75} <= {*shares}
    assert threads == {threading.current_thread()}


def test_a_callback_that_raises_stops_the_work():
    ended = []

    def work(stop, done):
        wait_until(lambda: stop[0])
        ended.append(True)

    def refuse(share):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        with_progress(work, refuse, None, 'work')
    assert ended == [True]


def test_an_error_of_the_work_comes_through():
    def work(stop, done):
        raise TimeoutError('of the work')

    for progress in (False, lambda share: None):
        with pytest.raises(TimeoutError, match='of the work'):
            with_progress(work, progress, None, 'work')


def test_planners_report_their_progress():
    for plan in (DistanceTransformPlanner(GRID, goal=(3, 3)).plan, LatticePlanner(occgrid=GRID).plan):
        shares = []
        plan(progress=shares.append)
        assert shares[-1] == 1.0 and all(0 <= share <= 1 for share in shares)


def test_a_kernel_counts_what_it_has_done():
    from mobile_planning.world.cost_to_go import cost_to_go

    done, grid = np.zeros(2, np.int64), GRID.copy()
    grid[5:15, 7] = 1
    cost_to_go(grid, (3, 3), done=done)
    assert done[1] == 590 and done[0] >= 590


def test_a_stopped_plan_is_cancelled_whether_it_is_watched_or_not():
    for progress in (False, lambda share: None):
        with pytest.raises(Cancelled):
            DistanceTransformPlanner(GRID, goal=(3, 3)).plan(stop=np.ones(1, np.uint8), progress=progress)


def test_a_bar_is_drawn_on_a_terminal_only_and_only_if_it_lasts(monkeypatch):
    def work(stop, done):
        done[:] = 1, 2
        wait_until(lambda: '50%' in sys.stderr.getvalue())

    monkeypatch.setattr(sys, 'stderr', Terminal())
    with_progress(work, True, None, 'long work')
    assert 'long work |####################' in sys.stderr.getvalue() and sys.stderr.getvalue().endswith('100%\n')
    monkeypatch.setattr(sys, 'stderr', Terminal())
    with_progress(lambda stop, done: None, True, None, 'short work')
    assert sys.stderr.getvalue() == ''


def test_a_film_has_a_frame_for_each_step_and_its_interval(tmp_path):
    planner = DistanceTransformPlanner(GRID, goal=(3, 3))
    planner.plan(movie=(tmp_path / 'plan.gif', 0.2))
    path = planner.query((12, 3), movie=str(tmp_path / 'path.gif'))
    with Image.open(tmp_path / 'plan.gif') as film:
        assert film.n_frames > 10 and film.info['duration'] % 200 == 0  # equal frames are joined
    with Image.open(tmp_path / 'path.gif') as film:
        assert film.n_frames == len(path)
        first = np.asarray(film.convert('RGB'), int)
        film.seek(film.n_frames - 1)
        assert np.abs(np.asarray(film.convert('RGB'), int) - first).max() > 100


def test_a_film_that_cannot_be_written_is_refused_before_the_work():
    planner = DistanceTransformPlanner(GRID, goal=(3, 3))
    for movie in ('plan.avi', 'plan', ('plan.gif', 0.0), ('plan.gif', np.nan)):
        with pytest.raises(InvalidInput):
            planner.plan(movie=movie)
    assert planner.distancemap is None


def test_an_mp4_without_ffmpeg_says_what_is_missing(monkeypatch):
    from matplotlib.animation import FFMpegWriter

    monkeypatch.setattr(FFMpegWriter, 'isAvailable', classmethod(lambda cls: False))
    with pytest.raises(RuntimeError, match='ffmpeg'):
        film_of('plan.mp4')
    monkeypatch.setattr(FFMpegWriter, 'isAvailable', classmethod(lambda cls: True))
    assert film_of(('plan.mp4', 0.1))[1] == 0.1


def test_verbose_and_summary_print_and_nothing_else_does(capsys):
    planner = DistanceTransformPlanner(GRID, goal=(3, 3))
    planner.plan()
    planner.query((0, 0))
    assert capsys.readouterr() == ('', '')
    planner.plan(verbose=True)
    assert capsys.readouterr().out == 'DistanceTransformPlanner: plan: 600 cells reach the goal (3, 3)\n'
    planner.query((0, 0), verbose=True)
    assert '4 points from (0, 0) to (3, 3)' in capsys.readouterr().out
    planner.plan(summary=True)
    assert 'metric: euclidean' in capsys.readouterr().out
    planner.verbose = True
    assert planner.verbose
    planner.query((0, 0))
    assert '4 points' in capsys.readouterr().out


def test_a_query_without_next_checks_the_ends_only():
    planner = DistanceTransformPlanner(GRID)
    assert planner.query((1, 2), (3, 3), next=False).tolist() == [[1, 2]]
    assert planner.distancemap is None and planner.goal.tolist() == [3, 3]
    with pytest.raises(ValueError):
        planner.query((-1, 2), (3, 3), next=False)
