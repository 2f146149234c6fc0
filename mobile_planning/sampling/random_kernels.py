"""Random numbers for kernels, from a state of their own: one seed, one sequence, whatever other threads draw.

SplitMix64: Steele, Lea and Flood (2014), Fast splittable pseudorandom number generators, OOPSLA.
"""
import numpy as np
from numba import f8, njit, u8

STATE = u8[::1]
_STEP = np.uint64(0x9E3779B97F4A7C15)
_FIRST, _SECOND = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)


@njit(f8(STATE), nogil=True, cache=True, _nrt=False)
def uniform(state):
    """Return the next number in [0, 1)."""
    state[0] += _STEP
    z = state[0]
    z = (z ^ (z >> np.uint64(30))) * _FIRST
    z = (z ^ (z >> np.uint64(27))) * _SECOND
    z = z ^ (z >> np.uint64(31))
    return np.float64(z >> np.uint64(11)) * 2.0**-53


@njit(f8(STATE), nogil=True, cache=True, _nrt=False)
def normal(state):
    """Return the next number of the standard normal distribution (Box and Muller)."""
    radius = np.sqrt(-2.0 * np.log(1.0 - uniform(state)))
    return radius * np.cos(2.0 * np.pi * uniform(state))
