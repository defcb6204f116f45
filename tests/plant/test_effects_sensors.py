"""Laws of the effects in sensors, channels and clocks: each does what its equation says."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slipbench.plant.blocks import Encoder
from slipbench.plant.channels import DEFAULT_CHANNELS
from slipbench.plant.effects.channel_lag import ChannelLag
from slipbench.plant.effects.channel_latency import ChannelLatency
from slipbench.plant.effects.channel_scale import ChannelScale
from slipbench.plant.effects.clock_drift import ClockDrift
from slipbench.plant.effects.clock_offset import ClockOffset
from slipbench.plant.effects.direction_blind_counter import DirectionBlindCounter
from slipbench.plant.effects.eccentricity import Eccentricity
from slipbench.plant.effects.effect import Effect
from slipbench.plant.effects.held_frames import HeldFrames
from slipbench.plant.effects.library import LIBRARY
from slipbench.plant.effects.mounting_angle import MountingAngle
from slipbench.plant.effects.moving_average import MovingAverage
from slipbench.plant.effects.optical_lag import OpticalLag
from slipbench.plant.effects.optical_scale import OpticalScale
from slipbench.plant.effects.quantiser import Quantiser
from slipbench.plant.effects.stale_frames import StaleFrames
from slipbench.plant.encoder import ToothedDisc, begin, passing_teeth, toothed_disc
from slipbench.plant.sensing import SensorEffect, clock_of, measure, measure_channel, sensor_effects
from slipbench.plant.update_times import renewals, rhythm

TELLING = [effect for effect in LIBRARY if isinstance(effect(), SensorEffect)]
TIME = np.arange(1, 1501) * 1e-3
VALUE = 100.0 + 40.0 * np.sin(9 * TIME)
ENGINE = replace(DEFAULT_CHANNELS["engine_speed"], quantum=0.0)


def told(effect: Effect, value: np.ndarray = VALUE, time: np.ndarray = TIME) -> np.ndarray:
    return measure((effect,), (), time, value)[1]


@pytest.mark.parametrize("kind", TELLING, ids=lambda e: e.name)
@settings(max_examples=5, deadline=None)
@given(cuts=st.lists(st.integers(1, 1499), max_size=40, unique=True))
def test_piece_by_piece_tells_the_same_as_in_one_go(kind, cuts):
    effects = (kind(channel="engine_speed"),)
    whole = measure(effects, (), TIME, VALUE)[1]
    memories, pieces = (), []
    for part in np.split(np.arange(len(TIME)), sorted(cuts)):
        memories, seen = measure(effects, memories, TIME[part], VALUE[part])
        pieces.append(seen)
    assert np.concatenate(pieces) == pytest.approx(whole, rel=1e-12)


def test_effects_act_on_their_own_channel_signals_before_frames():
    effects = (Quantiser(), ChannelLatency(channel="optical_speed"), ChannelScale())
    assert sensor_effects(effects, "engine_speed", "signal", "frame") == (effects[2], effects[0])
    assert sensor_effects(effects, "throttle_position", "signal", "frame") == ()


def test_without_effects_a_channel_is_told_as_it_is_sampled():
    stamp, value = measure_channel((), "engine_speed", ENGINE, TIME, VALUE)
    assert stamp == pytest.approx(np.arange(1, 151) * 10e-3)
    assert value == pytest.approx(np.interp(stamp, TIME, VALUE))


def test_a_late_channel_tells_what_was_a_latency_ago():
    assert told(ChannelLatency(latency=17e-3))[17:] == pytest.approx(VALUE[:-17])


def test_a_lag_settles_to_a_share_of_one_less_one_over_e_in_its_time():
    seen = told(ChannelLag(time_constant=0.1), np.where(TIME > 0.1001, 1.0, 0.0))
    half_a_sample = 0.5e-3  # the step is a ramp between two samples
    at = np.interp(0.1005 + 0.1, TIME, seen)
    assert at == pytest.approx(1 - math.exp(-1), abs=half_a_sample / 0.1)
    ramp = told(ChannelLag(time_constant=0.1), 5.0 * TIME)
    assert (5.0 * TIME - ramp)[-1] == pytest.approx(0.5, rel=1e-5)


@pytest.mark.parametrize("window", [0.3e-3, 4e-3, 25.5e-3])
def test_an_average_trails_a_ramp_by_half_of_its_window_and_keeps_a_constant(window):
    average = MovingAverage(window=window)
    behind = (5.0 * TIME - told(average, 5.0 * TIME))[30:]
    assert behind == pytest.approx(5.0 * window / 2)
    assert told(average, np.full(TIME.size, 3.0)) == pytest.approx(3.0)


@pytest.mark.parametrize("turns", [1, 2, 3])
def test_an_average_stops_motion_with_a_whole_number_of_periods_in_its_window(turns):
    wave = np.sin(2 * np.pi * turns * TIME / 50e-3)
    assert np.abs(told(MovingAverage(window=50e-3), wave))[50:].max() < 1e-12


def test_a_wrong_sign_is_an_error_of_minus_two():
    assert told(ChannelScale(error=-2.0)) == pytest.approx(-VALUE)
    assert told(ChannelScale(error=0.03)) == pytest.approx(1.03 * VALUE)


def test_a_blind_counter_keeps_the_size_and_loses_the_sign():
    swing = VALUE - 100.0
    assert told(DirectionBlindCounter(), swing) == pytest.approx(np.abs(swing))


def test_a_short_word_tells_whole_steps_and_is_off_by_half_of_one_at_most():
    seen = told(Quantiser(quantum=6.0))
    assert np.abs(seen / 6.0 - np.round(seen / 6.0)).max() < 1e-9
    assert np.abs(seen - VALUE).max() <= 3.0 + 1e-9


def test_a_held_value_is_renewed_once_a_hold():
    seen = told(HeldFrames(hold=25e-3))
    renewed = TIME[1:][np.diff(seen) != 0.0]
    assert np.diff(renewed) == pytest.approx(25e-3)
    assert np.interp(renewed, TIME, seen) == pytest.approx(np.interp(renewed, TIME, VALUE))


def test_a_stale_frame_repeats_the_one_before_as_often_as_it_says():
    seen = told(StaleFrames(share=0.2), TIME)
    stale = np.flatnonzero(np.diff(seen, prepend=0.0) == 0.0)
    assert len(stale) / len(TIME) == pytest.approx(0.2, abs=0.04)
    assert (seen[stale] == seen[stale - 1]).all()
    fresh = np.setdiff1d(np.arange(len(TIME)), stale)
    assert (seen[fresh] == TIME[fresh]).all()
    assert (told(StaleFrames(share=0.2, seed=1), TIME) != seen).any()


def again_in(seen):
    return (np.diff(seen, prepend=seen[0] - 1.0) == 0.0).astype(float)


@pytest.mark.parametrize("truth", [StaleFrames(share=s) for s in (0.05, 0.2, 0.5)])
def test_stale_frames_that_are_known_are_told_as_they_were(truth):
    value = 5.0 * TIME
    seen = told(truth, value)
    again = again_in(seen)
    known, beat = renewals(value, again, 0.0), rhythm(again)
    assert beat == 0.0
    as_seen = replace(truth, share=known.share).with_repeats(known, beat, TIME, value)
    assert as_seen == pytest.approx(seen)
    half = replace(truth, share=known.share / 2).with_repeats(known, beat, TIME, value)
    assert half == pytest.approx((seen + value) / 2)
    assert (HeldFrames().with_repeats(known, beat, TIME, value) == value).all()


@pytest.mark.parametrize("frames", [1.3, 1.5, 2.0, 2.7, 6.3])
def test_held_frames_that_are_known_are_told_as_they_were(frames):
    value, period = 5.0 * TIME, TIME[1] - TIME[0]
    seen = told(HeldFrames(hold=frames * period), value)
    again = again_in(seen)
    known, beat = renewals(value, again, 0.0), rhythm(again)
    assert beat == pytest.approx(frames, rel=0.01)
    exact = HeldFrames(hold=beat * period).with_repeats(known, beat, TIME, value)
    assert exact == pytest.approx(seen)
    assert (StaleFrames().with_repeats(known, beat, TIME, value) == value).all()


def test_repetition_where_nothing_moves_tells_nothing_of_renewals():
    assert renewals(np.full(TIME.size, 3.0), np.ones(TIME.size), 0.1) is None
    few = (np.arange(TIME.size) % 500 == 7).astype(float)
    assert renewals(5.0 * TIME, few, 0.0) is None


def test_a_clock_is_ahead_by_its_offset_and_gains_by_its_drift():
    effects = (ClockOffset("ecu", 0.25), ClockDrift("ecu", 1e-4), ClockOffset("optical", 9.0))
    stamp, value = measure_channel(effects, "engine_speed", ENGINE, TIME, VALUE)
    true = np.arange(1, 151) * 10e-3
    assert stamp == pytest.approx(true + 0.25 + 1e-4 * true, abs=1e-12)
    assert value == pytest.approx(np.interp(true, TIME, VALUE))
    assert clock_of(effects, DEFAULT_CHANNELS["rear_teeth"]) == (0.0, 0.0)


# Teeth


def gaps(disc: ToothedDisc, speed: float = 100.0) -> np.ndarray:
    t = np.arange(1, 4001) * 0.25e-3
    turning = np.full(4000, speed)
    _, seen = passing_teeth(disc, begin(0.0, 0.0, speed), t, speed * t, turning)
    return np.diff(seen.ticks)


def test_misplaced_teeth_repeat_every_turn_and_add_up_to_a_full_turn(demonstration):
    disc = toothed_disc(demonstration.rear_encoder, demonstration.effects)
    teeth, seen = len(disc.angles), gaps(disc)
    assert np.abs(seen[teeth:] - seen[:-teeth]).max() <= 1
    turns = np.convolve(seen, np.ones(teeth), "valid")
    assert np.abs(turns - 2e6 * np.pi / 100.0).max() <= 1
    late = np.ptp(seen) / 2 * 1e-6 * 100.0
    assert late == pytest.approx(3e-3 / 0.1, rel=0.01)


@pytest.mark.parametrize("order", [1, 3])
def test_run_out_is_one_line_at_its_order(order):
    """What is told swings by the run-out; the finite gap takes sin(x) / x of it."""
    effect = Eccentricity(run_out=0.02, order=order)
    seen = gaps(toothed_disc(Encoder(), (effect,)))[:160]
    speed = 2 * np.pi / 16 / (seen * 1e-6)
    lines = 2 * np.abs(np.fft.rfft(speed / 100.0 - 1)) / len(speed)
    assert int(lines[5:].argmax()) + 5 == 10 * order
    assert lines[10 * order] == pytest.approx(0.02 * np.sinc(order / 16), rel=0.02)


def test_a_disc_of_the_other_wheel_is_left_alone():
    front = Eccentricity(encoder="front_encoder")
    assert (toothed_disc(Encoder(), (front,)).angles == toothed_disc(Encoder()).angles).all()
    moved = toothed_disc(Encoder(), (front,), "front_encoder").angles
    assert (moved != toothed_disc(Encoder()).angles).any()


# Optical sensor


def test_the_optical_speed_trails_by_lag_times_acceleration(ridden):
    out = ridden(OpticalLag(time_constant=0.03), seconds=2.0, throttle_command=np.full(2000, 0.1))
    trail = (out.speed - out.optical_speed) / out.acceleration
    assert trail[-1] == pytest.approx(0.03, rel=0.02)
    rate = np.gradient(out.optical_speed, out.time)
    slope = (out.speed - out.optical_speed) / 0.03
    assert rate[10:-10] == pytest.approx(slope[10:-10], abs=1e-4)


def test_the_optical_scale_is_a_factor_at_every_speed(moment):
    for speed in (10.0, 60.0):
        seen = moment(OpticalScale(error=0.01), speed=speed)
        assert seen["optical_speed"] == pytest.approx(1.01 * speed)


def test_a_sensor_askew_sees_the_cosine_and_pitches_with_the_frame(moment):
    seen = moment(MountingAngle(angle=0.2, pitch=0.01))
    axis = math.cos(0.2 + 0.01 * seen["acceleration"])
    assert seen["optical_speed"] == pytest.approx(53.0 * axis)
