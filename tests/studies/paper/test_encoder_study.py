"""What an encoder is said to know is what a turning wheel shows, and the paper's claims hold."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slipbench.identification.report import drawing
from slipbench.identification.response.identify import identify
from slipbench.identification.signals.teeth import delay
from slipbench.identification.signals.tooth_pitch import NoToothPitch, order_of_gaps
from slipbench.studies.paper import encoder_figures, filter_figures
from slipbench.studies.paper.encoder_study import encoder_claims, encoder_curve, shown_wave, slowest
from slipbench.studies.paper.line_reduction import LEARNT, line_reductions, reduction_claims
from slipbench.studies.paper.wheel_orders import (
    displaced_tooth,
    line_frequency,
    order_amplitudes,
    order_claims,
    tooth_angle,
)
from tests.identification.signals.toothed_wheel import tooth_times
from tests.identification.synthetic_recording import Truth, recording


@pytest.mark.parametrize("teeth", [16, 32, 48])
@pytest.mark.parametrize("speed", [8.0, 20.0, 60.0])
def test_a_turning_wheel_shows_the_formulas_delay_and_error(speed, teeth):
    curve = encoder_curve(np.array([speed]), 0.32, teeth)
    read = shown_wave(speed, 0.32, teeth)
    assert read.delay == pytest.approx(curve.delay[0], rel=0.01)
    assert 0.3 * curve.error[0] < read.error <= 1.05 * curve.error[0]
    assert read.gain == pytest.approx(np.sinc(10 * curve.delay[0]) ** 2, rel=0.1)


@given(speed=st.floats(2, 100), radius=st.floats(0.2, 0.4), teeth=st.integers(8, 60))
def test_more_teeth_are_younger_and_less_exact(speed, radius, teeth):
    few, more = (encoder_curve(np.array([speed]), radius, n) for n in (teeth, 2 * teeth))
    assert more.delay[0] == pytest.approx(few.delay[0] / 2)
    assert more.error[0] > few.error[0]
    assert delay(np.array([slowest(0.01, radius, teeth)]), radius, teeth)[0] == pytest.approx(0.01)


def test_the_papers_encoder_claims_hold_with_16_teeth_and_fail_with_48():
    assert all(claim.holds for claim in encoder_claims(0.32))
    assert not any(claim.holds for claim in encoder_claims(0.32, teeth=48))


def turning(gaps, lasts=10.0, ramp=0.5):
    t = np.arange(0, lasts, 1 / 4000)
    speed = 2 * np.pi * (20 + ramp * t)
    time, count = tooth_times(t, speed, gaps)
    grid = np.arange(0.1, lasts - 0.1, 1e-3)
    shown = 2 * np.pi / gaps.size / np.diff(time)
    value = np.interp(grid, (time[:-1] + time[1:]) / 2, shown) / np.interp(grid, t, speed) - 1
    return value, tooth_angle(time, count, gaps.size, grid)


@given(displacement=st.floats(0.5e-3, 3e-3), order=st.integers(1, 2))
@settings(max_examples=15, deadline=None)
def test_geometry_predicts_the_line_that_is_read(displacement, order):
    gaps = displaced_tooth(displacement, 0.1, 16)
    read = order_amplitudes(*turning(gaps), (order,))[0]
    assert read == pytest.approx(order_of_gaps(gaps, order), rel=0.06)
    assert order_of_gaps(gaps, order) == pytest.approx(
        displacement / 0.1 / np.pi * 2 * np.sin(np.pi * order / 16)
    )


def test_the_line_is_found_where_it_is():
    value, angle = turning(displaced_tooth(3e-3, 0.1, 16), ramp=0.0)
    assert line_frequency(value, angle, 1000.0) == pytest.approx(20.0, abs=0.1)
    assert order_amplitudes(np.full(50, np.nan), np.full(50, np.nan), (1,)).size == 1


@pytest.fixture(scope="module")
def found():
    return identify(recording(Truth(tooth_error=0.00375, noise=0.02)))


def test_the_line_is_the_wheels_and_learnt_teeth_take_it_off(found):
    claims = {claim.name: claim for claim in order_claims(found)}
    assert claims["first_order_at_70_kmh"].holds
    assert claims["displaced_tooth_makes_the_line"].holds  # the same first order, spread over all
    assert not claims["displaced_tooth_learnt"].holds  # but it is not one tooth
    lines = line_reductions(found)
    assert lines.decibels(LEARNT)[0] > 35
    assert lines.decibels(LEARNT)[0] > 20 + lines.decibels(LEARNT)[4]  # nothing was at 5X
    assert all(c.holds for c in reduction_claims(lines) if "notch" in c.name)


def test_every_figure_is_drawn(found, tmp_path):
    lines = line_reductions(found)
    with drawing.style():
        made = [
            encoder_figures.encoder(0.32),
            encoder_figures.orders(found),
            encoder_figures.teeth(found.motion.pitch),
            filter_figures.filtering(found, lines),
            filter_figures.phases(lines, 53.0, 0.32, 16),
        ]
    for index, figure in enumerate(made):
        drawing.png(figure, tmp_path / f"{index}.png")
        assert figure.axes
    assert np.all(filter_figures.phase_costs(lines)["tooth pitch compensated"] == 0)


def test_without_teeth_nothing_is_claimed():
    whole = recording()
    channels = {k: c for k, c in whole.channels.items() if k != "rear_teeth"}
    bare = identify(type(whole)(**{**whole.__dict__, "channels": channels}))
    assert order_claims(bare) == ()
    assert isinstance(line_reductions(bare), NoToothPitch)
