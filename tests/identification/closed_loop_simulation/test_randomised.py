"""A few of the randomised rides; `make thousand` rides them all."""

from dataclasses import replace

import numpy as np
import pytest

from slipbench.identification.closed_loop_simulation.ride import ride
from slipbench.protocol.codec.messages import TripReason
from slipbench.protocol.configuration import read_toml
from slipbench.protocol.controller_file import ControllerFile
from slipbench.protocol.trial_file import TrialFile
from tests.identification.closed_loop_simulation.randomised import (
    drawn_motorcycle,
    drawn_scenario,
    judged,
    one,
    outcome,
)
from tests.paths import CONTROLLERS, TRIALS

SEED = 20
TRIAL = read_toml(TRIALS / "slip_steps_throttle.toml", TrialFile)
FILE = read_toml(CONTROLLERS / "throttle.toml", ControllerFile)


@pytest.mark.parametrize("number", range(6))
def test_no_command_of_a_controller_trips_the_gate(number):
    outcome = one(number, SEED)
    print(f"seed {SEED}, ride {number}: {outcome}")
    assert not outcome.startswith("TRIPPED")


@pytest.mark.parametrize(
    ("wider", "quicker", "reason"), [(2.0, 1.0, "AMPLITUDE"), (1.0, 60.0, "RATE")]
)
def test_the_rig_tells_a_controller_that_goes_too_far_or_too_fast(wider, quicker, reason):
    """The same ride, were the controller's limits not inside the gate's."""
    reach = wider * FILE.limits.high
    limits = FILE.limits.model_copy(
        update={"low": -reach, "high": reach, "rate": quicker * FILE.limits.rate}
    )
    rng = np.random.default_rng(SEED)
    wild = replace(drawn_scenario(rng), target=lambda t: 0.0 if int(8 * t) % 2 else 0.06)
    file = FILE.model_copy(update={"limits": limits, "governor": None})
    told = outcome(file, TRIAL, drawn_motorcycle(rng), wild, rng)
    assert told.startswith(f"TRIPPED by the controller: {reason}")


def test_the_rig_looks_at_every_tick_and_at_the_hand_back():
    rng = np.random.default_rng(SEED)
    ridden = ride(drawn_motorcycle(rng), replace(drawn_scenario(rng), duration=0.5), None)
    assert judged(ridden, "throttle", TRIAL) is None
    for tick in (0, 250, 499):
        jump = ridden.throttle.copy()
        jump[tick] += 0.02
        trip = judged(replace(ridden, throttle=jump), "throttle", TRIAL)
        assert trip is not None
        assert trip.reason == TripReason.RATE
    trip = judged(ridden, "throttle", TRIAL, grip=0.5)
    assert trip is not None
    assert trip.reason == TripReason.AMPLITUDE
