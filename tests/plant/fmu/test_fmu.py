"""An exported FMU is the plant: the same outputs, parameters that act, states that can be restored."""

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree as Xml

import numpy as np
import pytest

from slipbench.fmu_check import largest_deviation, require_valid, simulated
from slipbench.plant.effects.library import LIBRARY
from slipbench.plant.fmu.description import description
from slipbench.plant.fmu.explaining import INPUTS, OUTPUTS, file_beside
from slipbench.plant.fmu.export import write_fmu
from slipbench.plant.fmu.model import FmuModel, model_at
from slipbench.plant.fmu.units import fmi_unit
from slipbench.plant.fmu.variables import INPUT, OUTPUT, PARAMETER, RATIO, variables
from slipbench.plant.motorcycle import Motorcycle
from slipbench.plant.parameters import Block
from slipbench.plant.simulation import Simulation
from tests.plant.fmu.conftest import STEP, Slave

Made = Callable[[], Slave]


def test_its_outputs_equal_those_of_the_plant(fmu: Path, model: FmuModel) -> None:
    """A sweep of throttle and spark, with brake, grade and grip that move."""
    require_valid(fmu)
    assert largest_deviation(fmu, model) < 1e-10


def test_every_effect_of_the_library_acts_in_an_fmu_as_in_the_plant(
    headers: Path, tmp_path: Path
) -> None:
    """All that act in the equations of motion at once, each with its typical size."""
    effects = tuple(kind() for kind in LIBRARY if kind.hooks)
    every = model_at("every effect", Simulation(Motorcycle(effects=effects), STEP), 2, 1200.0)
    fmu = tmp_path / "every.fmu"
    write_fmu(fmu, every, 3, headers)
    assert {f"effects.{e.name}" for e in effects} <= {
        v.name.rpartition(".")[0] for v in variables(every)
    }
    assert largest_deviation(fmu, every) < 1e-9


def ridden(one: Slave, model: FmuModel, steps: int, name: str) -> np.ndarray:
    found = []
    for k in range(steps):
        one.set("throttle_command", model.command + 0.02 * math.sin(0.05 * k))
        one.step(1e-3 * k)
        found.append(one.get(name))
    return np.array(found)


def expected(model: FmuModel, steps: int, name: str) -> np.ndarray:
    wave = model.command + 0.02 * np.sin(0.05 * np.arange(steps))
    gear = np.full(steps, float(model.gear))
    return simulated(model, {"throttle_command": wave, "gear": gear})[name]


@pytest.mark.parametrize(
    ("block", "name", "value"),
    [("body", "mass", 300.0), ("throttle_servo", "delay", 11.3e-3), ("engine", "spark_delay", 0.0)],
)
def test_a_parameter_acts_as_in_the_vehicle_file(
    slave: Made, model: FmuModel, block: str, name: str, value: float
) -> None:
    one = slave()
    one.initialize(**{f"{block}.{name}": value})
    changed: Block = replace(getattr(model.motorcycle, block), **{name: value})
    other = replace(model, motorcycle=replace(model.motorcycle, **{block: changed}))
    assert np.allclose(ridden(one, model, 200, "slip"), expected(other, 200, "slip"), atol=1e-12)


def test_a_gear_ratio_and_an_effect_act_as_in_the_vehicle_file(
    slave: Made, model: FmuModel
) -> None:
    bike = model.motorcycle
    gears = (bike.gears[0], 1.02 * bike.gears[1], *bike.gears[2:])
    effects = tuple(replace(e, slack=0.08) if e.name == "backlash" else e for e in bike.effects)
    one = slave()
    one.initialize(**{"gears[2]": gears[1], "effects.backlash.slack": 0.08})
    other = replace(model, motorcycle=replace(bike, gears=gears, effects=effects))
    assert np.allclose(
        ridden(one, model, 200, "rear_speed"), expected(other, 200, "rear_speed"), rtol=1e-12
    )


def test_steps_of_communication_do_not_change_what_constant_inputs_do(
    slave: Made, model: FmuModel
) -> None:
    fine, coarse = slave(), slave()
    for one in (fine, coarse):
        one.initialize(throttle_command=model.command + 0.03)
    for k in range(80):
        fine.step(0.25e-3 * k, 0.25e-3)
    coarse.step(0.0, 20e-3)
    assert fine.get("slip") == pytest.approx(coarse.get("slip"), rel=1e-12)


