"""Test on the bench that silence gives the throttle back: request, stop requesting, measure the time.

With an authority signal the throttle is requested at its present opening and does not move. Without one
the request differs from it by a few percent, so that the echo or the position shows when the ECU stops
following. The engine must be off: where its speed is bound, it is measured, before and during the request.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from slipbench.bench.bus.opening import as_sequence
from slipbench.bench.loop.clock import MILLISECOND, SECOND, Clock
from slipbench.protocol.binding.binding import Binding
from slipbench.protocol.codec.assembly import Assembly
from slipbench.protocol.codec.codec import Codec, Frame, Sender
from slipbench.protocol.codec.faults import FrameFault
from slipbench.protocol.codec.messages import (
    ActuatorCommand,
    Authority,
    BenchMessage,
    EcuStatus,
    EngineStatus,
    ThrottleStatus,
)
from slipbench.protocol.codec.wire import FramePlan
from slipbench.protocol.errors import InputError

if TYPE_CHECKING:
    import can

LISTENING = 1.0  # s, before the request
REQUESTING = 0.5  # s
RELEASING = 0.05  # s, of a release: before the request, and where silence is not enough
LONGEST = 1.0  # s of silence after which the throttle counts as not given back
OFFSET = 0.03  # opening beside the present one, where no signal states the authority
STANDING = 5.0  # rad/s, engine speed below which the engine is off
FAR = 0.1  # opening beside the request at which it ends at once
AGE = 0.002  # s, of a status when its frame is stamped: it was made before it was sent
DEFAULT = 0.02  # s, hand back that a trial expects


@dataclass
class _Observed:
    """Last values from the motorcycle."""

    engine_speed: float | None = None
    position: float | None = None
    values: dict[str, tuple[float, float]] = field(default_factory=dict)  # value, and its stamp, s
    sent: float | None = None  # s, stamp of the last own request


@dataclass(frozen=True)
class SilenceResult:
    """Outcome of one proof.

    followed   signals that showed that the ECU followed the request
    hand_back  s from the last request to the first status in which none of them followed any more;
               None: longer than LONGEST
    still      s from the last request to the last status that still followed
    by         the signal that was the last
    expected   s, that the binding states, or that a trial expects
    gap        s, longest between two requests: this machine was late where it is near `expected`
    """

    followed: tuple[str, ...]
    hand_back: float | None
    by: str
    expected: float
    gap: float = 0.0
    still: float = 0.0

    @property
    def is_proven(self) -> bool:
        """Whether silence gave the throttle back in time: between two statuses that are near enough."""
        if self.hand_back is None or not self.followed:
            return False
        return self.still <= self.expected + AGE and not self.is_coarse

    @property
    def is_coarse(self) -> bool:
        """Whether the statuses are too rare to measure the time."""
        return self.hand_back is not None and self.hand_back - self.still > self.expected

    def __str__(self) -> str:
        """The outcome in one sentence."""
        if not self.followed:
            return (
                "the ECU did not follow the request: nothing is proven; check the request's roles"
            )
        if self.hand_back is None:
            return (
                f"silence does not give the throttle back: {', '.join(self.followed)} still follows"
                f" {LONGEST:g} s after the last request; switch the ignition off"
            )
        judged = "" if self.is_proven else f", later than the {self.expected * 1e3:g} ms stated"
        if self.is_coarse:
            judged = ": the statuses are too rare to prove more"
        return (
            f"silence gives the throttle back between {self.still * 1e3:.1f} and"
            f" {self.hand_back * 1e3:.1f} ms after the last request ({self.by}){judged}"
        )


class SilenceProof:
    """One proof on the buses of a binding."""

    def __init__(
        self, binding: Binding, bus: "can.BusABC | Sequence[can.BusABC]", clock: Clock
    ) -> None:
        """Prepare. bus: one, or as many as the binding has, in its order.

        Raises InputError where the binding has no request, or nothing that shows its effect.
        """
        self._binding, self._buses, self._clock = binding, as_sequence(bus), clock
        self._codec: Codec = binding.codec()
        self._sender = Sender(self._codec)
        self._assembly = Assembly(self._codec)
        self._observed = _Observed()
        self._ours = binding.sent
        self._signals = tuple(_signals(binding))
        self.longest_gap = 0.0  # s, between two requests
        if not binding.can_request:
            raise _refused(binding, "the binding has no request", "the role throttle_request")
        if not self._signals:
            raise _refused(
                binding,
                "nothing shows whether the ECU follows a request",
                "one of the roles authority, throttle_authority, throttle_command, throttle_position",
            )
        if "ThrottleStatus" not in binding.placement:
            raise _refused(
                binding, "the present throttle opening is not known", "the role throttle_position"
            )

    @property
    def offset(self) -> float:
        """Opening beside the present one that is requested."""
        return 0.0 if {"authority", "throttle authority"} & set(self._signals) else OFFSET

    def run(self) -> SilenceResult:
        """Listen, request, fall silent, measure. Raises InputError where it must not begin or go on.

        Whatever ends it, no request follows.
        """
        self._wait(LISTENING)
        before = self._present()
        request = min(before + self.offset, 1.0)
        last = self._request(request)
        following = [name for name in self._signals if self._follows(name, request, before)]
        if not following:
            return SilenceResult((), None, "", self._expected, self.longest_gap)
        spans = self._silence(following, request, before, last)
        late = max(spans, key=lambda name: spans[name][1] or LONGEST)
        still, hand_back = spans[late]
        if hand_back is None and self._codec.requests_authority:
            self._release()
        return SilenceResult(
            tuple(following), hand_back, late, self._expected, self.longest_gap, still
        )

    @property
    def _expected(self) -> float:
        stated = self._binding.degraded.hand_back
        return DEFAULT if stated is None else float(stated)

    def _present(self) -> float:
        position = self._observed.position
        if position is None:
            raise InputError(
                "no throttle position was received: nothing was requested",
                where=str(self._binding.path),
                expected=f"frames of it within {LISTENING:g} s",
                remedy="run slipbench check first, and correct what is not live",
            )
        self._require_engine_off()
        return position

    def _require_engine_off(self) -> None:
        speed = self._observed.engine_speed
        if speed is not None and abs(speed) > STANDING:
            raise InputError(
                "the engine runs: the request has ended"
                if self._sender.counters
                else "the engine runs",
                where=str(self._binding.path),
                expected="an engine that is off",
                found=f"{speed * 60 / 6.283185307:.0f} rpm",
                remedy="stop the engine, ignition on, and start again",
            )

    def _request(self, opening: float) -> float:
        """Request the opening each millisecond. Returns when the last request was sent, s."""
        if self._codec.requests_authority:
            self._release()  # a device that has fallen back grants again only after a release
        ends = self._now() + REQUESTING
        last = self._command(Authority.THROTTLE, opening) or self._now()
        while self._now() < ends:
            self._tick()
            self._require_engine_off()
            self._require_near(opening)
            sent = self._command(Authority.THROTTLE, opening)
            if sent is not None:
                self.longest_gap = max(self.longest_gap, sent - last)
                last = sent
        return last

    def _release(self) -> None:
        """Send frames without a request of authority."""
        ends = self._now() + RELEASING
        while self._now() < ends:
            self._command(Authority.NONE, 0.0)
            self._tick()

    def _command(self, authority: Authority, opening: float) -> float | None:
        """Send the frames of a command that are due. Returns when, s; None where none is due."""
        now = self._now()
        frames = self._sender.frames(ActuatorCommand(authority, opening, 0.0, now), now=now)
        for frame in frames:
            self._send(frame)
        return now if frames else None

    def _require_near(self, opening: float) -> None:
        position = self._observed.position
        if position is not None and abs(position - opening) > FAR:
            raise InputError(
                "the throttle moved away from the request: the request has ended",
                where=str(self._binding.path),
                expected=f"{opening:.1%}",
                found=f"{position:.1%}",
                remedy="check scale and unit of throttle_request and throttle_position",
            )

    def _silence(
        self, following: list[str], request: float, before: float, last: float
    ) -> Mapping[str, tuple[float, float | None]]:
        """Times from the last request to the last status that follows, and to the first that does not, s.

        The stamps of the frames count where the own ones come back with theirs. None: all follow.
        """
        spans: dict[str, tuple[float, float | None]] = dict.fromkeys(following, (0.0, None))
        while self._now() - last < LONGEST and any(end is None for _, end in spans.values()):
            self._tick()
            since = last if self._observed.sent is None else self._observed.sent
            for name in following:
                stamp = max(0.0, self._observed.values[name][1] - since)
                if spans[name][1] is None:
                    ended = not self._follows(name, request, before)
                    spans[name] = (spans[name][0], stamp) if ended else (stamp, None)
        return spans

    def _follows(self, name: str, request: float, before: float) -> bool:
        if name not in self._observed.values:
            return False
        value = self._observed.values[name][0]
        if name.endswith("authority"):
            return bool(int(value) & Authority.THROTTLE)
        return abs(value - request) < abs(value - before)

    def _wait(self, seconds: float) -> None:
        ends = self._now() + seconds
        while self._now() < ends:
            self._tick()

    def _tick(self) -> None:
        """Let a millisecond pass, and take in what arrived."""
        self._clock.sleep_until_ns(self._clock.now_ns() + MILLISECOND)
        for number, bus in enumerate(self._buses):
            while (frame := bus.recv(0)) is not None:
                if not (frame.is_error_frame or frame.is_remote_frame):
                    self._take(frame, number)

    def _take(self, frame: "can.Message", bus: int) -> None:
        """Process a frame. bus: its number."""
        plan = self._codec.plan(frame.arbitration_id, frame.is_extended_id, bus)
        if plan is None:
            return
        if plan.message.name in self._ours:
            if not frame.is_rx:
                self._observed.sent = frame.timestamp
                return
            raise InputError(
                f"another node sends {plan.message.name}, which the bench sends",
                where=str(self._binding.path),
                expected="no frame of it from another node",
                found=f"identifier {frame.arbitration_id:#x}",
                remedy="take the other node off the bus",
            )
        payload = plan.check(frame.data)
        found = payload if isinstance(payload, FrameFault) else self._joined(plan, payload)
        if isinstance(found, FrameFault):
            return
        for message in found:
            self._observe(message, frame.timestamp)

    def _joined(self, plan: FramePlan, payload: bytearray) -> "list[BenchMessage] | FrameFault":
        found = self._assembly.take(plan, payload, self._now())
        return found if isinstance(found, FrameFault) else [message for _, message, _ in found]

    def _observe(self, message: BenchMessage, stamp: float) -> None:
        """Process a message. stamp: s, of its frame; of the clock where own frames are not echoed."""
        observed = self._observed
        now = self._now() if observed.sent is None else stamp
        match message:
            case EngineStatus():
                observed.engine_speed = message.engine_speed
            case ThrottleStatus():
                observed.position = message.position
                observed.values["throttle authority"] = float(message.authority), now
                observed.values["position"] = message.position, now
            case EcuStatus():
                observed.values["authority"] = float(message.authority), now
                observed.values["echo"] = message.throttle_command, now

    def _send(self, frame: Frame) -> None:
        import can

        self._buses[frame.bus].send(
            can.Message(
                arbitration_id=frame.identifier,
                data=frame.data,
                is_extended_id=frame.extended,
                is_fd=len(frame.data) > 8,
            )
        )

    def _now(self) -> float:
        return self._clock.now_ns() / SECOND


def _signals(binding: Binding) -> Iterator[str]:
    """Signals of the motorcycle that show whether it follows a request."""
    degraded, placed = binding.degraded, binding.placement
    if "EcuStatus" in placed and degraded.hand_back is None:
        yield "authority"
    if "ThrottleStatus" in placed and degraded.throttle_body is None:
        yield "throttle authority"
    if degraded.hand_back is not None:
        if "EcuStatus" in placed and degraded.echo is None:
            yield "echo"
        elif "ThrottleStatus" in placed:
            yield "position"


def _refused(binding: Binding, what: str, expected: str) -> InputError:
    return InputError(
        f"{what}: silence cannot be proven",
        where=str(binding.path),
        expected=expected,
        remedy="bind it, then start again",
    )
