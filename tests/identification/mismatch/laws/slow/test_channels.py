"""Effects of a channel: repeated frames, coarse quantization, latency, own clock."""

import pytest

from slipbench.identification.mismatch.reporting.verdict import Verdict
from tests.identification.mismatch.laws.explained import effect, holds, names, reported
from tests.identification.mismatch.laws.motorcycle import (
    averaged,
    held,
    lagging,
    late,
    on_a_clock,
    ridden,
    rounded,
    stale,
)

FRAMES = ("held_frames", "stale_frames", "channel_latency", "channel_lag", "optical_lag")
STEP = 0.25  # m/s
HOLD, LAG = 30e-3, 15e-3  # s


def test_coarse_steps_are_named_with_the_step_of_the_recording():
    """The step is computed from the values; no fit of residuals estimates it better."""
    found = ridden(
        library=("quantiser", "channel_latency", "channel_lag", "stale_frames", "held_frames"),
        change=rounded("optical_speed", STEP),
    )
    assert names(found) == ["quantiser.optical_speed"], reported(found)
    (step,) = effect(found, "quantiser").parameters
    assert step.value == pytest.approx(STEP, rel=5e-3)


@pytest.fixture(scope="module")
def steady() -> Verdict:
    return ridden(library=FRAMES, change=held("optical_speed", HOLD))


def test_frames_held_at_a_steady_rate_are_named_so(steady):
    """There are no updates soon after another."""
    assert names(steady) == ["held_frames.optical_speed"], reported(steady)


@pytest.mark.xfail(reason="26.0 ms (25.1 to 26.8) for 30 ms", strict=False)
def test_the_time_between_updates_is_within_its_interval(steady):
    assert holds(steady, "held_frames", "hold", HOLD)


def test_frames_repeated_at_random_are_named_so():
    found = ridden(library=FRAMES, change=stale("optical_speed", 0.4))
    assert names(found) == ["stale_frames.optical_speed"], reported(found)
    assert holds(found, "stale_frames", "share", 0.4, slack=0.05)


@pytest.mark.parametrize(
    ("channel", "hold", "jitter"), [("optical_speed", HOLD, 4e-3), ("engine_speed", 20e-3, 3e-3)]
)
def test_frames_held_with_jitter_are_named_so(channel, hold, jitter):
    """An additional lag or latency is a false second name."""
    found = ridden(library=FRAMES, change=held(channel, hold, jitter))
    assert names(found) == [f"held_frames.{channel}"], reported(found)


def test_a_speed_sensor_two_samples_late_is_named():
    found = ridden(
        library=("channel_latency", "channel_lag", "optical_lag", "relaxation_length"),
        change=late("optical_speed", 8e-3),
    )
    assert names(found) == ["channel_latency.optical_speed"], reported(found)
    assert holds(found, "channel_latency", "latency", 8e-3, slack=0.1)


def test_a_lag_of_the_throttle_sensor_is_one_effect_of_the_sensor():
    """The lagging channel drives the motion as well: its effect is removed from that input."""
    found = ridden(
        library=("channel_lag", "channel_latency", "asymmetric_filling"),
        change=lagging("throttle_position", LAG),
    )
    assert names(found) == ["channel_lag.throttle_position"], reported(found)
    assert holds(found, "channel_lag", "time_constant", LAG, slack=0.03)


@pytest.mark.parametrize(("channel", "window"), [("engine_speed", 36e-3), ("optical_speed", 40e-3)])
def test_a_moving_average_is_one_effect_of_the_sensor(channel, window):
    """A latency and a lag together describe it nearly as well."""
    found = ridden(
        library=("moving_average", *FRAMES, "relaxation_length"), change=averaged(channel, window)
    )
    assert names(found) == [f"moving_average.{channel}"], reported(found)
    assert holds(found, "moving_average", "window", window, slack=0.05)


IN_A_TABLE = pytest.mark.xfail(
    reason="an alarm (p 1e-7 and 5e-7) with a curve over the past of the engine speed or the slip rate",
    strict=False,
)


@pytest.mark.parametrize("by", ["its own clock", pytest.param("the bus", marks=IN_A_TABLE)])
@pytest.mark.parametrize("drift", [5e-4, -5e-4])
def test_a_clock_of_an_encoder_that_is_off_is_no_physics(drift, by):
    """Clocks of devices are uncertain by 0.05 % unless their file says otherwise.

    If the times are declared as bus times, no other data contain the clock error.
    """
    found = without_physics(drift, by)
    assert not found.mismatch, reported(found)
    assert not found.effects


def test_times_of_an_encoder_in_a_table_are_no_physics():
    """The preceding case without its clock drift."""
    found = without_physics(0.0, "the bus")
    assert not found.mismatch, reported(found)


def without_physics(drift: float, by: str) -> Verdict:
    return ridden(
        library=("driveline_loss", "relaxation_length", "radius_growth"),
        change=on_a_clock("rear_teeth", drift, named=by == "its own clock"),
    )
