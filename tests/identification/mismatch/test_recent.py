"""The cache of a recording returns what would be computed, and keeps its stated size."""

import gc
from dataclasses import replace
from inspect import signature

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from slipbench.identification.mismatch.analysis import begin
from slipbench.identification.mismatch.motorcycle import simulate
from slipbench.identification.mismatch.motorcycle.causal_cut import SERVO_SEAMS
from slipbench.identification.mismatch.simulation.model import Model, predict
from slipbench.identification.mismatch.simulation.recent import Recent
from slipbench.identification.mismatch.simulation.record import Record
from slipbench.identification.mismatch.simulation.sampling import Grid
from slipbench.plant.composition import SERVO
from slipbench.plant.effects.channel_lag import ChannelLag
from slipbench.plant.effects.firing_torque import FiringTorque
from slipbench.plant.effects.library import LIBRARY, STAND_INS
from slipbench.plant.effects.radius_growth import RadiusGrowth
from slipbench.plant.effects.rate_limit import RateLimit
from slipbench.plant.layout import moving
from tests.identification.mismatch.conditions import erring, system
from tests.identification.motorcycle_recording import Ride, ride


def record() -> Record:
    nothing = np.zeros((0, 0))
    return Record("one", 0.0, Grid(0, 0.0, 0, 0.01), nothing, {}, {}, nothing)


@given(st.lists(st.integers(0, 6), max_size=40), st.integers(1, 4))
def test_the_last_few_keys_are_not_computed_again(keys, most):
    kept, one, made = Recent[int](most), record(), list[int]()
    for i, key in enumerate(keys):
        before = len(made)
        assert kept.of(one, key, lambda key=key: made.append(key) or 10 * key) == 10 * key
        recent = list(dict.fromkeys(reversed(keys[:i])))[:most]
        assert (len(made) == before) == (key in recent)


def test_recordings_share_nothing_and_take_their_results_with_them():
    kept, one, other = Recent[str](2), record(), record()
    assert kept.of(one, "key", lambda: "one") == "one"
    assert kept.of(other, "key", lambda: "other") == "other"
    assert len(kept._kept) == 2
    del one
    gc.collect()
    assert len(kept._kept) == 1


def test_a_throttle_servo_takes_nothing_but_its_own_numbers_effects_and_command():
    """So cached servo runs stay valid while other parts of the motorcycle change."""
    known = {"throttle", "throttle_rate", "throttle_command", "step", "time"}
    known |= {e.__name__ for e in SERVO}
    for equation in SERVO:
        assert all(_of_the_servo(n, known) for n in signature(equation).parameters), equation
    for effect in moving((*LIBRARY, *STAND_INS)):
        own = {p.name for p in effect.parameters()} | set(effect.states)
        for hook in (h for h in effect.hooks if h.seam in SERVO_SEAMS):
            for argument in signature(hook.function).parameters:
                for name in effect.tuples.get(argument, (argument,)):
                    assert name in own or _of_the_servo(name, known), (effect, hook.seam, name)


def test_a_prediction_does_not_depend_on_what_was_kept():
    """For every way in which a point can differ from the preceding point."""
    rides = (Ride("sweep", 2, 1400.0, 0.04, 0.5, 9.0, seconds=3.0, seed=s) for s in (51, 52))
    model = begin(system(), [system().prepare(ride(erring(5), r)) for r in rides], ()).training
    start, rng = model.origin(), np.random.default_rng(3)
    late = ChannelLag(channel="throttle_position", time_constant=4e-3)
    acting = ((late,), (late, RateLimit()), (RadiusGrowth(),), (FiringTorque(),), ())
    points = [replace(start, effects=effects) for effects in acting]
    points.append(replace(start, x=0.3 * rng.standard_normal(len(start.x)), effects=(late,)))
    points.append(replace(start, q=tuple(0.3 * rng.standard_normal(q.size) for q in start.q)))
    again = [predict(model, p) for p in (*points, *reversed(points))][len(points) :]
    for point, found in zip(reversed(points), again, strict=True):
        for kept in (simulate._TABLES, simulate._SERVOS, simulate._ERRORS, simulate._LED):
            kept._kept.clear()
        alone = predict(Model(system(), model.records, model.partition, model.known), point)
        for ones, others in zip(found, alone, strict=True):
            assert all(np.array_equal(a, b) for a, b in zip(ones, others, strict=True))


def _of_the_servo(name: str, known: set[str]) -> bool:
    return name in known or name.startswith("throttle_servo_")
