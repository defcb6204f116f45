"""Results are reported in the file's units, and the improved file keeps the user's text."""

import tomllib
from dataclasses import replace

import numpy as np
import pytest

from slipbench.identification.mismatch.curves.curve import Curve
from slipbench.identification.mismatch.fit.held_out import Error
from slipbench.identification.mismatch.motorcycle.system import MotorcycleSystem
from slipbench.identification.mismatch.naming.interval import Estimate
from slipbench.identification.mismatch.reporting.conclude import in_written_units
from slipbench.identification.mismatch.reporting.improvement import (
    Change,
    Improvement,
    OutputImprovement,
)
from slipbench.identification.mismatch.reporting.memo import lines, sentence
from slipbench.identification.mismatch.reporting.verdict import FoundEffect, Verdict, as_tree
from slipbench.identification.mismatch.runs import read_system
from slipbench.identification.mismatch.simulation.written_units import WrittenUnits
from slipbench.plant.effects.backlash import Backlash
from slipbench.plant.vehicle_file import load_vehicle
from slipbench.plant.vehicles import builtin_vehicle
from tests.identification.mismatch.spring import MODEL

DEGREES = MODEL.replace(
    'size = { value = 1, unit = "m" }', 'size = { value = 57, unit = "deg" } # angle'
).replace("[states.velocity]", "# The oscillation.\n[states.velocity]")


@pytest.fixture
def pendulum(tmp_path):
    path = tmp_path / "pendulum.toml"
    path.write_text(DEGREES.replace("10 ms", "13 ms"), encoding="utf-8")
    return read_system(path)


def cubic(system, **values):
    kind = next(k for k in system.library if k.name == "cubic" and k.place.name == "deflection")
    return kind(**values)


def test_results_are_printed_in_the_units_of_the_file(pendulum):
    zone = FoundEffect(
        "dead_zone",
        "deflection",
        "deflection",
        (
            Estimate("width", "rad", np.radians(4.0), np.radians(3.0), np.radians(5.0)),
            Estimate("cube", "1/rad^2", np.degrees(1.0) ** 2 * 0.5, 0.0, np.degrees(1.0) ** 2),
        ),
        9.0,
    )
    error = Error("place", "rad", *np.radians((3.0, 2.0, 1.0, 0.5)), "innovations", (0.2, 0.4))
    fell = Change(np.radians(2.0), np.radians(1.0), (0.4, 0.6))
    result = Verdict(
        True,
        0.01,
        effects=(zone,),
        held_out=(error,),
        improvement=Improvement(
            9.0, (5.0, 13.0), (OutputImprovement("place", "rad", 1.0, fell, fell),)
        ),
        headline="place",
        written=pendulum.written,
    )
    assert "width 4.0 +- 1.0 deg" in sentence(result)
    assert "from 2 to 1 deg" in sentence(result)
    text = "\n".join(lines(result))
    assert "dead_zone.width = 4 [3, 5] deg" in text
    assert "dead_zone.cube = 0.5 [0, 1] 1/deg^2" in text
    assert as_tree(result)["effects"][0]["parameters"][0]["unit"] == "rad"
    assert as_tree(result)["held_out"][0]["nominal"] == error.nominal


def test_a_curve_is_the_same_in_the_units_of_the_file(pendulum):
    knots = np.radians(np.linspace(-30.0, 30.0, 7))
    curve = Curve("deflection", "deflection", "rad", "position", knots, 0.1 * knots, 1, 1, 0.0)
    read, unit = in_written_units(curve, pendulum)
    assert (unit, read.unit) == ("deg", "deg")
    assert np.allclose(read.knots, np.linspace(-30.0, 30.0, 7))
    assert np.allclose(np.radians(read(np.degrees(knots))), curve(knots))


def test_a_unit_that_a_file_does_not_write_in_one_way_alone_stays_si():
    tree = {"a": {"value": 1, "unit": "mm"}, "b": {"value": 1, "unit": "m"}}
    assert WrittenUnits.of_tree(tree).factor("m") == (1.0, "m")
    assert WrittenUnits.of_tree({"a": tree["a"]}).factor("m") == (pytest.approx(1e3), "mm")


def test_the_improved_model_file_differs_in_its_numbers_alone(pendulum, tmp_path):
    known = {**pendulum.plus_minus, "parameters.gain": 3.0, "effects.cubic.deflection.cube": 0.02}
    values = pendulum.values.copy()
    values[0] = 97.0
    better = replace(pendulum, values=values, acting=(cubic(pendulum, cube=0.3),)).as_improved(
        known
    )
    old, new = DEGREES.replace("10 ms", "13 ms").splitlines(), better.text().splitlines()
    assert [line for line in old if line not in new] == [
        'name = "Mass on a spring"',
        'gain = { value = 100, unit = "N/kg/V", plus_minus = 20 }',
    ]
    added = [line for line in new if line not in old]
    assert 'gain = { value = 97.0, unit = "N/kg/V", plus_minus = 3.0 }' in added
    assert any('unit = "1/deg^2"' in line for line in added)
    path = tmp_path / "improved.toml"
    path.write_text(better.text(), encoding="utf-8")
    again = read_system(path)
    assert again.values == pytest.approx(values)
    assert again.effects[0].cube == pytest.approx(0.3)
    (cube,) = (e.values["cube"] for e in again.file.effects)
    assert cube.si_plus_minus == pytest.approx(0.02, rel=1e-3)
    assert again.as_improved(again.plus_minus).text().count("[[effects]]") == 1


def test_the_improved_vehicle_file_keeps_comments_order_and_units(tmp_path):
    path = tmp_path / "mine.toml"
    text = builtin_vehicle("nominal").read_text(encoding="utf-8")
    text = text.replace("[intake]", "# From the bench of March.\n[intake] # with airbox")
    text = text.replace('delay = { value = 10, unit = "ms"', 'delay = { value = 13, unit = "ms"')
    path.write_text(text, encoding="utf-8")
    system = MotorcycleSystem.load(path)
    bike = system.vehicle.motorcycle
    better = replace(
        bike,
        intake=replace(bike.intake, filling_time=6.1e-3),
        engine=replace(bike.engine, peak_speed=1200.0),
        effects=(*bike.effects, Backlash(slack=8e-3)),
    )
    known = {**system.plus_minus, "effects.backlash.slack": 4e-4}
    improved = replace(system, vehicle=replace(system.vehicle, motorcycle=better)).as_improved(
        known
    )
    old, new = text.splitlines(), improved.text().splitlines()
    assert len([line for line in old if line not in new]) == 3  # the name and two numbers
    assert "[intake] # with airbox" in new
    assert 'delay = { value = 13, unit = "ms", plus_minus = 3 }' in new
    assert 'filling_time = { value = 6.1, unit = "ms", plus_minus = 3 }' in new
    assert tomllib.loads(improved.text())["engine"]["peak_speed"]["unit"] == "rpm"
    path.write_text(improved.text(), encoding="utf-8")
    again = load_vehicle(path)
    assert again.motorcycle.intake.filling_time == pytest.approx(6.1e-3)
    assert again.motorcycle.engine.peak_speed == pytest.approx(1200.0)
    assert [e.name for e in again.motorcycle.effects] == ["backlash"]
    assert again.plus_minus["effects.backlash.slack"] == pytest.approx(4e-4)
    assert again.description == system.vehicle.description
