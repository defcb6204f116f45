"""Sensitivities of sensor readings are the limit of finite differences."""

from dataclasses import replace

import numpy as np
import pytest

from slipbench.identification.mismatch.fit import sensitivity
from slipbench.identification.mismatch.fit.sensitivity import none, sensitivities
from slipbench.identification.mismatch.motorcycle.coordinates import motorcycle_at
from slipbench.identification.mismatch.motorcycle.system import MotorcycleSystem
from slipbench.identification.mismatch.simulation import threads
from slipbench.identification.mismatch.simulation.model import Model, Point, Series, models
from slipbench.plant.effects.backlash import Backlash
from slipbench.plant.effects.channel_lag import ChannelLag
from slipbench.plant.effects.radius_growth import RadiusGrowth
from slipbench.plant.effects.relaxation_length import RelaxationLength
from slipbench.protocol.recording.recording import Recording
from tests.identification.mismatch.conditions import erring, nominal, system
from tests.identification.motorcycle_recording import Ride, ride

RIDES = (
    Ride("sweep", 2, 1400.0, 0.04, 0.5, 9.0, seconds=3.0, seed=41),
    Ride("square", 3, 1100.0, 0.05, 0.9, seconds=3.0, seed=42),
)
SEED = 43
EFFECTS = {
    "none": (),
    "simulated": (Backlash(), RadiusGrowth(), RelaxationLength()),
    "in a sensor": (ChannelLag(channel="engine_speed"), RadiusGrowth()),
}


def differences(model: Model, point: Point, monkeypatch, difference_step: float) -> Series:
    """Finite differences with a step in prior deviations."""
    monkeypatch.setattr(sensitivity, "DIFFERENCE_STEP", difference_step)
    monkeypatch.setattr(sensitivity, "SLOW_DIFFERENCE_STEP", difference_step)
    found = none(model.for_slopes, point)
    sensitivity._compare(model.for_slopes, point, found, ())
    return found


def departures(ours: Series, theirs: Series) -> np.ndarray:
    """Of every output and column: the deviation from differences, as a share of what there is."""
    found = []
    for block, other in zip(ours, theirs, strict=True):
        for a, b in zip(block, other, strict=True):
            size = np.sqrt(np.mean(b**2, axis=0))
            least = 1e-5 * size.max(axis=1, keepdims=True)
            found.append(np.sqrt(np.mean((a - b) ** 2, axis=0)) / (size + least + 1e-12))
    return np.concatenate([part.ravel() for part in found])


def without_throttle(recording: Recording) -> Recording:
    kept = {n: c for n, c in recording.channels.items() if n != "throttle_position"}
    return replace(recording, channels=kept)


def case(effects: tuple, throttle: bool = True) -> tuple[Model, Point]:
    """Two rides of an erring motorcycle, and a point away from the file's."""
    print(f"seed {SEED}")
    rng = np.random.default_rng(SEED)
    rides = [ride(replace(erring(7), effects=effects), each) for each in RIDES]
    if not throttle:
        rides = [without_throttle(each) for each in rides]
    (model,) = models(system(), [system().prepare(each) for each in rides])
    origin = model.origin()
    point = Point(
        0.3 * rng.standard_normal(len(origin.x)),
        tuple(0.3 * rng.standard_normal(len(q)) for q in origin.q),
        effects,
    )
    return model, point


@pytest.mark.parametrize("throttle", [True, False], ids=["throttle measured", "not measured"])
@pytest.mark.parametrize("effects", EFFECTS)
def test_sensitivities_are_what_smaller_and_smaller_differences_tend_to(
    effects: str, throttle: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    model, point = case(EFFECTS[effects], throttle)
    assert ("servo" in model.partition.subsystems) == throttle
    ours = sensitivities(model, point)
    coarse = departures(ours, differences(model, point, monkeypatch, 0.02))
    fine = departures(ours, differences(model, point, monkeypatch, 0.001))
    assert np.quantile(coarse, 0.9) < 0.03
    assert np.quantile(fine, 0.9) < 0.003
    assert np.mean(fine) < 0.5 * np.mean(coarse)


def test_a_number_at_the_end_of_its_range_has_no_slope() -> None:
    model, point = case(())
    i = [k.key for k in model.known].index("front_wheel.radius")
    x = point.x.copy()
    x[i] = 1e3  # far beyond the range, where it is clipped
    limit = motorcycle_at(nominal().motorcycle, [model.known[i]], x[i : i + 1])
    assert limit.front_wheel.radius == 0.45
    at_end = sensitivities(model, replace(point, x=x))
    assert all(not one[:, :, i].any() for block in at_end for one in block)


def test_the_number_of_threads_changes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    model, point = case(EFFECTS["simulated"])
    found = []
    for workers in (1, 2, 4):
        monkeypatch.setattr(threads, "WORKERS", workers)
        threads._pool.cache_clear()
        found.append(sensitivities(model, point))
    threads._pool.cache_clear()
    for other in found[1:]:
        for a, b in zip(found[0], other, strict=True):
            assert all(np.array_equal(x, y) for x, y in zip(a, b, strict=True))


def test_a_vehicle_is_differentiated_and_not_compared(monkeypatch: pytest.MonkeyPatch) -> None:
    def never(*_: object) -> None:
        raise AssertionError("finite differences of simulations")

    model, point = case(())
    assert isinstance(model.system, MotorcycleSystem)
    monkeypatch.setattr(sensitivity, "_compare", never)
    sensitivities(model, point)
