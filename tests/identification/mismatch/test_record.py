"""A prepared recording: rows hold single commands; no reading is a regressor of its own bin."""

from dataclasses import replace

import numpy as np
import pytest

from slipbench.identification.mismatch.motorcycle.record import prepare
from slipbench.identification.mismatch.motorcycle.regressors import servo_regressors
from slipbench.identification.mismatch.motorcycle.simulate import rolling, simulate
from slipbench.identification.mismatch.motorcycle.system import MotorcycleSystem
from slipbench.identification.mismatch.simulation.simulation_input import SimulationInput
from slipbench.plant.effects.radius_growth import RadiusGrowth
from slipbench.plant.effects.radius_with_lean import RadiusWithLean
from slipbench.plant.signals import Inputs
from slipbench.plant.vehicle_file import load_vehicle
from slipbench.protocol.recording.run_folder import VEHICLE, read
from slipbench.studies.blind_validation.generator.case import draw_case
from slipbench.studies.blind_validation.generator.recording import THROTTLE_STEP, write_run

SEED = 5


@pytest.fixture(scope="module")
def ready(tmp_path_factory):
    """Blips, whose commands are steps, with clock drift and delayed frames."""
    case = draw_case(SEED, 0)
    folder = tmp_path_factory.mktemp("runs") / "one"
    write_run(folder, case.truth, case.faults, case.training[1], dict(case.vehicle))
    vehicle = load_vehicle(folder / VEHICLE)
    return vehicle, prepare(read(folder), vehicle)


def test_no_row_holds_part_of_one_command_and_part_of_the_next(ready):
    _, record = ready
    steps = Inputs(record.inputs).throttle_command / THROTTLE_STEP
    assert np.mean(np.abs(steps - np.round(steps)) < 0.02) > 0.995
    assert np.ptp(steps) > 100


def test_a_reading_of_the_position_moves_no_regressor_of_its_own_bin_or_before(ready):
    vehicle, record = ready
    system = MotorcycleSystem(vehicle)
    chain = system.partition([record])
    out = simulate(vehicle.motorcycle, SimulationInput(record, chain, "servo", np.empty(0)))
    row = 6000
    position = record.measured["throttle_position"].copy()
    position[row] += 0.01
    other = replace(record, measured={**record.measured, "throttle_position": position})
    before, after = (servo_regressors(r, out, 4e-3) for r in (record, other))
    own = slice(0, row + record.grid.rows_per_bin)
    for name, series in before.items():
        assert np.array_equal(series[..., own], after[name][..., own]), name
    assert any(np.any(series != after[name]) for name, series in before.items())


@pytest.mark.parametrize("wheel", ["front", "rear"])
def test_a_simulation_is_led_in_at_the_speed_at_which_a_grown_and_leant_wheel_rolls(ready, wheel):
    vehicle, record = ready
    growth, lean = RadiusGrowth(growth=1.5e-5, front_growth=1e-5), RadiusWithLean(crown=0.1)
    inputs = Inputs(record.inputs.copy())
    inputs.lean[:] = np.linspace(-0.9, 0.9, len(inputs.lean))
    bike = replace(vehicle.motorcycle, effects=(growth, lean))
    nominal = getattr(bike, f"{wheel}_wheel").radius
    share = growth.growth if wheel == "rear" else growth.front_growth
    crown = lean.crown if wheel == "rear" else lean.front_crown
    speed = np.linspace(10.0, 80.0, len(inputs.lean))
    radius = nominal * (1.0 + share * speed**2) - crown * (1.0 - np.cos(inputs.lean))
    found = rolling(replace(record, inputs=inputs.table), bike, wheel, speed / radius)
    assert found == pytest.approx(speed, rel=3e-4)
    bare = rolling(record, vehicle.motorcycle, wheel, speed / radius)
    assert bare == pytest.approx(speed / radius * nominal)


def test_recorded_quantities_without_an_equation_are_told(tmp_path):
    case = draw_case(SEED, 0)
    write_run(tmp_path / "one", case.truth, case.faults, case.training[1], dict(case.vehicle))
    recording, vehicle = read(tmp_path / "one"), load_vehicle(tmp_path / "one" / VEHICLE)
    warm = replace(recording.channels["engine_speed"], unit="K")
    resting = replace(warm, value=np.full_like(warm.value, 300.0))
    more = {"intake_temperature": warm, "rear_tyre_temperature": warm, "oil_temperature": resting}
    channels = {**recording.channels, **more}
    record = prepare(replace(recording, channels=channels), vehicle)
    (told,) = (why for why in record.left_out if "no equation" in why)
    assert told == (
        "intake_temperature, rear_tyre_temperature: recorded, but no equation of a vehicle file has it"
    )
