"""Friction may act at an input along an output that is the speed of what the input drives."""

import numpy as np
import pytest
from scipy import signal

from slipbench import InputError, Parameter, recording_of
from slipbench.identification.mismatch.callables.description import Ports
from slipbench.identification.mismatch.callables.function_system import function_system
from slipbench.identification.mismatch.simulation.causal_partition import CausalPartition
from slipbench.identification.mismatch.simulation.simulation_input import SimulationInput

PERIOD, FINER = 0.01, 20
INERTIA, LOSS, FRICTION, STRIBECK = 0.5, 0.4, 0.3, 0.4
PORTS = Ports(("torque",), ("speed",), speeds={"torque": "speed"})
CHAIN = CausalPartition({"system": ()}, ())


def motor(parameters, inputs, times):
    decay = np.exp(-parameters["loss"] / INERTIA * (times[1] - times[0]))
    gain = (1.0 - decay) / parameters["loss"]
    return {"speed": signal.lfilter([0.0, gain], [1.0, -decay], inputs["torque"])}


def turned(seed, noise=0.0):
    """A motor with dry friction, integrated in steps of half a millisecond."""
    print(f"seed {seed}")
    rng = np.random.default_rng(seed)
    torque = np.repeat(2.0 * rng.standard_normal(60), 10)
    speed, shown = 0.0, []
    for u in torque:
        shown.append(speed)
        for _ in range(FINER):
            rubbed = FRICTION * np.tanh(10.0 * speed / STRIBECK)
            speed += PERIOD / FINER * (u - rubbed - LOSS * speed) / INERTIA
    time = PERIOD * np.arange(torque.size)
    values = {"torque": torque, "speed": np.array(shown) + noise * rng.standard_normal(time.size)}
    return recording_of(f"motor{seed}", time, values, {"torque": "N m", "speed": "rad/s"})


def system(recording, ports=PORTS):
    return function_system(motor, {"loss": Parameter(LOSS, 0.1)}, ports, [recording])


def test_friction_outside_of_a_function_is_friction_inside():
    """The regressor is the noisy recorded speed at first, then the simulated speed."""
    recording = turned(1, noise=0.01)
    there = system(recording)
    record = there.prepare(recording)
    kind = next(k for k in there.library if k.name == "friction")
    values = {"force": FRICTION, "breakaway": 0.0, "stribeck": STRIBECK}
    given = SimulationInput.undisturbed(record, CHAIN, "system")
    with_friction = there.at([], np.zeros(0), [kind(**values)])
    shown, without = (s.simulate(given)["speed"] for s in (with_friction, there))
    truth = turned(1).channels["speed"].value[1:]
    error, before = (float(np.std(s - truth)) for s in (shown, without))
    print(error, before)
    assert error < 0.03 * before


def test_friction_is_no_candidate_where_no_speed_is_named():
    recording = turned(2)
    plain = system(recording, Ports(("torque",), ("speed",)))
    assert "friction" not in {k.name for k in plain.library}
    assert "friction" in {k.name for k in system(recording).library}


@pytest.mark.parametrize("speeds", [{"torqeu": "speed"}, {"torque": "sped"}])
def test_a_speed_that_is_no_output_is_named(speeds):
    with pytest.raises(InputError, match=r"did you mean '(torque|speed)'"):
        system(turned(2), Ports(("torque",), ("speed",), speeds=speeds))
