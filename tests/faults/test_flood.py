"""Overload of the bus, or a backlog: the work of a tick is bounded, old frames are not used."""

from itertools import cycle

import can
import pytest

from slipbench import dbc
from slipbench.bench.gateway.gateway import BEHIND, MOST_FRAMES, Gateway
from slipbench.bench.loop.ring import Ring
from slipbench.bench.safety.trial import TrialState
from slipbench.bench.safety.vehicle_monitor import Wheels
from slipbench.protocol.binding.binding import own_binding
from slipbench.protocol.codec.codec import Codec, Sender
from slipbench.protocol.codec.messages import Authority, EcuStatus, Phase, TripReason
from slipbench.protocol.database.database import load_database
from tests.bench.conditions import OPENING, plan, vehicle_state

MILLISECOND = 1_000_000  # ns
DATABASE = load_database(dbc.MOTORBIKE)


class Flooded(can.BusABC):
    """A bus on which `waiting` frames wait at each look, and that takes every frame.

    It imitates no bit rate and no echo.
    """

    def __init__(self, frames: list[can.Message], waiting: float) -> None:
        self._frames, self.waiting, self.read = cycle(frames), waiting, 0
        super().__init__(channel="flooded")

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        return

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        if self.waiting <= 0:
            return None, False
        self.waiting, self.read = self.waiting - 1, self.read + 1
        return next(self._frames), False


def statuses() -> list[can.Message]:
    """One cycle of counters of a valid EcuStatus."""
    sender = Sender(Codec(DATABASE))
    made = [sender.encode(EcuStatus(Authority.NONE, OPENING, 0.0, n * 1e-3)) for n in range(15)]
    return [can.Message(arbitration_id=i, data=d, is_extended_id=False) for i, d in made]


def gateway(bus: can.BusABC, phase: Phase) -> Gateway:
    made = Gateway(plan(), bus, own_binding(DATABASE), Ring.local(), Wheels(0.32, 0.30, 16))
    made.state = TrialState(phase, since=1.0, throttle=OPENING, grip=OPENING)
    return made


@pytest.mark.parametrize("waiting", [MOST_FRAMES + 1, 10 * MOST_FRAMES, float("inf")])
def test_a_tick_takes_in_so_many_frames_and_no_more(waiting: float) -> None:
    with Flooded(statuses(), waiting) as bus:
        ours = gateway(bus, Phase.IDLE)
        assert ours.tick(0, 1000 * MILLISECOND)
        assert bus.read == MOST_FRAMES


@pytest.mark.parametrize("phase", [Phase.EXCITING, Phase.SETTLING, Phase.HANDING_BACK])
def test_with_authority_a_backlog_trips_and_says_so(phase: Phase) -> None:
    with Flooded(statuses(), float("inf")) as bus:
        ours = gateway(bus, phase)
        ours.tick(0, 1000 * MILLISECOND)
        assert ours.state.trip is not None
        assert (ours.state.trip.reason, ours.state.trip.detail) == (TripReason.TIMING, BEHIND)
        assert ours._last.authority == Authority.NONE


def test_nothing_stays_armed_on_what_was_said_in_the_past(monkeypatch: pytest.MonkeyPatch) -> None:
    """With the old frames all conditions would be met."""
    with Flooded(statuses(), MOST_FRAMES + 1) as bus:
        ours = gateway(bus, Phase.ARMED)
        monkeypatch.setattr(ours._monitor, "state", lambda *_, **__: vehicle_state())
        ours.tick(0, 1000 * MILLISECOND)
        assert ours.state.phase == Phase.IDLE
        assert ours.state.trip is None


def test_a_backlog_from_before_the_trial_does_not_look_like_two_vehicles() -> None:
    with Flooded(statuses(), 4000) as bus:
        ours = gateway(bus, Phase.IDLE)
        for number in range(20):
            ours.tick(number, (1000 + number) * MILLISECOND)
        assert bus.read == 4000
        assert ours.state.phase == Phase.IDLE
        assert ours.state.trip is None
