"""A vehicle whose bus vanishes ends with a word about it."""

import can
import pytest

from bench.buses import BusAddress
from bench.live_vehicle import ride_until
from protocol.errors import InputError
from tests.bench.test_whole_trial import prepared


class Vanishing(can.BusABC):
    """A bus that carries nothing, and is gone at the third look. It imitates no wire."""

    def __init__(self) -> None:
        self.looks = 0
        super().__init__(channel="vanishing")

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        return

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        self.looks += 1
        if self.looks > 2:
            raise can.CanOperationError("Network is down [Error Code 100]")
        return None, False


def test_a_bus_that_vanishes_is_told_with_its_name_and_what_to_do(monkeypatch):
    monkeypatch.setattr("bench.live_vehicle.open_bus", lambda *_, **__: Vanishing())
    the_trial = prepared()
    with pytest.raises(InputError, match="the CAN bus is gone: interface 'socketcan'") as told:
        ride_until(
            lambda: False, the_trial.ride, the_trial.database, BusAddress("socketcan", "vcan7")
        )
    assert "vcan7" in str(told.value)
    assert "Network is down" in str(told.value)
    assert "start again" in str(told.value)