def test_a_restored_state_goes_on_as_before_and_instances_are_apart(
    slave: Made, model: FmuModel
) -> None:
    one, other = slave(), slave()
    one.initialize()
    ridden(one, model, 30, "slip")
    kept = one.slave.getFMUState()
    first = one.slave.serializeFMUState(kept)
    one.set("throttle_command", 0.3)
    one.step(30e-3, 5e-3)
    after = one.get("slip")
    other.initialize()  # does not touch the first one
    one.slave.setFMUState(kept)
    assert one.slave.serializeFMUState(one.slave.getFMUState()) == first
    one.set("throttle_command", 0.3)
    one.step(30e-3, 5e-3)
    assert one.get("slip") == after
    assert other.get("slip") != after


def test_it_starts_in_the_steady_state(slave: Made, model: FmuModel) -> None:
    """Nothing changes while nothing is changed, from the first output on."""
    one = slave()
    one.initialize()
    before = [one.get(name) for name in ("engine_speed", "speed", "slip", "acceleration")]
    one.step(0.0, 0.1)
    after = [one.get(name) for name in ("engine_speed", "speed", "slip", "acceleration")]
    assert after == pytest.approx(before, rel=1e-6, abs=1e-6)


@pytest.mark.parametrize(
    ("act", "sentence"),
    [
        (lambda one: one.set("body.mass", -3.0), "body.mass = -3 is outside of"),
        (lambda one: one.set("gear", 2.5), "gear = 2.5: a whole number"),
        (lambda one: one.set("gear", 9.0), "gear = 9 is outside of 0 to 6"),
        (lambda one: one.set("throttle_command", math.nan), "throttle_command = NaN"),
        (lambda one: one.set("slip", 0.1), "slip is an output"),
        (lambda one: (one.initialize(), one.set("body.mass", 200.0)), "before the end of init"),
        (lambda one: (one.initialize(), one.step(0.0, 0.3e-3)), "internal step, 0.25 ms"),
        (lambda one: (one.initialize(), one.step(0.5, 1e-3)), "0.5 s is not where"),
        (
            lambda one: (one.initialize(**{"initial.speed": 1e300}), one.step(0.0, 1e-3)),
            "not finite",
        ),
    ],
)
def test_what_cannot_be_done_fails_with_a_sentence(
    slave: Made, act: Callable[[Slave], object], sentence: str
) -> None:
    one = slave()
    with pytest.raises(Exception, match="failed with status"):
        act(one)
    assert one.version == "2" or any(sentence in said for said in one.said), one.said


@pytest.mark.parametrize("version", [2, 3])
def test_every_parameter_of_the_vehicle_file_is_there_with_its_bounds(
    version: int, model: FmuModel
) -> None:
    text = description(version, model, variables(model), "{}")
    there = {v.attrib.get("name"): v for v in Xml.fromstring(text).iter()}
    for block, part in model.motorcycle.blocks():
        for known in part.parameters():
            found = there[f"{block}.{known.name}"]
            numbers = found if version == 3 else found[0]
            assert float(numbers.attrib["start"]) == getattr(part, known.name)
            assert float(numbers.attrib["min"]) == known.low
    names = [v.name for v in variables(model)]
    assert len(names) == len(set(names))
    assert names.count("effects.backlash.slack") == 1


def test_units_are_those_of_the_plant_in_the_spelling_of_fmi() -> None:
    unit = fmi_unit("kg m^2")
    assert unit is not None
    assert (unit.name, unit.exponents) == ("kg.m2", {"kg": 1, "m": 2})
    torque = fmi_unit("N m s/rad")
    assert torque is not None
    assert torque.exponents == {"kg": 1, "m": 2, "s": -1, "rad": -1}
    assert fmi_unit("1") is None


def test_the_file_beside_names_variables_of_the_fmu(model: FmuModel) -> None:
    known = {v.name: v.kind for v in variables(model)}
    text = file_beside(model, {"body.mass": 5.0, "gears.3": 0.01})
    assert 'variable = "body.mass"' in text
    assert 'variable = "gears[3]"' in text
    assert known["body.mass"] == PARAMETER
    assert known["gears[3]"] == RATIO
    assert {known[name] for name in INPUTS} == {INPUT}
    assert {known[name] for name in OUTPUTS} == {OUTPUT}
