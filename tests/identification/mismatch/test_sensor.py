"""A sensor applied to a simulation with known motion, clock and frames."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slipbench.identification.mismatch.simulation.sampling import Grid, into_bins
from slipbench.identification.mismatch.simulation.sensor import Sampled, point_sensor
from slipbench.plant.effects.held_frames import HeldFrames

GRID = Grid(rows=8000, start=1.0, bins=650, width=0.01)
ROWS = GRID.step * np.arange(1, GRID.rows + 1)
PERIOD = 4e-3
FRAMES = PERIOD * np.arange(1, 1990)
UNEVEN = 1e-3
"""m/s: bins hold two frames or three, which a slope from bin to bin does not represent."""


def speed(time):
    """A motorcycle that speeds up and surges."""
    return 40.0 + 2.0 * time + 0.5 * np.sin(2 * np.pi * 1.5 * time)


def sensor_of(values):
    return point_sensor("speed", "m/s", "v", 1.0, Sampled(FRAMES, values, "own"), GRID)


@settings(deadline=None, max_examples=30)
@given(late=st.floats(-1.2e-3, 1.2e-3), hold=st.floats(9e-3, 60e-3), phase=st.floats(0.0, 1.0))
def test_what_is_held_and_late_is_told_as_it_was(late, hold, phase):
    """Held values: a shift by their slope would give a spike at each step and no shift between."""
    fresh = np.diff(np.floor(FRAMES / hold + phase), prepend=-1.0) != 0.0
    there = speed(FRAMES - late)
    values = there[np.maximum.accumulate(np.where(fresh, np.arange(FRAMES.size), 0))]
    sensor = sensor_of(values)
    held = HeldFrames(channel="speed", hold=sensor.update_times * PERIOD)
    shown = sensor.observe({"v": speed(ROWS)}, [held], late)
    assert shown == pytest.approx(sensor.value, abs=2e-3)


@given(st.floats(-1.2e-3, 1.2e-3))
def test_a_late_clock_shows_what_there_was_before(late):
    sensor = sensor_of(speed(FRAMES))
    shown = sensor.observe({"v": speed(ROWS)}, late=late)
    before = into_bins(FRAMES, GRID) @ speed(FRAMES - late)
    assert shown == pytest.approx(before, abs=UNEVEN)


@pytest.mark.parametrize("late", [0.0, 1e-3])
def test_an_absent_effect_shows_what_none_shows(late):
    sensor = sensor_of(speed(FRAMES))
    out = {"v": speed(ROWS)}
    absent = sensor.observe(out, [HeldFrames(channel="speed", hold=0.0)], late)
    assert absent == pytest.approx(sensor.observe(out, late=late), abs=UNEVEN)
