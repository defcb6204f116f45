"""Curves around a turn contain only the periodic part of a waveform."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slipbench.identification.mismatch.simulation.regressor import (
    ANGLE,
    KNOTS,
    columns,
    curve_waveform,
    knots_for,
)

TURNS = np.linspace(0.0, 8 * np.pi, 1601)
KNOTS_ROUND = knots_for(ANGLE, TURNS)
VALUES = st.lists(st.floats(-100.0, 100.0), min_size=KNOTS, max_size=KNOTS).map(np.array)


def round_with(values, z):
    return curve_waveform(ANGLE, z, KNOTS_ROUND, values, 1e-3)


@pytest.mark.parametrize("order", [1, 2, 3])
@given(phase=st.floats(0.0, 6.3))
def test_the_first_orders_are_told_exactly_wherever_they_stand(order, phase):
    wave = np.cos(order * TURNS + phase)
    values_round = round_with(np.cos(order * KNOTS_ROUND + phase), TURNS)
    assert values_round == pytest.approx(wave, abs=1e-9)


@given(VALUES, st.floats(-1e3, 1e3))
def test_what_is_there_all_round_is_none_of_the_angles(values, level):
    assert round_with(values + level, TURNS) == pytest.approx(round_with(values, TURNS), abs=1e-6)
    assert np.mean(round_with(values, TURNS[:-1])) == pytest.approx(0.0, abs=1e-8)


@given(VALUES)
def test_a_turn_ends_where_it_began_and_the_parts_add_up(values):
    total = round_with(values, TURNS)
    assert total[:400] == pytest.approx(total[400:800], abs=1e-8)
    parts = columns(ANGLE, TURNS, KNOTS_ROUND, 1e-3)
    assert sum(v * part for v, part in zip(values, parts, strict=True)) == pytest.approx(total)


def test_less_than_a_turn_is_of_no_use():
    assert knots_for(ANGLE, np.linspace(1.0, 7.0, 100)).size == 0
