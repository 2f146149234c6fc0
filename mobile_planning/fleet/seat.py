"""Seat: by which only one process at a time drives a base."""
from __future__ import annotations

import socket


class Seat:
    """Who has it drives the base of that name; it is free again once the process has ended, however.

    Parameters
    ----------
    name : str

    Examples
    --------
    >>> first, second = Seat('example'), Seat('example')
    >>> first.take(), first.take(), second.take()
    (True, True, False)
    """

    def __init__(self, name: str):
        # The name is one of the kernel, not of a file: nothing is left behind.
        self._name, self._socket, self._is_taken = f'\0mobile_planning pilot {name}', None, False

    def take(self) -> bool:
        """Return whether the seat is taken by this object, now or before."""
        if not self._is_taken:
            self._socket = self._socket or socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
            try:
                self._socket.bind(self._name)
                self._is_taken = True
            except OSError:
                pass  # another process has it
        return self._is_taken
