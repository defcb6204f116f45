"""Laws of the toothed wheel: no tooth lost, none doubled, every time to one microsecond."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slipbench.plant.blocks import Encoder
from slipbench.plant.effects.tooth_misplacement import ToothMisplacement
from slipbench.plant.encoder import Teeth, begin, passing_teeth, toothed_disc
from slipbench.plant.errors import ParameterError

STEP = 0.25e-3
DISC = toothed_disc(Encoder(), (ToothMisplacement(displacement=3e-3, tooth=7),))


def joined(pieces: list[Teeth]) -> Teeth:
    return Teeth(
        *(
            np.concatenate([getattr(p, f) for p in pieces])
            for f in ("ticks", "numbers", "directions")
        )
    )


def wandering(seed: int, speed: float, n: int = 4000) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A wheel that swings about a mean speed, through standstill and backwards as well."""
    a, b, c = np.random.default_rng(seed).uniform(2, 20, 3)
    t = np.arange(1, n + 1) * STEP
    angle = speed * t + a * (np.sin(b * t + c) - np.sin(c))
    return t, angle, speed + a * b * np.cos(b * t + c)


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 999), speed=st.floats(-200, 200), piece=st.integers(1, 50))
def test_piece_by_piece_is_the_same_as_in_one_go(seed, speed, piece):
    t, angle, rate = wandering(seed, speed)
    state = begin(0.0, 0.0, rate[0])
    last, whole = passing_teeth(DISC, state, t, angle, rate)
    pieces = []
    for i in range(0, len(t), piece):
        part = slice(i, i + piece)
        state, teeth = passing_teeth(DISC, state, t[part], angle[part], rate[part])
        pieces.append(teeth)
    parts = joined(pieces)
    assert (parts.ticks == whole.ticks).all()
    assert (parts.numbers == whole.numbers).all()
    assert (parts.directions == whole.directions).all()
    assert (state == last).all()


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 999), speed=st.floats(-200, 200))
def test_counted_teeth_are_the_angle_turned(seed, speed):
    t, angle, rate = wandering(seed, speed)
    _, teeth = passing_teeth(DISC, begin(0.0, 0.0, rate[0]), t, angle, rate)
    turned = teeth.directions.sum() * 2 * np.pi / 16
    assert abs(turned - angle[-1]) < 1.1 * 2 * np.pi / 16
    assert (np.diff(teeth.ticks) >= 0).all()
    forwards = teeth.directions[1:] + teeth.directions[:-1]
    assert (np.diff(teeth.numbers) == forwards / 2).all()


def test_the_tick_is_the_microsecond_in_which_the_tooth_passes():
    t = np.arange(1, 8001) * STEP
    angle, rate = 100 * t + 10 * t**2, 100 + 20 * t
    _, teeth = passing_teeth(DISC, begin(0.0, 0.0, 100.0), t, angle, rate)
    where = DISC.angles[teeth.numbers % 16] + 2 * np.pi * (teeth.numbers // 16)
    exact = (-100 + np.sqrt(100**2 + 40 * where)) / 20
    late = exact * 1e6 - teeth.ticks
    assert late.min() > -1e-4
    assert late.max() < 1 + 1e-4


def test_without_speeds_the_angle_is_a_straight_line_between_times():
    t = np.arange(1, 101) * 1e-2
    _, teeth = passing_teeth(DISC, begin(0.0, 0.0, 50.0), t, 50 * t)
    where = DISC.angles[teeth.numbers % 16] + 2 * np.pi * (teeth.numbers // 16)
    assert np.abs(where / 50 * 1e6 - teeth.ticks - 0.5).max() < 0.51


def test_a_wheel_at_rest_is_silent_even_on_a_tooth():
    at_tooth = DISC.angles[3]
    t = np.arange(1, 101) * STEP
    still = np.full(100, at_tooth)
    state, teeth = passing_teeth(DISC, begin(0.0, at_tooth, 0.0), t, still, np.zeros(100))
    assert len(teeth.ticks) == 0
    assert state[1] == at_tooth
    same, none = passing_teeth(DISC, state, t[:0], still[:0])
    assert (same == state).all()
    assert len(none.ticks) == 0


def test_a_tooth_cannot_be_moved_past_its_neighbour():
    far = ToothMisplacement(displacement=9e-3, pitch_radius=0.02, tooth=2)
    with pytest.raises(ParameterError, match="displaced beyond its neighbour"):
        toothed_disc(Encoder(), (far,))
