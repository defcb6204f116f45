"""Effects stated in a file are known: they are identified only with another magnitude."""

from dataclasses import replace

from slipbench.identification.mismatch.analysis import begin
from slipbench.identification.mismatch.fit.calibrate import calibrate
from slipbench.identification.mismatch.fit.refit import refit_with_updated_jacobian
from slipbench.identification.mismatch.motorcycle.system import MotorcycleSystem
from slipbench.identification.mismatch.reporting.memo import sentence
from slipbench.plant.effects.channel_lag import ChannelLag
from tests.identification.mismatch.conditions import erring, nominal
from tests.identification.mismatch.laws.explained import effect, explained, holds, names, reported
from tests.identification.mismatch.laws.motorcycle import lagging
from tests.identification.mismatch.laws.spring import MODEL, cubic, spring, swung
from tests.identification.motorcycle_recording import Ride, ride

CUBE = 0.15  # 1/m^2
LAG = 6e-3  # s
STATED = f"""
[[effects]]
name = "cubic"
at = "deflection"
values.cube = {{ value = {CUBE}, unit = "1/m^2" }}
"""
LEARN = (
    Ride("multisine", 3, 1050.0, 0.035, 0.6, 14.0, seconds=6.0, seed=31),
    Ride("square", 2, 1150.0, 0.06, 0.9, seconds=6.0, seed=32),
)
PROVE = (Ride("sweep", 2, 1250.0, 0.04, 0.5, 9.0, seconds=6.0, seed=33),)


def with_lag(effect: ChannelLag) -> MotorcycleSystem:
    vehicle = nominal()
    return MotorcycleSystem(
        replace(vehicle, motorcycle=replace(vehicle.motorcycle, effects=(effect,)))
    )


def test_a_stated_cube_is_not_found_again(tmp_path) -> None:
    found = explained(
        spring(tmp_path, MODEL + STATED), [swung(1, cubic(CUBE))], [swung(2, cubic(CUBE))]
    )
    assert not found.mismatch, reported(found)
    assert "cubic.deflection" not in found.not_excited


def test_a_stated_lag_of_a_sensor_is_not_found_again() -> None:
    """Its magnitude is significant, but stated in the file; nothing else is missing."""
    trail = lagging("throttle_position", LAG)
    records = ([trail(ride(erring(5), r)) for r in rides] for rides in (LEARN, PROVE))
    known = with_lag(ChannelLag("throttle_position", LAG))
    found = explained(known, *records, ("channel_lag", "channel_latency"))
    assert names(found) == [], reported(found)


def test_a_stated_cube_of_another_size_is_found_with_its_own(tmp_path) -> None:
    truth = 2.0 * CUBE
    found = explained(
        spring(tmp_path, MODEL + STATED), [swung(1, cubic(truth))], [swung(2, cubic(truth))]
    )
    assert names(found) == ["cubic.deflection"], reported(found)
    assert holds(found, "cubic", "cube", truth, slack=0.02)
    assert effect(found, "cubic").stated == CUBE
    assert "in the file 0.15" in sentence(found)
    assert "lacks" not in sentence(found)


def test_calibration_leaves_nothing_that_an_effect_could_take() -> None:
    """The gain of an unconverged base fit would be credited to any effect."""
    true = erring(7)
    system = MotorcycleSystem(nominal())
    training = begin(system, [system.prepare(ride(true, r)) for r in LEARN], []).training
    base = calibrate(training, training.origin())
    again = base
    for _ in range(4):
        again = refit_with_updated_jacobian(again, 0.0)
    print(f"{again.score - base.score:.2f} nats are left")
    assert again.score - base.score < 2.0
