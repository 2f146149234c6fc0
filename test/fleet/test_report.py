"""The report: what it sums up, for a person and for JSON."""
import json

import numpy as np

from mobile_planning import Report

BARE = Report('m', True, 2, (1, 2), np.inf, np.inf, 9.0)
FULL = Report('m', True, 2, (1, 2), 0.5, 0.1, 9.0, lower_bound=6.0, section_times=(0.001, 0.002, 0.003), messages=7,
              message_bytes=2500, dead=0)


def test_the_ratio_is_that_of_the_mission_time_to_its_lower_bound():
    assert FULL.ratio == 1.5 and FULL.as_dict()['ratio'] == 1.5
    assert BARE.ratio is None
    assert Report('m', False, 2, (1,), 1.0, 1.0, 3.0, lower_bound=6.0).ratio is None


def test_json_has_no_infinity_and_sums_up_the_sections():
    said = json.loads(json.dumps(FULL.as_dict(), allow_nan=False))
    assert said['section_times'] == {'count': 3, 'median': 0.002, 'p99': np.percentile(FULL.section_times, 99)}
    assert (said['messages'], said['message_bytes'], said['dead'], said['lower_bound']) == (7, 2500, 0, 6.0)
    bare = json.loads(json.dumps(BARE.as_dict(), allow_nan=False))
    assert bare['min_separation'] is bare['min_obstacle_clearance'] is bare['section_times'] is bare['messages'] is None


def test_section_times_may_be_an_array():
    report = Report('m', True, 1, (1,), 1.0, 1.0, 1.0, section_times=np.array([0.001, 0.003]))
    json.dumps(report.as_dict())
    assert report.section_summary['median'] == 0.002 and 'median 2.00 ms' in report.table()


def test_the_table_shows_what_is_known():
    table = FULL.table()
    for words in '1.50 times', '6.00 s', 'median 2.00 ms', '7, 2.5 kB':
        assert words in table
    assert 'lower bound' not in BARE.table() and 'messages' not in BARE.table() and 'dead' not in BARE.table()
    assert '1 dead' in Report('m', False, 2, (1,), 1.0, 1.0, 3.0, dead=1).table()
