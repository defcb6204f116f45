"""Laws of sensor effects on the bus: messages have the values that the effects measure."""

from dataclasses import replace

import numpy as np
import pytest

from slipbench.bench.vehicle.virtual_motorcycle import Scenario, read_vehicle
from slipbench.plant.effects.channel_latency import ChannelLatency
from slipbench.plant.effects.channel_scale import ChannelScale
from slipbench.plant.effects.clock_drift import ClockDrift
from slipbench.plant.effects.clock_offset import ClockOffset
from slipbench.plant.effects.held_frames import HeldFrames
from slipbench.plant.effects.quantiser import Quantiser
from slipbench.protocol.codec.messages import BenchMessage, EngineStatus, OpticalSpeed
from slipbench.protocol.errors import InputError
from tests.bench.conditions import trial_file
from tests.bench.lockstep import LockStep
from tests.paths import DEMONSTRATION

VEHICLE = read_vehicle(DEMONSTRATION)


def said(kind: type[BenchMessage], *effects: object, milliseconds: int = 400) -> np.ndarray:
    """Speed and time stamp in every message of one name, with disturbances, without noise."""
    motorcycle = replace(VEHICLE.motorcycle, effects=effects)
    channels = {name: replace(timing, noise=0.0) for name, timing in VEHICLE.channels.items()}
    scenario = Scenario(replace(VEHICLE, motorcycle=motorcycle, channels=channels), trial_file())
    with LockStep(scenario) as lockstep:
        for _ in range(milliseconds):
            lockstep.live()
        heard = [message for _, message in lockstep.heard() if isinstance(message, kind)]
    field = {EngineStatus: "engine_speed", OpticalSpeed: "speed"}[kind]
    return np.array([(getattr(message, field), message.time) for message in heard])


def test_a_late_channel_sends_the_value_of_one_latency_ago():
    plain = said(EngineStatus)[:, 0]
    late = said(EngineStatus, ChannelLatency(channel="engine_speed", latency=10e-3))[:, 0]
    assert np.ptp(plain) > 0.5
    assert late[2:] == pytest.approx(plain[:-2], abs=0.06)  # the wheel of a frame: 0.5 rpm


def test_scale_and_word_length_act_one_after_the_other():
    plain = said(OpticalSpeed)[:, 0]
    effects = (Quantiser("optical_speed", 0.3), ChannelScale("optical_speed", 0.5))
    coarse = said(OpticalSpeed, *effects)[:, 0]
    assert np.abs(coarse - 0.3 * np.round(1.5 * plain / 0.3)).max() < 0.31
    assert np.abs(coarse / 0.3 - np.round(coarse / 0.3)).max() < 0.05


def test_a_held_value_is_renewed_once_a_hold():
    seen = said(EngineStatus, HeldFrames("engine_speed", 20e-3))[:, 0]
    assert (np.diff(seen) != 0.0).mean() == pytest.approx(5 / 20, abs=0.03)


def test_a_wrong_clock_changes_the_time_stamps_of_its_channels_only():
    plain = said(OpticalSpeed)
    wrong = said(OpticalSpeed, ClockOffset("optical", 0.3), ClockDrift("optical", 5e-3))
    assert wrong[:, 0] == pytest.approx(plain[:, 0], abs=0.02)
    elapsed = wrong[:, 1] - plain[:, 1]
    assert elapsed == pytest.approx(0.3 + 5e-3 * plain[:, 1], abs=1e-4)
    other = said(EngineStatus, ClockOffset("optical", 0.3))
    assert other[:, 1] == pytest.approx(said(EngineStatus)[:, 1])


@pytest.mark.parametrize("effect", [ChannelScale("temperatures"), ClockOffset("sundial")])
def test_an_effect_on_a_channel_that_is_not_sent_is_rejected(effect):
    with pytest.raises(InputError, match="acts on a channel or clock"):
        said(EngineStatus, effect, milliseconds=1)
