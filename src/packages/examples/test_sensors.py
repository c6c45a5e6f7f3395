"""Tests of two sensors: pytest --cangauge-bus sim test_sensors.py

The fixture `gauge` belongs to the Python package of cangauge.
"""

import pytest


@pytest.mark.parametrize("node", [1, 127])
def test_pressure_is_steady(gauge, node):
    gauge.check(node, "noise(pressure) < 0.2 bar", seconds=1, poll="50ms")


def test_recording_has_no_gaps(gauge):
    with gauge.log([1, 127], "pressure", sync="100ms", seconds=2) as recording:
        pass
    assert recording.summary["gaps"] == 0
