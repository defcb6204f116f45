"""Next action of the rider, in one line, and the reason why the bench is not armed yet."""

from collections.abc import Iterator
from pathlib import Path

from slipbench.bench.gateway.receiver import Receiver
from slipbench.bench.loop.clock import SECOND
from slipbench.bench.safety.trial import not_ready
from slipbench.bench.safety.vehicle_monitor import VehicleMonitor
from slipbench.bench.trials.preparation import Prepared
from slipbench.bench.vehicle.virtual_motorcycle import wheels_of
from slipbench.protocol.codec.faults import FrameFault
from slipbench.protocol.codec.messages import Phase
from slipbench.protocol.logs.candump_line import LINE
from slipbench.protocol.recording.run_folder import FRAMES
from slipbench.protocol.trial_file import RPM, TrialFile

WAITING = frozenset({Phase.IDLE, Phase.ARMED})
AT_ONCE = 4_000_000  # bytes of the log that are read at once
PHASES = {
    Phase.ARMED: "armed: press the button and hold it",
    Phase.EXCITING: "exciting: hold button and grip",
    Phase.SETTLING: "settling: hold button and grip",
    Phase.HANDING_BACK: "handing back: the throttle returns to the grip",
    Phase.DONE: "done: release the button",
    Phase.TRIPPED: "tripped: the throttle is yours",
}


def instruction(trial: TrialFile) -> str:
    """Operating point that the rider has to hold, and what follows."""
    point = trial.operating_point
    low = (point.engine_speed - point.engine_speed_window) / RPM
    high = (point.engine_speed + point.engine_speed_window) / RPM
    return (
        f"gear {point.gear}, {low:.0f} to {high:.0f} rpm for {point.steady_for}; then press the"
        f" button and hold it for {_held(trial):.0f} s"
    )


def _held(trial: TrialFile) -> float:
    """Time for which the bench has authority, s."""
    return trial.excitation.duration + trial.settling + trial.hand_back


class ArmingWatch:
    """Reason why a trial is not armed, from its own condition on the frames recorded so far.

    It reads frames.log while the recorder writes it: neither loop nor bus know of it. It applies
    `not_ready` of the trial's state machine to the state that the gateway's receiver and monitor
    give for these frames; what is sent never depends on it.
    """

    def __init__(self, prepared: Prepared, folder: Path, buses: tuple[str, ...]) -> None:
        """Begin before the first frame. buses: names in the log, by their numbers."""
        trial, wheels = prepared.trial, wheels_of(prepared.scenario.vehicle)
        self._plan, self._path, self._buses = prepared.plan, folder / FRAMES, buses
        self._receiver = Receiver(
            prepared.binding,
            prepared.binding.codec(),
            wheels,
            trial.limits.stale,
            trial.operating_point.gear,
        )
        self._monitor = VehicleMonitor(wheels)
        self._done, self._now, self._torn = 0, 0.0, b""

    def reason(self) -> str:
        """Why the bench is not armed, by the last frame that was recorded; "" where it could be."""
        if not self._path.exists():
            return "the recording has not begun"
        for line in self._new_lines():
            self._observe(line)
        for name, status, time in self._receiver.assumed(self._now):
            self._monitor.observe(name, status, time)
        return not_ready(self._monitor.state(self._now), self._plan)

    def _new_lines(self) -> Iterator[bytes]:
        with self._path.open("rb") as file:
            file.seek(self._done)
            while text := file.read(AT_ONCE):
                self._done += len(text)
                *lines, self._torn = (self._torn + text).split(b"\n")
                yield from lines

    def _observe(self, line: bytes) -> None:
        found = LINE.fullmatch(line)
        if found is None:
            return
        nanoseconds = int(found["fraction"].ljust(9, b"0"))
        self._now = max(self._now, int(found["seconds"]) + nanoseconds / SECOND)
        data = found["classic"] if found["classic"] is not None else found["fd"]
        bus = found["bus"].decode("ascii", "replace")
        if found["direction"] in (b"T", b"t") or data is None or bus not in self._buses:
            return
        key = int(found["identifier"], 16), len(found["identifier"]) == 8
        number = self._buses.index(bus)
        frame = bytes.fromhex(data.decode("ascii"))
        for name, content, time in self._receiver.receive(key, frame, self._now, self._now, number):
            if isinstance(content, FrameFault):
                self._monitor.fault(name)
            else:
                self._monitor.observe(name, content, time)
