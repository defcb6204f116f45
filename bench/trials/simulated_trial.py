"""A trial in lock step: gateway, bus and virtual motorcycle on one simulated clock.

The same loop, gateway and virtual motorcycle as on a real bus, faster than real time, and the same
frames to the last bit whenever the trial is the same.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from types import MappingProxyType

from slipbench.bench.bus.faults import NO_FAULTS, FaultPlan
from slipbench.bench.bus.simulated_bus import SimulatedBus, SimulatedNode
from slipbench.bench.gateway.fail_safe import described
from slipbench.bench.gateway.gateway import Gateway
from slipbench.bench.loop.clock import MILLISECOND, SECOND, SimulatedClock
from slipbench.bench.loop.loop import Tick, run_periodic
from slipbench.bench.loop.recorder import Recorder, open_log, recorder_failure
from slipbench.bench.loop.ring import Ring
from slipbench.bench.loop.ticks import TICKS, read_ticks, tick_recorder, tick_table
from slipbench.bench.trials.outcome import Outcome
from slipbench.bench.trials.preparation import Prepared
from slipbench.bench.vehicle.virtual_motorcycle import VirtualMotorcycle, wheels_of
from slipbench.protocol.binding.binding import Binding
from slipbench.protocol.codec.messages import Phase
from slipbench.protocol.recording.run_folder import FRAMES

BITRATE = 1_000_000  # bit/s
BUS = "can0"
START = SECOND  # ns; simulated recordings begin a second into the epoch, whatever the date
DEVICE_PHASE = 350_000  # ns after the gateway's tick at which the devices run

# A device that is not simulated by the virtual motorcycle: connected to its node of the bus, it
# returns the function that runs it up to a time in ns. It is called every millisecond.
Device = Callable[[SimulatedNode], Callable[[int], None]]


def simulated_names(binding: Binding) -> list[str]:
    """Names of the simulated buses in recordings, by their numbers."""
    return [name or BUS for name in binding.buses]


class SimulatedTrial:
    """A trial whose buses, gateway and virtual motorcycle are made; nothing has run yet."""

    def __init__(
        self,
        prepared: Prepared,
        wires: Sequence[SimulatedBus],
        ours: Sequence[SimulatedNode],
        theirs: Sequence[SimulatedNode],
        devices: Sequence[Callable[[int], None]] = (),
    ) -> None:
        """Connect gateway and virtual motorcycle to `wires`; devices: connected already.

        Raises InputError where the vehicle or the database does not suit the trial.
        """
        self._trial, self._wires, self._devices = prepared.trial, wires, devices
        self._names = simulated_names(prepared.binding)
        binding, wheels = prepared.binding, wheels_of(prepared.scenario.vehicle)
        self._ring = Ring.local()
        self._motorcycle = VirtualMotorcycle(prepared.scenario, theirs, binding.codec())
        self._gateway = Gateway(prepared.plan, ours, binding, self._ring, wheels)

    def run(
        self,
        folder: Path,
        progress: Callable[[float], None] = lambda _: None,
        on_phase: Callable[[Phase], None] = lambda _: None,
    ) -> Outcome:
        """Run the trial; record frames and ticks into `folder`.

        progress: receives the time in s; on_phase: receives each phase as it begins.
        """
        gateway, ring = self._gateway, self._ring
        period = round(self._trial.command.period * SECOND)
        with open_log(folder / FRAMES) as log, open_log(folder / TICKS) as ticks:
            recorder = Recorder(ring, log, self._names, ticks, tick_table(self._trial))
            world = _World(self._wires, self._motorcycle, self._devices, recorder, progress)
            clock = SimulatedClock(START, world.run_until)
            try:
                lateness = run_periodic(
                    _reporting(gateway, on_phase),
                    period,
                    clock,
                    observer=tick_recorder(ring),
                    refused=lambda: gateway.refused,
                )
            except Exception as fault:  # outside the gateway's tick: release, then end the trial
                gateway.fail(fault, clock.now_ns(), "between two ticks")
                gateway.tick(0, clock.now_ns())
                lateness = read_ticks(folder / TICKS, period)
            recorder.drain()
        notes = (*gateway.refusals, *world.notes, *recorder_failure(ring))
        return Outcome(gateway.state, tuple(gateway.changes), lateness, notes)


@contextmanager
def simulated_trial(
    prepared: Prepared,
    faults: FaultPlan = NO_FAULTS,
    devices: Mapping[str, Device] = MappingProxyType({}),
) -> Iterator[SimulatedTrial]:
    """Make everything that a trial on the simulated clock needs, before any file is written.

    faults   of each bus, from the trial's start; its nodes are "gateway", "motorcycle" and `devices`
    devices  by the name of their node; the scenario leaves these nodes to them. They are on the
             first bus of the binding

    Raises InputError where the vehicle or the database does not suit the trial.
    """
    wires = [SimulatedBus(BITRATE, faults=faults, start_ns=START) for _ in prepared.binding.buses]
    with ExitStack() as nodes:
        ours = [nodes.enter_context(wire.node("gateway", True)) for wire in wires]
        theirs = [nodes.enter_context(wire.node("motorcycle")) for wire in wires]
        connected = [
            connect(nodes.enter_context(wires[0].node(name))) for name, connect in devices.items()
        ]
        yield SimulatedTrial(prepared, wires, ours, theirs, connected)


def run_simulated(
    prepared: Prepared,
    folder: Path,
    progress: Callable[[float], None] = lambda _: None,
    faults: FaultPlan = NO_FAULTS,
) -> Outcome:
    """Outcome of a trial on the simulated clock; see `simulated_trial` for faults and errors."""
    with simulated_trial(prepared, faults) as trial:
        return trial.run(folder, progress)


def _reporting(gateway: Gateway, on_phase: Callable[[Phase], None]) -> Tick:
    """Tick of the gateway that also reports new phases."""
    reported = 0

    def tick(number: int, due: int) -> bool:
        nonlocal reported
        goes_on = gateway.tick(number, due)
        for change in gateway.changes[reported:]:
            on_phase(change.phase)
        reported = len(gateway.changes)
        return goes_on

    return tick


class _World:
    """Buses, virtual motorcycle and recorder between two ticks of the gateway."""

    def __init__(
        self,
        wires: Sequence[SimulatedBus],
        motorcycle: VirtualMotorcycle,
        devices: Sequence[Callable[[int], None]],
        recorder: Recorder,
        progress: Callable[[float], None],
    ) -> None:
        self._wires, self._motorcycle, self._recorder = wires, motorcycle, recorder
        self._devices = devices
        self._progress = progress
        self._number = 0
        self.notes: list[str] = []

    def run_until(self, time_ns: int) -> None:
        """Run devices every millisecond, and the buses, up to `time_ns`."""
        while (due := START + self._number * MILLISECOND + DEVICE_PHASE) <= time_ns:
            self._advance_to(due)
            for run_device in self._devices:
                run_device(due)
            self._step_motorcycle(due)
            self._number += 1
        self._advance_to(time_ns)
        self._recorder.drain()
        if self._number % 100 == 0:
            self._progress((time_ns - START) / SECOND)

    def _advance_to(self, time_ns: int) -> None:
        for wire in self._wires:
            wire.advance_to(time_ns)

    def _step_motorcycle(self, due: int) -> None:
        """Run one millisecond of the virtual motorcycle; after a failure it is silent, as a real one is."""
        if self.notes:
            return
        try:
            self._motorcycle.tick(self._number, due)
        except Exception as fault:
            self.notes.append(f"the virtual motorcycle failed: {described(fault)}")
