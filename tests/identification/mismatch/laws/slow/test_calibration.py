"""Effects that calibration compensates are still identified."""

import pytest

from slipbench.plant.effects.load_transfer import LoadTransfer
from slipbench.plant.effects.radius_growth import RadiusGrowth
from tests.identification.mismatch.laws.explained import holds, names, reported
from tests.identification.mismatch.laws.motorcycle import late, ridden

LATE = 7e-3  # s
GROWTH = 1e-5  # s^2/m^2
HEIGHT = 0.6


def test_a_late_throttle_sensor_is_no_slow_servo():
    """Calibration moves the servo to the ends of its ranges and leaves 1/80 of the trace.

    Dead times of servo and intake make up for most of it: fits from 4 to 8 ms end at 5.0 to 6.5 ms,
    within 2 nats of each other.
    """
    found = ridden(
        library=("channel_lag", "channel_latency", "driveline_loss", "optical_lag"),
        change=late("throttle_position", LATE),
    )
    assert names(found) == ["channel_latency.throttle_position"], reported(found)
    assert holds(found, "channel_latency", "latency", LATE, slack=0.15)


def test_tyres_that_grow_by_speed_are_no_other_radius_grip_and_drag():
    """Less than a hundredth of the trace remains; updated sensitivities follow the valley."""
    found = ridden(
        RadiusGrowth(growth=GROWTH, front_growth=0.5 * GROWTH),
        library=("radius_growth", "driveline_loss", "optical_scale", "relaxation_length"),
    )
    assert names(found) == ["radius_growth"], reported(found)
    assert holds(found, "radius_growth", "growth", GROWTH, slack=0.1)


def test_load_transfer_is_named_though_calibration_moves_the_load_by_several_deviations():
    """A region of worse fit lies between the calibrated parameters and the truth."""
    found = ridden(
        LoadTransfer(height=HEIGHT),
        library=("load_transfer", "relaxation_length", "driveline_loss"),
    )
    assert names(found) == ["load_transfer"], reported(found)
    by_output = {e.output: e for e in found.held_out}
    assert by_output["rear_teeth"].improved < 0.2 * by_output["rear_teeth"].calibrated


@pytest.mark.parametrize("share", [0.6, 2.0])
def test_numbers_of_up_to_four_stated_deviations_raise_no_alarm(share):
    """share: of the stated 95 % half width in the draw; 2: a standard deviation equal to it."""
    found = ridden(
        library=("load_transfer", "relaxation_length", "driveline_loss", "backlash"), share=share
    )
    assert not found.mismatch, reported(found)
    assert not found.effects


def test_without_its_name_a_late_throttle_sensor_is_no_other_effect():
    """A curve is also fitted from the nominal parameters, since calibration is far off."""
    found = ridden(
        library=("driveline_loss", "optical_lag", "rate_limit"),
        change=late("throttle_position", LATE),
    )
    assert found.unknown, reported(found)
    assert not found.effects
    assert found.location.block in ("throttle_servo", "channel", "throttle_position")
