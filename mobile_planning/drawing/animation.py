"""Animations: a figure drawn again and again, into a film or a window."""
from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np
from matplotlib.animation import FFMpegWriter
from matplotlib.figure import Figure
from PIL import Image

from mobile_planning.drawing import windows

FILMS = ('.gif', '.mp4')
# More are not worth their time and space.
_MOST_FRAMES = 120
_DPI = 80
_LAST_FRAME_STAYS = 1.0


def check_film(path: str | Path) -> None:
    """Raise unless a film of that name can be written.

    Raises
    ------
    ValueError
        If the name ends neither in .gif nor in .mp4.
    RuntimeError
        If it ends in .mp4 and the program ffmpeg is not installed.
    """
    ending = Path(path).suffix.lower()
    if ending not in FILMS:
        raise ValueError(f'film {str(path)!r} does not end in {" or ".join(FILMS)}')
    if ending == '.mp4' and not FFMpegWriter.isAvailable():
        raise RuntimeError(f'film {str(path)!r} needs the program ffmpeg, which is not installed; a .gif does not')


def play(
    figure: Figure, show_share: Callable[[float], None], steps: int, *,
    film: str | Path | None = None, interval: float = 0.05, window: bool = False,
) -> None:
    """Show something come about.

    Parameters
    ----------
    figure : Figure
        If it is to be shown in a window, one of `windows.new_window`.
    show_share : callable
        Makes the figure show the first part of it, from 0 to 1.
    steps : int
        Of which it is made: there are as many frames, and one more, but not above 121.
    film : path, optional
        A .gif or .mp4 to write, see `check_film`.
    interval : float [s]
        Between two frames.
    window : bool
        Whether to show the frames on the screen.
    """
    shares = np.linspace(0.0, 1.0, min(max(steps, 1), _MOST_FRAMES) + 1)
    seconds = [interval] * (len(shares) - 1) + [max(interval, _LAST_FRAME_STAYS)]
    if not window:
        figure.set_dpi(_DPI)
    # Laid out once: to do it again for every frame takes longer than to draw it, and lets the axes jump.
    figure.draw_without_rendering()
    figure.set_layout_engine('none')
    with ExitStack() as stack:
        take = None if film is None else stack.enter_context(_camera(figure, Path(film), interval))
        for share, stays in zip(shares, seconds):
            show_share(float(share))
            if take is not None:
                take(stays)
            if window:
                windows.refresh(interval)


@contextmanager
def _camera(figure, film, interval):
    """Give a function that adds what the figure shows to the film, to stay for some time [s]."""
    check_film(film)
    if film.suffix.lower() == '.mp4':
        writer = FFMpegWriter(fps=1.0 / interval)
        with writer.saving(figure, str(film), figure.dpi):
            yield lambda stays: [writer.grab_frame() for _ in range(max(1, round(stays / interval)))]
        return
    frames, times = [], []

    def take(stays):
        # Half the time of matplotlib's own PillowWriter, which draws every frame twice.
        figure.canvas.draw()
        frames.append(Image.fromarray(np.asarray(figure.canvas.buffer_rgba())[..., :3]))
        times.append(round(1000 * stays))

    yield take
    frames[0].save(film, save_all=True, append_images=frames[1:], duration=times, loop=0)
