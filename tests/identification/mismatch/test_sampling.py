"""Interpolation of the simulation between its rows."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slipbench.identification.mismatch.simulation.sampling import Grid, at_points, at_points_sharp

GRID = Grid(rows=600, start=0.1, bins=40, width=0.01)
ROWS = GRID.step * np.arange(1, GRID.rows + 1)
INSTANTS = st.lists(st.floats(0.05, 0.55), min_size=1, max_size=30).map(np.array)


@given(INSTANTS, st.floats(0.0, 0.4), st.floats(0.0, 6.3))
def test_a_swing_of_four_tenths_of_the_rows_rate_is_told_within_three_per_cent(time, share, phase):
    def wave(t):
        return np.cos(2 * np.pi * share / GRID.step * t + phase)

    assert at_points_sharp(time, GRID) @ wave(ROWS) == pytest.approx(wave(time), abs=0.03)


def test_a_straight_line_loses_a_quarter_of_four_cylinders_at_nine_thousand():
    time = np.random.default_rng(1).uniform(0.1, 0.5, 2000)
    line = 2j * np.pi * 2 * 9000 / 60
    kept = {
        read: abs(np.mean(read(time, GRID) @ np.exp(line * ROWS) * np.exp(-line * time)))
        for read in (at_points, at_points_sharp)
    }
    assert kept[at_points] == pytest.approx(0.75, abs=0.02)
    assert kept[at_points_sharp] == pytest.approx(1.0, abs=0.003)


@given(INSTANTS, st.floats(-1e3, 1e3))
def test_what_stays_is_told_as_it_is_to_the_ends_of_the_recording(time, level):
    everywhere = np.concatenate((time, [0.0, GRID.step * GRID.rows]))
    held = at_points_sharp(everywhere, GRID) @ np.full(GRID.rows, level)
    assert held == pytest.approx(np.full(everywhere.size, level), abs=1e-9)
