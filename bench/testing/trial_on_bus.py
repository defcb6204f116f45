"""Gateway and trial on the bus of a test, recorded into a run folder as every trial is."""

from pathlib import Path

from slipbench.bench.bus.opening import BusAddress
from slipbench.bench.gateway.gateway import Gateway
from slipbench.bench.loop.clock import SECOND
from slipbench.bench.loop.loop import Lateness
from slipbench.bench.loop.recorder import Recorder, open_log, recorder_failure
from slipbench.bench.loop.ring import Ring
from slipbench.bench.loop.ticks import TICKS, read_ticks, tick_recorder, tick_table
from slipbench.bench.safety.trial import ENDED
from slipbench.bench.testing.bench_bus import BenchBus, SignalTimeoutError
from slipbench.bench.testing.conditions import seconds
from slipbench.bench.trials.outcome import Outcome
from slipbench.bench.trials.preparation import Prepared
from slipbench.bench.trials.run import begin_run, end_run
from slipbench.bench.trials.simulated_trial import BUS
from slipbench.bench.vehicle.virtual_motorcycle import wheels_of
from slipbench.protocol.codec.messages import Phase
from slipbench.protocol.recording.recording import Recording
from slipbench.protocol.recording.run_folder import FRAMES, read
from slipbench.protocol.trial_file import TrialFile


class TrialOnBus:
    """A trial whose gateway ticks on the bus of a test, from its begin on.

    The gateway is that of `slipbench trial`, with the same checks and the same record. In real time
    it ticks in the process of the test, without real-time priority: lateness is in the record.
    """

    def __init__(
        self, bus: BenchBus, prepared: Prepared, folder: Path, address: BusAddress | None
    ) -> None:
        """Join the bus and record into the new `folder`. Raises InputError where it exists."""
        self._bus, self._prepared, self.folder = bus, prepared, folder
        self._description = begin_run(prepared, folder, None if address is None else [address])
        if address is None:
            self._description["run"]["start_time_ns"] = bus.line.now_ns()
        self._ring = Ring.local()
        self._log, self._ticks = open_log(folder / FRAMES), open_log(folder / TICKS)
        name = BUS if address is None else address.name
        table = tick_table(prepared.trial)
        self._recorder = Recorder(self._ring, self._log, [name], self._ticks, table)
        self._note = tick_recorder(self._ring)
        node = bus.node("gateway", receive_own_messages=True)
        wheels = wheels_of(prepared.scenario.vehicle)
        self.gateway = Gateway(prepared.plan, node, prepared.binding, self._ring, wheels)
        self._period = round(prepared.trial.command.period * SECOND)
        self.ended = self._closed = False
        self._outcome: Outcome | None = None
        bus.schedule(self._period, self._tick, self._period)

    @property
    def file(self) -> TrialFile:
        """The trial file as read; quantities in SI."""
        return self._prepared.trial

    @property
    def phase(self) -> Phase:
        """Present phase of the trial."""
        return self.gateway.state.phase

    @property
    def trip(self) -> str:
        """Reason of the trip in words; empty where there is none."""
        trip = self.gateway.state.trip
        return trip.detail if trip else ""

    def _tick(self, number: int, due: int) -> bool:
        if self._closed:
            return False
        late = max(0, self._bus.line.now_ns() - due)
        goes_on = self.gateway.tick(number, due)
        self._note(number, due, late, self.gateway.refused)
        self._recorder.drain()
        self.ended = not goes_on
        return goes_on

    def wait_for(self, phase: Phase | str, within: float | str) -> float:
        """Time (s) at which the trial is in a phase, such as "exciting". Raises SignalTimeoutError otherwise."""
        __tracebackhide__ = True
        target = Phase[phase.upper().replace(" ", "_")] if isinstance(phase, str) else phase
        latest = self._bus.line.now_ns() + round(seconds(within) * SECOND)
        reached = self._bus.run_until_ns(
            latest, lambda: self.phase in ENDED or self.phase == target
        )
        if not reached or self.phase != target:
            raise SignalTimeoutError(
                f"the trial is {self.phase.name.lower()} at {self._bus.now:.3f} s, not "
                f"{target.name.lower()}" + (f": {self.trip}" if self.trip else "")
            )
        return self._bus.now

    def run(self, within: float | str = 600.0) -> Outcome:
        """Outcome of the trial, run to its end. Raises SignalTimeoutError where it has not ended within s."""
        __tracebackhide__ = True
        latest = self._bus.line.now_ns() + round(seconds(within) * SECOND)
        if not self._bus.run_until_ns(latest, lambda: self.ended):
            raise SignalTimeoutError(
                f"the trial has not ended within {seconds(within):g} s: it is"
                f" {self.phase.name.lower()}"
            )
        return self.close()

    def close(self) -> Outcome:
        """Outcome as it is now, written into the run folder; the gateway leaves the bus."""
        if self._outcome is not None:
            return self._outcome
        self._closed = True
        self._recorder.drain()
        self._log.close()
        self._ticks.close()
        notes = (*self.gateway.refusals, *recorder_failure(self._ring))
        outcome = Outcome(self.gateway.state, tuple(self.gateway.changes), self._lateness(), notes)
        self._outcome = end_run(self.folder, self._description, outcome, self.file)
        return self._outcome

    def _lateness(self) -> Lateness:
        return read_ticks(self.folder / TICKS, self._period)

    def read(self) -> Recording:
        """The recording of the trial, as `slipbench.read` gives it; the trial ends with it."""
        self.close()
        return read(self.folder)
