"""A measured torque curve, handed over as a table, leaves nothing to explain where a hump does."""

from dataclasses import replace

import numpy as np

from slipbench.identification.mismatch.analysis import begin
from slipbench.identification.mismatch.explain import analyse
from slipbench.identification.mismatch.motorcycle.system import MotorcycleSystem
from slipbench.identification.mismatch.reporting.conclude import verdict
from slipbench.identification.mismatch.reporting.verdict import Verdict
from slipbench.plant.effects.full_load_table import full_load_table
from slipbench.plant.vehicle_file import HUMP, Vehicle
from tests.identification.mismatch.conditions import erring, nominal
from tests.identification.motorcycle_recording import HELD_OUT, TRAINING, ride

RPM = np.pi / 30.0
SEED = 3
SPEED = np.arange(3000.0, 16001.0, 500.0) * RPM


def measured() -> np.ndarray:
    """The nominal hump with a dip at 12 500 rpm and a shoulder at 10 000, N m."""
    engine = nominal().motorcycle.engine
    hump = engine.peak_torque / (1.0 + ((SPEED - engine.peak_speed) / engine.torque_width) ** 2)
    dip = 9.0 * np.exp(-0.5 * ((SPEED / RPM - 12500.0) / 600.0) ** 2)
    return hump - dip + 5.0 * np.exp(-0.5 * ((SPEED / RPM - 10000.0) / 500.0) ** 2)


def with_table(vehicle: Vehicle) -> Vehicle:
    """The vehicle whose file has the table instead of the hump."""
    bike = replace(vehicle.motorcycle, effects=(full_load_table(SPEED, measured()),))
    exact = {f"engine.{name}": 0.0 for name in HUMP}
    return replace(vehicle, motorcycle=bike, plus_minus={**vehicle.plus_minus, **exact})


def found(vehicle: Vehicle) -> Verdict:
    """The verdict without a library on rides of a motorcycle with the measured torque."""
    print(f"seed {SEED}")
    true = replace(erring(SEED), effects=with_table(nominal()).motorcycle.effects)
    system = MotorcycleSystem(vehicle)
    records = [
        [system.prepare(ride(true, replace(t, seed=t.seed + 100 * SEED))) for t in trials]
        for trials in (TRAINING, HELD_OUT)
    ]
    return verdict(analyse(begin(system, *records), ()))


def test_a_hump_for_a_torque_with_a_dip_is_a_mismatch_at_the_engine() -> None:
    result = found(nominal())
    assert result.mismatch
    assert result.location is not None
    assert result.location.injection == "engine torque"
    assert "engine speed" in result.location.regressor


def test_with_the_table_nothing_is_missing() -> None:
    assert not found(with_table(nominal())).mismatch
