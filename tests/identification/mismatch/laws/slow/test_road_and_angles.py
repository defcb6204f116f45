"""Effects with a place, a phase or a speed of their own: found wherever they sit, and not by chance."""

from dataclasses import replace

import pytest

from slipbench.plant.effects.compression_torque import CompressionTorque
from slipbench.plant.effects.eccentricity import Eccentricity
from slipbench.plant.effects.torque_dip import TorqueDip
from slipbench.plant.effects.wet_patch import WetPatch
from tests.identification.mismatch.laws.explained import effect, holds, names, reported
from tests.identification.mismatch.laws.motorcycle import LEARN, PROVE, ridden
from tests.identification.motorcycle_recording import Ride

ROAD = ("wet_patch", "grade", "driveline_loss")
TOOTH = ("eccentricity", "tooth_misplacement", "driveline_loss")
SWING, CYLINDERS = 60.0, 3
RUN_OUT = 5e-3
WINDY = 40.0  # N


def test_a_torque_that_turns_with_the_crank_is_named_though_no_channel_shows_its_phase():
    """Each recording begins at another crank angle, which the line itself tells."""
    found = ridden(
        CompressionTorque(swing=SWING, cylinders=CYLINDERS),
        library=("compression_torque", "backlash", "driveline_loss"),
    )
    assert names(found) == ["compression_torque"], reported(found)
    told = {p.name: p.value for p in effect(found, "compression_torque").parameters}
    assert told["cylinders"] == CYLINDERS
    assert holds(found, "compression_torque", "swing", SWING, slack=0.02)


@pytest.mark.parametrize("phase", [1.57, -2.4])
def test_a_run_out_is_named_at_any_phase(phase):
    """A score at one phase, or at that and its opposite, sees nothing a quarter turn away."""
    found = ridden(Eccentricity(run_out=RUN_OUT, phase=phase), library=TOOTH)
    assert [e.name for e in found.effects] == ["eccentricity"], reported(found)
    assert holds(found, "eccentricity", "run_out", RUN_OUT, slack=0.02)


def test_a_torque_dip_is_named_far_from_its_usual_speed():
    """The usual centre is 1410 rad/s; these rides reach 1050."""
    found = ridden(
        TorqueDip(depth=6.0, centre=1050.0),
        library=("torque_dip", "driveline_loss", "asymmetric_filling"),
    )
    assert names(found) == ["torque_dip"], reported(found)
    assert holds(found, "torque_dip", "centre", 1050.0, slack=0.01)


def windy(rides: tuple[Ride, ...]) -> tuple[Ride, ...]:
    return tuple(replace(r, wind=WINDY) for r in rides)


def test_wind_is_neither_a_grade_nor_a_wet_patch():
    """The magnitude at one place counts against its scatter over other places and trials."""
    found = ridden(library=ROAD, training=windy(LEARN), held_out=windy(PROVE))
    assert not found.mismatch, reported(found)
    assert not found.effects


def test_a_wet_patch_is_named_where_it_lies():
    found = ridden(WetPatch(loss=0.4, place=60.0), library=ROAD)
    assert names(found) == ["wet_patch"], reported(found)
    assert holds(found, "wet_patch", "place", 60.0, slack=0.05)
