"""Levels, and how they differ from recording to recording, are evidence and no noise."""

import pytest

from tests.identification.mismatch.laws.explained import explained, names, reported
from tests.identification.mismatch.laws.spring import noise_of_the_force, spring, swung

BEND = 0.04  # 1/m^2, of the sensor
LEARNT, PROVEN = (0.0, 0.9, 1.8), (1.4,)  # V


def at_levels(levels, seed):
    """Rides about one level each: a sensor that reads too much by its square."""
    return [
        swung(
            seed + i,
            force=level + noise_of_the_force(seed + i, 5.0, 0.2),
            sensed=lambda x: x + BEND * x**3,
        )
        for i, level in enumerate(levels)
    ]


@pytest.fixture(scope="module")
def rides():
    return at_levels(LEARNT, 10), at_levels(PROVEN, 20)


def test_what_levels_alone_tell_is_named(tmp_path, rides):
    library = ("cubic.place", "friction", "dead_zone.force", "offset")
    found = explained(spring(tmp_path), *rides, library)
    assert names(found) == ["cubic.place"], reported(found)


def test_without_its_name_levels_raise_an_alarm_and_a_curve_stands_for_them(tmp_path, rides):
    found = explained(spring(tmp_path), *rides, ("friction", "dead_zone.force"))
    assert found.unknown, reported(found)
    assert not found.effects
    assert found.curve is not None
    assert found.curve.confirmed > 5.0, reported(found)  # nats
    (error,) = found.held_out
    assert error.improved < 0.9 * error.calibrated, reported(found)
