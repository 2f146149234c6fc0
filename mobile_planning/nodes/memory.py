"""Memory that a process does not need any more, given back to the system."""
from __future__ import annotations

import ctypes


def give_back() -> bool:
    """Give the pages that hold nothing back to the system, and return whether there were any.

    glibc keeps what is freed between two things that are still held, in a heap for each thread: a robot that has once
    made a hard joint plan would keep the room for the next one. Takes some milliseconds, in which other threads run
    on. Without glibc nobody can be asked, and nothing is given.
    """
    trim = getattr(ctypes.CDLL(None), 'malloc_trim', None)
    return trim is not None and bool(trim(0))
