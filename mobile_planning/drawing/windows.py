"""Windows on the screen: the only place that uses ``matplotlib.pyplot``, and only when a window is asked for."""
from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure


def new_window(size: tuple[float, float]) -> Figure:
    """Return a figure of that size [inch] that pyplot can show.

    Without a screen matplotlib has no window to show; it says so in a warning of its own, and nothing waits.
    """
    from matplotlib import pyplot

    return pyplot.figure(figsize=size, layout='constrained')


def show(block: bool) -> None:
    """Show the windows that there are; with ``block`` wait until they are closed."""
    from matplotlib import pyplot

    pyplot.show(block=block)


def refresh(seconds: float) -> None:
    """Draw the windows again and let them answer the mouse for a while [s]."""
    from matplotlib import pyplot

    pyplot.pause(seconds)


def current_axes() -> tuple[Figure, Axes]:
    """Return the figure that is open and its axes; new ones if there is none."""
    from matplotlib import pyplot

    return pyplot.gcf(), pyplot.gca()


def close(figure: Figure) -> None:
    """Close a figure's window."""
    from matplotlib import pyplot

    pyplot.close(figure)
