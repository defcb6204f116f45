"""A trial of the menu is simulated with all channels that a recording has."""

import pytest

from slipbench.identification.mismatch.motorcycle.menu import menu
from tests.identification.mismatch.conditions import erring, system
from tests.identification.motorcycle_recording import Ride, ride

RECORDED = Ride("sweep", 2, 1400.0, 0.03, 0.5, 9.0, seconds=4.0, seed=71)


@pytest.mark.parametrize("drop", [(), ("rear_teeth",), ("optical_speed", "front_teeth")])
def test_each_trial_of_the_menu_has_the_channels_of_the_recording(drop):
    like = system().prepare(ride(erring(7), Ride(**{**vars(RECORDED), "drop": drop})))
    choices = list(menu(len(system().vehicle.motorcycle.gears)))
    for choice in choices[:: len(choices) // 3]:
        record = system().rehearse(like, choice)
        assert record.measured.keys() == like.measured.keys()
        assert record.sensors.keys() == like.sensors.keys()
        assert all(value.shape == record.time.shape for value in record.measured.values())
