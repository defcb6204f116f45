"""A vehicle whose bus vanishes ends with a word about it."""

import errno

import can
import pytest

from slipbench.bench.bus.opening import BusAddress
from slipbench.bench.vehicle.live_vehicle import simulate_until
from slipbench.protocol.errors import InputError
from tests.bench.trials.test_whole_trial import prepared


class Vanishing(can.BusABC):
    """A bus that carries nothing, and is gone at the third call. It imitates no wire.

    As Linux does, it says so once: to who reads, or to who sends.
    """

    def __init__(self, told: str) -> None:
        self.calls, self.told = 0, told
        super().__init__(channel="vanishing")

    def _called(self, whom: str) -> None:
        self.calls += whom == self.told
        if whom == self.told and self.calls == 3:
            raise can.CanOperationError("Network is down", errno.ENETDOWN)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        self._called("sender")

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        self._called("reader")
        return None, False


@pytest.mark.parametrize("told", ["reader", "sender"])
def test_a_bus_that_vanishes_is_told_with_its_name_and_what_to_do(monkeypatch, told):
    monkeypatch.setattr("slipbench.bench.bus.opening.open_bus", lambda *_, **__: Vanishing(told))
    the_trial = prepared()
    looks = iter(range(100))
    with pytest.raises(InputError, match="the CAN bus failed: interface 'socketcan'") as gone:
        simulate_until(
            lambda: next(looks) == 99,
            the_trial.scenario,
            the_trial.binding,
            [BusAddress("socketcan", "vcan7")],
        )
    assert "vcan7" in str(gone.value)
    assert "Network is down" in str(gone.value)
    assert "start again" in str(gone.value)
