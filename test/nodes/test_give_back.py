"""Memory that is given back to the system."""
import ctypes
import subprocess
import sys

import pytest

# Holds every tenth of many small blocks, so that no heap can shrink, and prints what is held [MB] before and after.
FRAGMENTED = '''
import numpy
from mobile_planning.nodes.memory import give_back

def held():
    with open('/proc/self/status') as status:
        return next(int(line.split()[1]) / 1024 for line in status if line.startswith('VmRSS'))

blocks = [numpy.ones(12_000, numpy.uint8) for _ in range(10_000)]
kept = blocks[::10]
del blocks
before = held()
print(before, give_back(), held())
'''


@pytest.mark.skipif(not hasattr(ctypes.CDLL(None), 'malloc_trim'), reason='this libc is not glibc')
def test_pages_between_what_is_held_are_given_back():
    out = subprocess.run([sys.executable, '-c', FRAGMENTED], capture_output=True, text=True, check=True).stdout.split()
    # Of 108 MB that are free, blocks of three pages leave two of three.
    assert out[1] == 'True' and float(out[0]) - float(out[2]) > 60.0
