"""A trial rides through the device in C on the simulated clock, and the faults that concern it end well."""

from collections.abc import Callable
from contextlib import ExitStack, suppress
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from unittest import mock

import numpy as np
import pytest

from slipbench.bench.bus.faults import (
    Corrupted,
    Delayed,
    Disturbed,
    Duplicated,
    Fault,
    FaultPlan,
    Frozen,
    Lost,
    Where,
)
from slipbench.bench.loop.clock import SECOND
from slipbench.bench.trials.outcome import Outcome
from slipbench.bench.trials.run import run_trial
from slipbench.bench.trials.simulated_trial import START, simulated_trial
from slipbench.bench.vehicle.nodes import simulated_nodes
from slipbench.bench.vehicle.virtual_motorcycle import equilibrium_throttle
from slipbench.protocol.codec.messages import (
    ActuatorCommand,
    Authority,
    Phase,
    ThrottleStatus,
    TripReason,
)
from slipbench.protocol.recording.run_folder import read
from tests.bench.trials.test_whole_trial import messages, prepared
from tests.faults.ending import Ending, Killed
from tests.faults.run_case import AMPLITUDE, SHORT
from tests.hil.device import on_the_bus

AT = 0.6  # s in the trial, during the excitation
COMMAND_ID = 0x10
DEVICE, GATEWAY = frozenset({"throttle"}), frozenset({"gateway"})
TO_DEVICE, TO_BENCH = Where(AT, receivers=DEVICE), Where(AT, senders=DEVICE, receivers=GATEWAY)
WATCHDOG, CYCLE = 0.020, 0.001  # s


@dataclass(frozen=True)
class Ridden:
    """A trial with its recording; on the bus: (s, message)."""

    outcome: Outcome | None
    folder: Path

    @property
    def reason(self) -> TripReason:
        trip = self.outcome.state.trip if self.outcome else None
        return trip.reason if trip else TripReason.NONE

    def sent(self, kind: type) -> list[tuple[float, object]]:
        found = ((t - START / SECOND, m) for t, m in messages(self.folder))
        return [(t, m) for t, m in found if isinstance(m, kind)]


def ride(
    folder: Path, connect, *faults: Fault, nodes: tuple[Fault, ...] = (), clock=None
) -> Ridden:
    """Ride a short throttle sweep through the device that `connect` connects to the bus.

    faults: of the bus; nodes: of the simulated nodes
    """
    trial = prepared(**SHORT, ready_within="500 ms")
    scenario = replace(
        trial.scenario, nodes=simulated_nodes(without="throttle"), faults=FaultPlan(nodes, seed=1)
    )
    trial = replace(trial, scenario=scenario)
    simulated = partial(
        simulated_trial, faults=FaultPlan(faults, seed=1), devices={"throttle": connect}
    )
    outcome = None
    with ExitStack() as patches:
        patch = partial(mock.patch, "slipbench.bench.trials.run.simulated_trial", simulated)
        patches.enter_context(patch())
        if clock is not None:
            where = "slipbench.bench.trials.simulated_trial.SimulatedClock"
            patches.enter_context(mock.patch(where, clock))
        with suppress(Killed):
            outcome = run_trial(trial, folder, None)
    return Ridden(outcome, folder)


@dataclass(frozen=True)
class Case:
    """A fault that concerns the throttle body, and the trip that ends it.

    nodes   faults of the simulated nodes
    alive   whether the device runs at a time, s in the trial
    within  s, longest time from the fault to the last command with authority
    """

    name: str
    reason: TripReason
    faults: tuple[Fault, ...] = ()
    alive: Callable[[float], bool] = lambda _: True
    planted: str = ""
    nodes: tuple[Fault, ...] = ()
    within: float = 0.0215


