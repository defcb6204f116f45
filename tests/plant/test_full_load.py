"""A vehicle file with a table of the torque has that torque, and keeps it when it is written."""

from dataclasses import replace

import numpy as np
import pytest

from slipbench.identification.mismatch.motorcycle.coordinates import coordinates
from slipbench.plant.effects.free_curve import KNOTS
from slipbench.plant.effects.full_load_table import full_load_table
from slipbench.plant.errors import VehicleFileError
from slipbench.plant.simulation import Simulation
from slipbench.plant.vehicle_file import HUMP, Vehicle, load_vehicle
from slipbench.plant.vehicle_writer import edited_vehicle, save_vehicle

RPM = np.pi / 30.0
SPEED = (4000, 5000, 6000, 7000, 8000, 9000, 10000, 11000, 12000, 13000)
TORQUE = (62.0, 71.0, 74.0, 88.0, 97.0, 101.0, 108.0, 111.0, 106.0, 95.0)
TABLE = f"""
[engine.full_load]
speed = {{ value = {list(SPEED)}, unit = "rpm" }}
torque = {{ value = {list(TORQUE)}, unit = "N*m" }}
"""


def vehicle(folder, text: str) -> Vehicle:
    path = folder / "mine.toml"
    path.write_text('name = "mine"\n' + text)
    return load_vehicle(path)


def full_load(mine: Vehicle, speed: float) -> float:
    """Torque [N m] at full throttle, without friction and with a full cylinder."""
    simulation = Simulation(mine.motorcycle)
    states = {**dict.fromkeys(simulation.layout.states, 0.0), "engine_speed": speed, "air": 1e3}
    x = np.array(list(states.values()))
    _, outputs = simulation.instant(x, simulation.row(2, 1.0))
    return float(outputs.engine_torque[0])


def test_the_simulation_has_the_torque_of_every_point(tmp_path) -> None:
    mine = vehicle(tmp_path, TABLE)
    found = [full_load(mine, rpm * RPM) for rpm in SPEED]
    np.testing.assert_allclose(found, TORQUE, rtol=1e-9)


def test_a_long_table_keeps_its_dip_within_a_percent() -> None:
    speed = np.linspace(300.0, 1400.0, 200)
    torque = 110.0 - 5e-5 * (speed - 1100.0) ** 2 - 9.0 * np.exp(-0.5 * ((speed - 700.0) / 50) ** 2)
    table = full_load_table(speed, torque)
    knots, values = ([getattr(table, f"{n}{i}") for i in range(KNOTS)] for n in "zf")
    assert np.all(np.diff(knots) > 0.0)
    np.testing.assert_allclose(np.interp(speed, knots, values), torque, rtol=0.01)


def test_what_is_saved_reads_back_the_same(tmp_path) -> None:
    mine = vehicle(tmp_path, TABLE)
    save_vehicle(mine, tmp_path / "copy.toml")
    assert load_vehicle(tmp_path / "copy.toml") == mine


def test_the_factor_on_the_torque_is_calibrated_and_the_table_stays_in_the_file(tmp_path) -> None:
    mine = vehicle(tmp_path, TABLE)
    keys = [k.key for k in coordinates(mine, (), ())]
    assert "engine.torque_scale" in keys
    assert not {f"engine.{name}" for name in HUMP} & set(keys)
    engine = replace(mine.motorcycle.engine, torque_scale=1.03)
    after = replace(mine, motorcycle=replace(mine.motorcycle, engine=engine))
    text = edited_vehicle((tmp_path / "mine.toml").read_text(), mine, after)
    (tmp_path / "improved.toml").write_text(text)
    assert str(list(SPEED)) in text
    assert load_vehicle(tmp_path / "improved.toml") == after


@pytest.mark.parametrize(
    ("table", "what"),
    [
        ("speed = { value = [1, 2, 3], unit = 's' }\ntorque = { value = [1, 2, 3], unit = 'N*m' }", "unit"),
        ("speed = { value = [1, 2], unit = 'rpm' }\ntorque = { value = [1, 2], unit = 'N*m' }", "table"),
        ("speed = { value = [1, 3, 2], unit = 'rpm' }\ntorque = { value = [1, 2, 3], unit = 'N*m' }", "table"),
        ("speed = { value = [1, 2, 3], unit = 'rpm' }\ntorque = { value = [1, 2], unit = 'N*m' }", "table"),
        ("speed = { value = [1, 2, 'x'], unit = 'rpm' }\ntorque = { value = [1, 2, 3], unit = 'N*m' }", "number"),
        ("speed = { value = [1, 2, 3], unit = 'rpm' }", "list of numbers"),
        ("speed = 3\ntorque = 4", "list of numbers"),
        ("[engine]\npeak_speed = { value = 9000, unit = 'rpm' }", "a hump and a table"),
        ("rpm = { value = [1, 2, 3], unit = 'rpm' }", "unknown key"),
    ],
)  # fmt: skip
def test_a_bad_table_is_an_error_that_names_it(tmp_path, table: str, what: str) -> None:
    with pytest.raises(VehicleFileError, match=what) as error:
        vehicle(tmp_path, f"[engine.full_load]\n{table}\n")
    assert "engine.full_load" in str(error.value)
