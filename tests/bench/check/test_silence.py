"""Laws of `slipbench check --silence`, on the simulated bus with the virtual motorcycle."""

import can
import pytest

from slipbench.bench.check.silence import LISTENING, OFFSET, SilenceProof, SilenceResult
from slipbench.protocol.codec.codec import Codec
from slipbench.protocol.codec.messages import ActuatorCommand, Authority
from slipbench.protocol.errors import InputError
from tests.bench.check.harness import own, world

SPEAKS = own()  # the motorcycle sends everything; the binding under test may know less of it
HIDDEN = (
    "engine_speed",
    "gear",
    "spark_advance",
)  # the virtual engine runs: its speed is not bound


@pytest.mark.parametrize("silence", ["12 ms", "20 ms", "30 ms"])
@pytest.mark.parametrize("handshake", [True, False])
def test_the_time_until_the_throttle_is_given_back_is_measured(
    silence: str, handshake: bool
) -> None:
    hidden = () if handshake else ("authority", "throttle_authority", "authority_request")
    degraded = {} if handshake else {"hand_back": silence, "throttle_body": "follows_ecu"}
    with world(own(hidden, **degraded), silence) as made:
        proof = SilenceProof(own((*HIDDEN, *hidden), **degraded), made.ours, made.clock)
        assert proof.offset == (0.0 if handshake else OFFSET)
        result = proof.run()
    watchdog = float(silence.split()[0]) * 1e-3
    assert result.followed
    assert result.hand_back is not None
    assert watchdog - 0.002 <= result.still <= watchdog + 0.002
    assert watchdog <= result.hand_back <= watchdog + 0.006
    assert result.is_proven == (handshake is False or watchdog <= 0.02)


def test_a_device_that_has_fallen_back_before_is_released_first() -> None:
    with world(SPEAKS) as made:
        first = SilenceProof(own(HIDDEN), made.ours, made.clock).run()
        second = SilenceProof(own(HIDDEN), made.ours, made.clock).run()
    assert first.is_proven == second.is_proven
    assert first.followed == second.followed != ()


@pytest.mark.parametrize(
    ("still", "hand_back", "proven"),
    [
        (0.0195, 0.0205, True),
        (0.0235, 0.0245, False),  # later than stated
        (0.0, 0.019, True),
        (0.0, 0.05, False),  # the statuses are too rare
        (0.9, None, False),
    ],
)
def test_what_counts_as_proven(still: float, hand_back: float | None, proven: bool) -> None:
    result = SilenceResult(("authority",), hand_back, "authority", 0.02, 0.001, still)
    assert result.is_proven == proven
    assert str(result)
    assert not SilenceResult((), None, "", 0.02).is_proven


def test_an_ecu_without_a_watchdog_is_found_out() -> None:
    with world(SPEAKS) as made:
        made.motorcycle._silence = 1e9  # s: the watchdog never ends a grant
        result = SilenceProof(own(HIDDEN), made.ours, made.clock).run()
        made.frames(0.01)
        assert made.motorcycle._grant.authority == Authority.NONE  # by the release that follows
    assert result.followed
    assert result.hand_back is None
    assert not result.is_proven
    assert "does not give the throttle back" in str(result)


class Counting:
    """The bus, with the number of frames that were sent."""

    def __init__(self, bus: can.BusABC) -> None:
        self.bus, self.sent = bus, 0

    def recv(self, timeout: float) -> can.Message | None:
        return self.bus.recv(timeout)

    def send(self, message: can.Message) -> None:
        self.sent += 1
        self.bus.send(message)


def test_with_a_running_engine_no_request_is_sent() -> None:
    with world(SPEAKS) as made:
        bus = Counting(made.ours)
        with pytest.raises(InputError, match="engine runs"):
            SilenceProof(own(), bus, made.clock).run()
        assert bus.sent == 0
        assert made.clock.now_ns() * 1e-9 < 1.0 + LISTENING + 0.01


def test_an_engine_that_starts_ends_the_request_at_once() -> None:
    with world(SPEAKS) as made:
        bus = Counting(made.ours)
        proof = SilenceProof(own(), bus, made.clock)
        proof._require_engine_off, check = lambda: None, proof._require_engine_off
        request = proof._request

        def started(opening: float) -> float:
            proof._require_engine_off = check
            return request(opening)

        proof._request = started
        with pytest.raises(InputError, match="the request has ended"):
            proof.run()
        assert bus.sent <= 52  # 50 releases, and one request


def test_silence_is_the_same_number_of_requests_and_then_none() -> None:
    with world(SPEAKS) as made:
        bus = Counting(made.ours)
        SilenceProof(own(HIDDEN), bus, made.clock).run()
        assert bus.sent == pytest.approx(550, abs=3)  # released for 0.05 s, requested for 0.5 s
        before = bus.sent
        made.frames(0.1)
        assert bus.sent == before


@pytest.mark.parametrize(
    ("without", "degraded", "word"),
    [
        (("throttle_request", "authority_request", "spark_request"), {}, "no request"),
        (("throttle_position",), {}, "throttle opening"),
    ],
)
def test_what_cannot_be_proven_is_refused_before_the_bus_is_used(without, degraded, word) -> None:
    with world(SPEAKS) as made, pytest.raises(InputError, match=word):
        SilenceProof(own((*HIDDEN, *without), **degraded), made.ours, made.clock)


def test_a_second_node_with_the_request_ends_it() -> None:
    with world(SPEAKS) as made:
        other = made.bus.node("other")
        command = ActuatorCommand(Authority.NONE, 0.0, 0.0, 0.0)
        identifier, data = Codec(SPEAKS.database).encode(command)
        other.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))
        proof = SilenceProof(own(HIDDEN), made.ours, made.clock)
        with pytest.raises(InputError, match="another node sends ActuatorCommand"):
            proof.run()
        other.shutdown()
