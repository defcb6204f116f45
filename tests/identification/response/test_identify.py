"""From teeth, drifting clocks and late frames back to the slip dynamics that made them."""

from dataclasses import replace

import numpy as np
import pytest

from slipbench.identification.response.identify import identify, slip_range
from slipbench.identification.response.resonance import Resonance
from slipbench.identification.signals.clocks import ClockFit, Unaligned
from slipbench.identification.signals.motion import Motion, NoMotion
from slipbench.identification.signals.trial_window import NoExcitation, TrialWindow
from slipbench.protocol.codec.messages import Phase, TripReason
from slipbench.protocol.recording.channel import Channel
from tests.identification.synthetic_recording import Truth, recording, sweep, sweep_trial


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_the_slip_dynamics_are_recovered_from_teeth(seed):
    truth = Truth(seed=seed, noise=0.05, tooth_error=0.003)
    found = identify(recording(truth, lost_frames=2))
    inside = (found.main.frequency > 1) & (found.main.frequency < 13)
    ratio = found.main.value[inside] / truth.response(found.main.frequency[inside])
    assert np.median(np.abs(np.abs(ratio) - 1)) < 0.01
    assert np.median(np.abs(np.degrees(np.angle(ratio)))) < 1.0
    assert np.max(np.abs(ratio - 1)) < 0.06
    assert found.main.coherence.min() > 0.95
    assert found.resonance.frequency == pytest.approx(7.48, abs=0.1)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_longer_delay_shows_as_that_much_more_phase(seed):
    one, two = (identify(recording(Truth(seed=seed, delay=delay))).main for delay in (0.004, 0.012))
    slope = np.polyfit(2 * np.pi * one.frequency, np.unwrap(np.angle(two.value / one.value)), 1)[0]
    assert -slope == pytest.approx(0.008, abs=2e-4)


def test_clocks_are_aligned_and_slip_has_no_offset():
    truth = Truth()
    found = identify(recording(truth))
    for clock, drift in truth.drift.items():
        fit = found.data.clocks[clock]
        assert isinstance(fit, ClockFit)
        assert fit.drift == pytest.approx(drift, abs=1e-6)
    before = slice(500, 2500)
    assert np.nanmean(found.motion.slip.ratio[before]) == pytest.approx(truth.mean, abs=1e-4)


def test_a_rolling_wheel_has_no_slip():
    found = identify(recording(Truth(mean=0.0, gain=0.0)))
    low, high = slip_range(found)
    assert max(abs(low), abs(high)) < 1e-3
    assert not isinstance(found.resonance, Resonance)


def test_lost_frames_leave_gaps_in_the_slip():
    whole, holed = (identify(recording(lost_frames=n)).motion for n in (0, 6))
    holes = np.isnan(holed.slip.ratio) & np.isfinite(whole.slip.ratio)
    assert 6 <= holes.sum() < 200
    known = np.isfinite(holed.raw) & np.isfinite(whole.raw)
    assert np.max(np.abs(holed.raw[known] - whole.raw[known])) < 0.05 * 53


def test_the_notch_lowers_the_1x_line():
    assert identify(recording(Truth(tooth_error=0.005))).motion.line_reduction > 30


def test_the_1x_line_lies_where_the_orders_are_marked():
    found = identify(recording(Truth(tooth_error=0.005)))
    wheel = found.spectra[0]
    above = wheel.frequency > 18
    top = wheel.frequency[above][np.argmax(wheel.amplitude[above])]
    assert top == pytest.approx(wheel.orders[0], abs=0.3)


def test_the_spark_is_read_from_its_own_echo():
    made = recording(trial=sweep_trial(actuator="spark", amplitude="4 deg"))
    spark = replace(made.channels["throttle_command"], role="spark_command", unit="rad")
    channels = {**made.channels, "spark_command": spark}
    del channels["throttle_command"]
    found = identify(replace(made, channels=channels))
    assert (found.main.input, found.main.output) == ("spark_command", "slip")


def test_a_multisine_and_a_square_wave_are_read_too():
    truth = Truth()
    lines = np.arange(3.0, 48, 2)
    phases = np.random.default_rng(1).uniform(0, 2 * np.pi, lines.size)

    def multisine(t):
        wave = np.sin(2 * np.pi * np.multiply.outer(t, lines) / 4 + phases).sum(axis=-1) / 8
        return np.where((t >= 0) & (t < 20), wave, 0.0)

    spec = {"waveform": "multisine", "lowest": "0.75 Hz", "highest": "12 Hz", "period": "4 s"}
    found = identify(recording(truth, sweep_trial(**spec), multisine)).main
    np.testing.assert_allclose(found.value, truth.response(found.frequency), rtol=0.05, atol=0.01)

    def square(t):
        return np.where((t >= 0) & (t < 20), np.sign(np.sin(2 * np.pi * t + 1e-9)), 0.0)

    spec = {"waveform": "square", "frequency": "1 Hz"}
    found = identify(recording(truth, sweep_trial(**spec), square)).main
    few = found.frequency < 12
    np.testing.assert_allclose(
        found.value[few], truth.response(found.frequency[few]), rtol=0.06, atol=0.01
    )