CASES = (
    Case("commands lost", TripReason.AUTHORITY_LOST, (Lost(1.0, TO_DEVICE),)),
    Case("commands corrupt", TripReason.AUTHORITY_LOST, (Corrupted(1.0, TO_DEVICE),)),
    Case("commands stuck", TripReason.AUTHORITY_LOST, (Frozen(TO_DEVICE),)),
    Case("1 % of the commands lost", TripReason.NONE, (Lost(0.01, TO_DEVICE),)),
    Case("commands duplicated", TripReason.NONE, (Duplicated(1.0, TO_DEVICE),)),
    Case("commands late by 5 ms", TripReason.NONE, (Delayed(1.0, 0.005, where=TO_DEVICE),)),
    Case(
        "commands late by 30 ms", TripReason.AUTHORITY_LOST, (Delayed(1.0, 0.030, where=TO_DEVICE),)
    ),
    Case("statuses lost", TripReason.STALE, (Lost(1.0, TO_BENCH),)),
    Case("statuses corrupt", TripReason.FAULTY, (Corrupted(1.0, TO_BENCH),)),
    Case("statuses late by 30 ms", TripReason.STALE, (Delayed(1.0, 0.030, where=TO_BENCH),)),
    Case("bus-off", TripReason.STALE, (Disturbed(1.0, Where(AT, senders=DEVICE)),)),
    Case("the device dies", TripReason.STALE, alive=lambda now: now < AT),
    Case(
        "the device stands still for 50 ms",
        TripReason.STALE,
        alive=lambda now: not AT <= now < AT + 0.05,
    ),
    Case(
        "the device stands still for 5 ms",
        TripReason.NONE,
        alive=lambda now: not AT <= now < AT + 0.005,
    ),
    Case(
        "the device runs every 20 ms",
        TripReason.STALE,
        alive=lambda now: now < AT or round(now * 1e3) % 20 == 0,
    ),
    Case(
        "the rider's controls are silent for 200 ms",
        TripReason.STALE,
        nodes=(Lost(1.0, Where(AT, AT + 0.2, senders=frozenset({"rider"}))),),
    ),
    Case("the counter stands still", TripReason.TWO_SENDERS, planted="COUNTER_STUCK"),
    Case("the time stands still", TripReason.NEVER_READY, planted="TIME_STUCK"),
)


@pytest.fixture(scope="module")
def healthy(core, tmp_path_factory: pytest.TempPathFactory) -> Ridden:
    return ride(tmp_path_factory.mktemp("ride") / "run", on_the_bus(core("")))


def test_a_whole_sweep_rides_through_the_device(healthy: Ridden) -> None:
    assert healthy.outcome is not None
    assert healthy.outcome.done, healthy.outcome.trip
    assert healthy.outcome.notes == ()


def test_the_plate_follows_the_sweep_and_returns_to_the_grip(healthy: Ridden) -> None:
    commands = [(t, m.throttle) for t, m in healthy.sent(ActuatorCommand) if m.authority]
    positions = healthy.sent(ThrottleStatus)
    during = [m.position for t, m in positions if commands[0][0] < t < commands[-1][0]]
    swing = np.ptp([opening for _, opening in commands])
    assert 0.7 * swing < np.ptp(during) < 1.4 * swing
    before = [m.position for t, m in positions if commands[0][0] - 0.05 < t < commands[0][0]]
    assert positions[-1][1].position == pytest.approx(np.mean(before), abs=2e-3)


def test_the_engine_of_the_simulation_follows_the_plate(healthy: Ridden) -> None:
    channels = read(healthy.folder).channels
    speed, phase = channels["engine_speed"], channels["trial_phase"]
    start, *_, end = phase.time[phase.value == Phase.EXCITING]
    arrival = speed.time if speed.arrival is None else speed.arrival
    during = speed.value[(arrival > start) & (arrival < end)]
    assert np.ptp(during) > 5.0  # rad/s


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_a_fault_that_concerns_the_device_ends_as_it_must(case: Case, core, tmp_path) -> None:
    def alive(time_ns: int) -> bool:
        return case.alive((time_ns - START) / SECOND)

    device = on_the_bus(core(case.planted), alive)
    ridden = ride(tmp_path / "run", device, *case.faults, nodes=case.nodes)
    assert ridden.outcome is not None
    print(f"{case.name}: {ridden.outcome.trip or 'done'}")
    assert ridden.reason == case.reason
    assert ridden.outcome.done == (case.reason == TripReason.NONE)
    held = [(t, m.throttle) for t, m in ridden.sent(ActuatorCommand) if m.authority]
    assert bool(held) == (not case.planted), "a device that is broken from the start got authority"
    if held:
        assert max(abs(opening - grip()) for _, opening in held) <= AMPLITUDE + 1e-3
    if held and case.reason != TripReason.NONE:
        assert held[-1][0] - AT <= case.within


@cache
def grip() -> float:
    return equilibrium_throttle(prepared(**SHORT).scenario)


def test_20_ms_after_the_bench_was_killed_the_throttle_is_the_riders(core, tmp_path) -> None:
    """The record ends with the bench, so the device's own controller is watched."""
    device = core("")
    commands, released = [], []
    receive, step = device.receive, device.step

    def noted_receive(identifier: int, data: bytes, now_us: int) -> None:
        if identifier == COMMAND_ID:
            commands.append(now_us)
        receive(identifier, data, now_us)

    def noted_step(now_us: int) -> bytes | None:
        payload = step(now_us)
        if payload is not None and not payload[1] >> 4 & Authority.BOTH:
            released.append(now_us)
        return payload

    device.receive, device.step = noted_receive, noted_step
    killed = ride(tmp_path / "run", on_the_bus(device), clock=Ending)
    assert killed.outcome is None
    back = (min(time for time in released if time > commands[-1]) - commands[-1]) * 1e-6
    print(f"given back {1e3 * back:.1f} ms after the last command")
    assert WATCHDOG <= back <= WATCHDOG + CYCLE
