"""Effects of model files that every machine may have, on a servo that has every kind of place."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slipbench.identification.mismatch.runs import read_system
from slipbench.identification.mismatch.simulation.causal_partition import CausalPartition
from slipbench.identification.mismatch.simulation.simulation_input import SimulationInput
from slipbench.identification.mismatch.systems.effects.back_drive_loss import lose
from slipbench.identification.mismatch.systems.effects.braking_loop import approach
from slipbench.identification.mismatch.systems.effects.elastic_backlash import strike
from slipbench.identification.mismatch.systems.effects.elastic_load import pull_back
from slipbench.identification.mismatch.systems.effects.library import BY_NAME
from slipbench.identification.mismatch.systems.effects.load_friction import rub
from slipbench.identification.mismatch.systems.effects.presliding import bend
from slipbench.identification.mismatch.systems.effects.rate_limit import ramp
from slipbench.identification.mismatch.systems.effects.supply_limit import limit_force
from slipbench.protocol.units import to_base
from tests.identification.mismatch.laws.servo import MODEL, servo, turned

CHAIN = CausalPartition({"system": ()}, ())
STORE = """
[states.warmth]
rate = "drive - warmth"
size = { value = 1, unit = "V" }
"""


@pytest.fixture(scope="module")
def machine(tmp_path_factory):
    return servo(tmp_path_factory.mktemp("servo"), MODEL + STORE)


@pytest.fixture(scope="module")
def record(machine):
    return machine.prepare(turned(7, seconds=3.0))


def shown(machine, record, *effects):
    there = machine.at([], np.zeros(0), effects)
    return there.simulate(SimulationInput.undisturbed(record, CHAIN, "system"))["encoder"]


def kinds(machine, name):
    return [k for k in machine.library if k.name == name]


def test_every_placed_effect_tells_its_own_page(machine):
    """Trace and confusions of an accepted effect are those of its kind, at every place."""
    for kind in machine.library:
        assert kind.page() == BY_NAME[kind.name].page()
        assert kind.page()["Trace"]
        assert kind.page()["Confused with"]
        assert kind.confused_with == BY_NAME[kind.name].confused_with


def test_the_unit_of_every_parameter_is_one_that_a_model_file_may_write(machine):
    for kind in machine.library:
        for p in kind.parameters():
            assert to_base(p.unit)[0] == 1.0, f"{kind().key}: {p.name} in {p.unit}"


@pytest.mark.parametrize(
    "name", ["viscous_friction", "quadratic_drag", "presliding", "supply_limit", "back_emf"]
)
def test_an_effect_along_a_speed_reads_back_as_it_was_written(machine, record, tmp_path, name):
    effect = kinds(machine, name)[0]()
    written = machine.at([], np.zeros(0), (effect,)).as_improved(machine.plus_minus)
    path = tmp_path / "improved.toml"
    path.write_text(written.text(), encoding="utf-8")
    again = shown(read_system(path), record)
    assert np.allclose(again, shown(machine, record, effect), atol=1e-9)


@pytest.mark.parametrize("name", ["acceleration_limit", "jerk_limit", "elastic_backlash"])
def test_what_moves_a_speed_stands_at_the_rate_of_a_speed_only(machine, name):
    assert {k.place.name for k in kinds(machine, name)} == {"speed_rate"}


def test_a_slew_limit_stands_at_what_is_neither_a_speed_nor_its_integral(machine):
    assert {k.place.name for k in kinds(machine, "slew_limit")} == {"warmth_rate"}


def test_cogging_goes_with_angles_only(machine):
    assert {k.place.other for k in kinds(machine, "cogging")} == {"angle"}
    orders = {n for k in kinds(machine, "cogging") for n in range(round(k().order) - 3, 30)}
    assert orders >= set(range(2, 30))


SIZED = ("viscous_friction", "quadratic_drag", "load_friction", "back_emf", "leak_from_channel")


@pytest.mark.parametrize("name", SIZED)
def test_twice_a_small_size_has_twice_the_effect(machine, record, name):
    """The other load has no influence in this servo, so an effect there has no response."""
    plain = shown(machine, record)
    acting = [k for k in kinds(machine, name) if k.place.name != "load"]
    assert acting
    for kind in acting:
        p = kind.parameters()[0]
        one, two = (
            shown(machine, record, replace(kind(), **{p.name: 1e-4 * k * p.typical})) - plain
            for k in (1.0, 2.0)
        )
        assert np.abs(one).max() > 0.0, kind().key
        assert np.allclose(two, 2.0 * one, atol=0.02 * np.abs(two).max()), kind().key


def test_back_emf_of_a_plain_drive_is_viscous_friction_at_its_torque(machine, record):
    """The two are one force where the drive acts in proportion; they are listed as confused."""
    (emf,) = kinds(machine, "back_emf")[:1]
    viscous = next(k for k in kinds(machine, "viscous_friction") if k.place.name == "torque")
    one = shown(machine, record, emf(constant=0.05))
    assert np.allclose(one, shown(machine, record, viscous(coefficient=20 * 0.05)), atol=1e-9)
    assert "viscous_friction" in emf.confused_with


NUMBER = st.floats(-1e3, 1e3)
ABOVE = st.floats(1e-2, 1e3)


@given(NUMBER, NUMBER, st.floats(0.0, 0.9), ABOVE)
def test_load_friction_takes_power_and_never_gives_any(force, speed, share, creep):
    remaining = rub(force, speed, share, creep)
    assert remaining * speed <= force * speed + 1e-9 * abs(force * speed)
    assert abs(remaining) <= 2.0 * abs(force)


@given(NUMBER, NUMBER, st.floats(0.0, 2.0), ABOVE)
def test_back_driving_loses_only_where_the_load_drives(force, speed, share, creep):
    remaining = lose(force, speed, share, creep)
    if force * speed >= 0.0:
        assert remaining == force
    else:
        assert remaining * speed <= force * speed * (1.0 - 1e-9)


@given(NUMBER, NUMBER, ABOVE, ABOVE)
def test_a_supply_gives_less_the_faster_it_turns_and_more_for_braking(force, speed, limit, free):
    remaining = limit_force(force, speed, limit, free)
    assert abs(remaining) <= abs(force)
    if remaining * speed > 0.0:
        assert abs(remaining) <= limit
    assert abs(limit_force(force, 0.0, limit, free)) == min(abs(force), limit)


@given(NUMBER, st.lists(st.floats(-50.0, 50.0), min_size=1, max_size=30), ABOVE)
def test_presliding_stays_within_its_force_and_splits_time_exactly(torque, speeds, distance):
    """Two halves of a step are the step, at a constant speed."""
    bent = halves = 0.0
    for speed in speeds:
        remaining, bent, _ = bend(torque, speed, bent, speed, 0.01, 2.0, distance)
        _, middle, _ = bend(torque, speed, halves, speed, 0.005, 2.0, distance)
        _, halves, _ = bend(torque, speed, middle, speed, 0.005, 2.0, distance)
        assert abs(torque - remaining) <= 2.0 + 1e-9
        assert bent == pytest.approx(halves, abs=1e-9)


@given(st.lists(NUMBER, min_size=2, max_size=50), ABOVE)
def test_a_jerk_limit_changes_by_no_more_than_its_limit(values, limit):
    kept = values[0]
    for value in values:
        before, (new, kept, _) = kept, ramp(value, kept, value, 0.5, 0.5, limit, 1.0)
        assert abs(new - before) <= 0.5 * limit * (1.0 + 1e-9)
        assert min(before, value) <= new <= max(before, value)


@given(NUMBER, NUMBER, ABOVE)
def test_a_braking_loop_never_passes_its_target_and_arrives_in_time(start, target, deceleration):
    """From rest of the target it takes sqrt(2 way / deceleration), for steps that are short."""
    way = abs(target - start)
    time = np.sqrt(2.0 * way / deceleration)
    place, step = start, time / 2000 or 1.0
    for _ in range(2100):
        before, (place, *_) = place, approach(target, place, target, step, step, deceleration)
        assert abs(target - place) <= abs(target - before)
    assert abs(target - place) <= 1e-5 * way + 1e-9


@given(NUMBER, NUMBER, NUMBER, st.floats(0.0, 0.9), ABOVE)
def test_without_a_gap_backlash_is_an_elastic_load(force, deflection, velocity, share, frequency):
    one = strike(force, deflection, velocity, share, frequency, 0.1, 0.0)
    other = pull_back(force, deflection, velocity, share, frequency, 0.1)
    if deflection:
        assert one == pytest.approx(other)
    inside = strike(force, 0.5, velocity, share, frequency, 0.1, 1.0)
    assert inside == pytest.approx((force / (1.0 - share), velocity, -force / (1.0 - share)))


@pytest.mark.parametrize("name", ["supply_sag", "thermal_gain"])
def test_a_drive_at_rest_is_fresh_and_after_long_work_it_has_its_final_gain(machine, name):
    """Constant work of size f ends at 1 - r f, or at 1 - g f^2."""
    act = BY_NAME[name].act
    assert act is not None
    state = 0.0
    gains = []
    for _ in range(4000):
        value, rate = act(2.0, state, 0.1, 1.0)
        state += 0.01 * rate
        gains.append(value / 2.0)
    assert gains[0] == 1.0
    assert all(b <= a for a, b in itertools.pairwise(gains))
    assert gains[-1] == pytest.approx(0.8 if name == "supply_sag" else 0.6, abs=1e-6)