def test_a_trip_in_the_middle_leaves_the_band_that_was_swept():
    made = recording()
    phase = made.channels["trial_phase"]
    cut = np.where(phase.time > 13.0, Phase.TRIPPED, phase.value).astype(float)
    reason = np.where(phase.time > 13.0, TripReason.SLIP, TripReason.NONE).astype(float)
    channels = {
        **made.channels,
        "trial_phase": replace(phase, value=cut),
        "trip_reason": replace(phase, role="trip_reason", value=reason),
    }
    found = identify(replace(made, channels=channels))
    assert isinstance(found.window, TrialWindow)
    assert found.window.trip == TripReason.SLIP
    assert found.window.trip_time == pytest.approx(13.0, abs=0.05)
    assert found.main.frequency[-1] == pytest.approx(7.75, abs=0.2)
    assert not isinstance(found.resonance, Resonance)


def test_missing_channels_are_named():
    made = recording(phases=False)
    found = identify(made)
    assert isinstance(found.window, NoExcitation)
    assert found.main is None
    left = {x.analysis: x for x in found.left_out}
    response = left["frequency response from throttle or spark to slip"]
    assert "no trial phase" in response.reason
    assert "trial_phase" in response.roles


@pytest.mark.parametrize("role", ["rear_teeth", "optical_speed"])
def test_without_wheel_or_reference_there_is_no_slip_and_the_roles_are_named(role):
    made = recording()
    channels = {name: c for name, c in made.channels.items() if name != role}
    found = identify(replace(made, channels=channels))
    assert isinstance(found.motion, NoMotion)
    assert role in " ".join(x for item in found.left_out for x in item.roles)


def test_a_clock_that_jumps_is_left_out_by_name():
    made = recording()
    teeth = made.channels["rear_teeth"]
    jumped = replace(teeth, time=teeth.time + np.where(teeth.time > 30, 0.3, 0.0))
    found = identify(replace(made, channels={**made.channels, "rear_teeth": jumped}))
    assert isinstance(found.data.clocks["rear_encoder"], Unaligned)
    assert any("rear_encoder" in item.analysis for item in found.left_out)
    assert isinstance(found.motion, NoMotion)


def test_cars_take_the_undriven_axle_and_average_left_and_right():
    made = recording(phases=False)
    t = np.arange(0, 20, 0.02)
    speeds = {
        "rear_left_wheel_speed": 20.4,
        "rear_right_wheel_speed": 20.8,
        "front_left_wheel_speed": 20.1,
        "front_right_wheel_speed": 19.9,
    }
    channels = {
        role: Channel(role, t, np.full_like(t, v), "m/s", "bus", role) for role, v in speeds.items()
    }
    found = identify(replace(made, channels=channels, duration=19.9))
    assert isinstance(found.motion, Motion)
    np.testing.assert_allclose(found.motion.slip.ratio, 0.03, atol=1e-9)
    assert "front" in found.motion.reference_name


def test_the_input_is_the_echo_and_not_the_intent():
    """An ECU that halves what it is asked for is not taken for a motorcycle with half the gain."""
    truth = Truth()
    half = identify(recording(truth, wave=lambda t: 0.5 * sweep(t, 20.0))).main
    middle = (half.frequency > 1) & (half.frequency < 10)
    ratio = half.value[middle] / truth.response(half.frequency[middle])
    assert np.median(np.abs(ratio - 1)) < 0.01


def test_an_input_that_follows_the_slip_is_refused_as_a_closed_loop():
    """A traction control that is left on moves the throttle by what the slip did beside the sweep.

    It does not imitate that the slip answers in turn.
    """
    made = recording(Truth(noise=0.5, seed=7))
    first = identify(made)
    command, base = made.channels["throttle_command"], first.base
    moved = np.nan_to_num(first.motion.slip.ratio)
    # What the slip did beside its answer to the sweep: the same ride without noise, taken off.
    quiet = np.nan_to_num(identify(recording(Truth(noise=0.0, seed=7))).motion.slip.ratio)
    n = min(moved.size, quiet.size)
    noise = moved[:n] - quiet[:n]
    kick = 0.15 * np.std(command.value) / np.std(noise[2000:-2000]) * noise
    since = command.time - command.time[0]
    added = np.interp(since, base.time[:n] - base.time[0], kick)
    looped = replace(command, value=command.value - added)
    found = identify(replace(made, channels={**made.channels, "throttle_command": looped}))
    assert found.main is None
    reasons = " ".join(str(item) for item in found.left_out)
    assert "closed loop" in reasons
    assert first.main is not None
