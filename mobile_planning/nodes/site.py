"""What the places of a node where paths are planned have in common: they take over what is wanted between requests."""
from __future__ import annotations

import time
from abc import ABC, abstractmethod
from typing import Generic, TypeVar

from mobile_planning.errors import PlanningTimeout

Basis = TypeVar('Basis')


class Site(ABC, Generic[Basis]):
    """Plans on one basis at a time: the one that was the newest when the turn of a request came.

    `wanted` is set by the executor's thread, the methods are for the worker's.

    Parameters
    ----------
    wanted : Basis
        Immutable: a change makes another one.

    Attributes
    ----------
    wanted : Basis
        What the next request is to be planned on.
    """

    def __init__(self, wanted: Basis):
        self.wanted = self._adopted = wanted

    def adopt(self) -> Basis:
        """Take over what is wanted, if it is not there yet, and return it; what raises leaves it wanted."""
        wanted = self.wanted
        if wanted is not self._adopted:
            self._take_over(wanted, self._adopted)
            self._adopted = wanted
        return wanted

    @abstractmethod
    def _take_over(self, wanted: Basis, before: Basis) -> None:
        """Plan on one basis instead of another from now on."""


def remaining(until: float) -> float:
    """Return the time [s] until then on the monotonic clock.

    Raises
    ------
    PlanningTimeout
        If none is left.
    """
    left = until - time.monotonic()
    if left <= 0:
        raise PlanningTimeout('the deadline passed while other requests were answered')
    return left
