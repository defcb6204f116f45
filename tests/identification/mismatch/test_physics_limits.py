"""Stops, one-sided limits, loops and sensors of model files: what each may and may not do."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slipbench.identification.mismatch.systems.effects.bouc_wen import loop
from slipbench.identification.mismatch.systems.effects.cavitation import tear
from slipbench.identification.mismatch.systems.effects.choked_flow import choke
from slipbench.identification.mismatch.systems.effects.hard_stop import bounce
from slipbench.identification.mismatch.systems.effects.held_samples import HeldSamples
from slipbench.identification.mismatch.systems.effects.low_speed_dropout import tell
from slipbench.identification.mismatch.systems.effects.many_plays import follow
from slipbench.identification.mismatch.systems.effects.moving_average import average
from slipbench.identification.mismatch.systems.effects.saturation import limited

NUMBER = st.floats(-1e3, 1e3)
ABOVE = st.floats(1e-2, 1e3)


@given(NUMBER, ABOVE)
def test_a_ceiling_and_a_floor_together_are_a_saturation(value, limit):
    assert tear(choke(value, limit), limit) == limited(value, limit)
    assert choke(-abs(value), limit) == -abs(value)
    assert tear(abs(value), limit) == abs(value)


@given(NUMBER, NUMBER, NUMBER, ABOVE, st.floats(0.0, 2.0))
def test_a_stop_pushes_back_and_never_pulls(force, place, speed, limit, damping):
    there = bounce(force, place, speed, 0.01, limit, damping)
    if abs(place) <= limit:
        assert there == force
    else:
        assert (there - force) * place <= 0.0


def test_a_body_that_meets_a_stop_turns_back_within_some_steps():
    """It goes no deeper than speed over the contact's frequency, and loses speed."""
    place, speed, step, limit, deepest = 0.0, 2.0, 0.001, 1.0, 0.0
    for _ in range(1000):
        speed += step * bounce(0.0, place, speed, step, limit, 0.3)
        place += step * speed
        deepest = max(deepest, place - limit)
    assert 0.0 < deepest < 2.0 * 4.0 * step
    assert -2.0 < speed < 0.0


@given(NUMBER, st.floats(1e-2, 1e2))
def test_a_sensor_drops_out_below_its_threshold_only(value, threshold):
    reading = tell(value, threshold)
    assert abs(reading) <= abs(value)
    if abs(value) > 3.0 * threshold:
        assert reading == pytest.approx(value, rel=1e-3)
    if abs(value) < threshold / 3.0:
        assert abs(reading) <= 1e-3 * threshold


@given(st.floats(1e-3, 1.0), st.floats(-np.pi, np.pi))
def test_held_samples_are_never_older_than_their_hold(hold, phase):
    time = np.arange(0.0, 5.0, 0.01)
    late = HeldSamples(hold=hold, phase=phase).late(time)
    assert np.all(late >= 0.0)
    assert np.all(late <= hold)
    assert not HeldSamples(hold=0.0).late(time).any()


@given(st.floats(-10.0, 10.0), st.floats(-10.0, 10.0), st.floats(0.0, 2.0))
def test_the_mean_of_a_line_is_half_a_window_old_however_short_the_window_is(value, slope, window):
    step, mean = 1.0, value - 0.5 * slope * window
    shown, rate = average(value, value - slope * window, mean, window, step)
    assert shown == pytest.approx(mean, abs=1e-12)
    if window >= step:
        assert rate == pytest.approx(slope, abs=1e-12)


def around(act, size, kept, **named):
    """Input and output over three cycles of a triangle of this size."""
    cycle = np.concatenate([np.linspace(0, size, 50), np.linspace(size, -size, 100)])
    waveform = np.tile(np.concatenate([cycle, np.linspace(-size, 0, 50)]), 3)
    out = []
    for value in waveform:
        shown, *kept = act(value, *kept, **named)
        out.append(shown)
    return waveform, np.array(out)


@given(st.floats(0.1, 10.0), st.floats(0.1, 0.9), st.floats(0.1, 10.0))
def test_a_part_that_yields_stays_within_its_level_and_loses_work(size, share, level):
    waveform, out = around(loop, size, (0.0, 0.0), share=share, level=level)
    part = (out - (1.0 - share) * waveform) / share
    assert np.abs(part).max() <= level * (1.0 + 1e-9)
    last = slice(400, None)
    assert np.trapezoid(out[last], waveform[last]) >= -1e-9


@given(st.floats(0.1, 10.0), st.floats(0.01, 10.0))
def test_many_plays_of_no_width_pass_everything_and_loops_lie_within_the_widest(size, width):
    waveform, out = around(follow, size, (0.0, 0.0, 0.0, 0.0), width=width)
    assert np.abs(out - waveform).max() <= 0.625 * width * (1.0 + 1e-9)
    _, free = around(follow, size, (0.0, 0.0, 0.0, 0.0), width=0.0)
    assert np.allclose(free, waveform)


def test_small_reversals_make_small_loops_within_large_ones():
    """Of many plays; a single play has no output for amplitudes below its width."""
    lost = [
        np.trapezoid(out[400:], waveform[400:])
        for waveform, out in (
            around(follow, s, (0.0,) * 4, width=1.0) for s in (0.2, 0.4, 1.0, 2.0)
        )
    ]
    assert all(abs(a) < abs(b) for a, b in itertools.pairwise(lost))
