"""Indistinguishable effects form one class, and a plausible effect leads the class."""

import numpy as np
import pytest

from tests.identification.mismatch.laws.explained import explained, names, reported
from tests.identification.mismatch.laws.spring import PERIOD, noise_of_the_force, spring, swung

DELAYS = ("delay", "sensor_delay", "clock_offset", "clock_drift", "lag")
LATE = {"sensor_delay.place", "clock_offset.place", "delay.force"}


def late(bins):
    """Values of so many bins ago."""
    return lambda x: np.concatenate((np.full(bins, x[0]), x[:-bins]))


@pytest.mark.parametrize(("at", "bins"), [(a, b) for a in ("sensed", "felt") for b in (1, 2, 3)])
def test_a_delay_of_some_bins_is_found_and_its_class_listed(tmp_path, bins, at):
    """In a linear system a delayed input and a delayed sensor are indistinguishable."""
    rides = [swung(seed, **{at: late(bins)}) for seed in (1, 2)]
    found = explained(spring(tmp_path), rides[:1], rides[1:], DELAYS)
    assert set(names(found)) < LATE, reported(found)
    assert len(found.effects) == 1
    assert set(found.equivalents[0]) == LATE
    estimate = abs(found.effects[0].parameters[0].value)
    assert estimate == pytest.approx(bins * PERIOD, rel=0.1)


@pytest.mark.parametrize("bins", [2, 3])
def test_columns_of_one_table_have_one_clock(tmp_path, bins):
    rides = [swung(seed, sensed=late(bins)) for seed in (1, 2)]
    found = explained(spring(tmp_path), rides[:1], rides[1:], DELAYS)
    assert found.effects
    assert not found.effects[0].name.startswith("clock"), reported(found)


def test_held_inputs_are_no_delay(tmp_path):
    """A command is held from one sample to the next; drawn as a line it comes half a bin early."""
    found = explained(spring(tmp_path), [swung(1)], [swung(2)], DELAYS)
    assert not found.mismatch, reported(found)


def test_an_offset_of_a_sensor_and_of_a_force_are_one_class(tmp_path):
    rides = [swung(seed, lambda x, v, t: x + 0.05) for seed in (1, 2)]
    found = explained(spring(tmp_path), rides[:1], rides[1:], ("offset",))
    assert len(found.effects) == 1, reported(found)
    assert set(found.equivalents[0]) == {"offset.deflection", "offset.force", "offset.place"}


def test_an_offset_that_is_not_there_at_rest_is_none(tmp_path):
    """A force that is too large by its square shifts the mean; at rest the reading is zero."""

    def rested(seed):
        force = 0.4 + noise_of_the_force(seed, 8.0, 0.5)
        force[:200] = 0.0
        return swung(seed, force=force, felt=lambda u: u + 0.15 * u**2)

    library = ("offset", "quadratic.force", "cubic.force")
    found = explained(spring(tmp_path), [rested(1)], [rested(2)], library)
    assert names(found) == ["quadratic.force"], reported(found)
