"""A throttle that nothing moves stays where it was recorded, if dry contact can hold it there."""

from dataclasses import replace

import numpy as np
import pytest

from slipbench.identification.mismatch.simulation.model import models, predict
from slipbench.plant.effects.gear_play import GearPlay
from tests.identification.mismatch.conditions import nominal, system
from tests.identification.motorcycle_recording import Ride, ride

PLAY = 4e-3
STEP = 1e-3
"""Quantization step of the recorded opening."""
SPARK = Ride("spark", 3, 1200.0, 0.1, 0.6, 6.0, seconds=4.0, seed=7)


def error_at_rest(opening: float, play: float) -> float:
    """Mean error of the simulated opening. opening: recorded, beside the command."""
    recording = ride(nominal().motorcycle, SPARK)
    channel = recording.channels["throttle_position"]
    rng = np.random.default_rng(3)
    value = STEP * np.round(
        (channel.value + opening + 3e-4 * rng.standard_normal(channel.value.size)) / STEP
    )
    channels = {**recording.channels, "throttle_position": replace(channel, value=value)}
    record = system().prepare(replace(recording, channels=channels))
    (model,) = models(system(), [record])
    point = replace(model.origin(), effects=(GearPlay(play=play),) if play else ())
    predicted = predict(model, point)
    group = next(b for b in model.partition.groups if "throttle_position" in b.outputs)
    at = model.partition.groups.index(group)
    column = group.outputs.index("throttle_position")
    return float(np.mean((model.measured[at][0] - predicted[at][0])[:, column]))


@pytest.mark.parametrize("share", [-0.45, 0.0, 0.2, 0.45])
def test_a_servo_with_play_stays_where_it_was_left(share):
    """With a state that began at zero it stood at one end of the play: 2e-3 away."""
    assert abs(error_at_rest(share * PLAY, PLAY)) < 0.2 * STEP


@pytest.mark.parametrize("share", [-0.45, 0.45])
def test_a_servo_without_play_goes_to_its_command(share):
    assert error_at_rest(share * PLAY, 0.0) == pytest.approx(share * PLAY, abs=0.2 * STEP)


@pytest.mark.parametrize("share", [-1.0, 1.0])
def test_a_servo_is_held_no_farther_than_by_its_play(share):
    assert error_at_rest(share * PLAY, PLAY) == pytest.approx(0.5 * share * PLAY, abs=0.2 * STEP)
