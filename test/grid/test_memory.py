"""What a plan on a large map needs: measured as the peak of a process of its own."""
import json
import subprocess
import sys

import pytest

SIDE = 4096
SCRIPT = """
import json
import re
import sys
from pathlib import Path
import numpy as np
from mobile_planning.warm_up import warm_up
from mobile_planning import DistanceTransformPlanner, DstarPlanner


# The most memory that this program has had [B]; getrusage would count its parent too, from before the exec.
def peak():
    return 1024 * int(re.search('VmHWM:(.*)kB', Path('/proc/self/status').read_text())[1])


warm_up()
occupied = np.zeros((SIDE, SIDE), bool)
occupied[::9, 1::4] = True
occupied.flags.writeable = False
peaks = [peak()]
planner = {'distance_transform': DistanceTransformPlanner, 'dstar': DstarPlanner}[sys.argv[1]](occupied)
planner.plan((0, 1))
path = planner.query((SIDE - 1, SIDE - 1))
peaks.append(peak())
print(json.dumps(peaks))
"""


@pytest.mark.parametrize('planner', ['distance_transform', 'dstar'])
def test_a_plan_on_4096_cells_squared_needs_at_most_five_arrays_of_the_map(planner):
    code = SCRIPT.replace('SIDE', str(SIDE))
    done = subprocess.run([sys.executable, '-c', code, planner], capture_output=True, text=True, timeout=300)
    before, after = json.loads(done.stdout)
    array = 8 * SIDE ** 2
    assert after - before < 5 * array and after < 2 * 10 ** 9
