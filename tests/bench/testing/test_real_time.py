"""Laws of tests in real time: missed calls are skipped, lateness is stated, faults act on what is sent.

No test here judges how fast the machine is.
"""

from itertools import count
from pathlib import Path

import can
import pytest

from slipbench import dbc
from slipbench.bench.bus.faults import Corrupted, Delayed, Duplicated, Frozen, Lost, Where
from slipbench.bench.testing.bench_bus import BenchBus
from slipbench.bench.testing.faulty_node import FaultyNode
from slipbench.bench.testing.measurements import LATENESS, Measurement
from slipbench.bench.testing.plugin import OPTIONS
from slipbench.bench.testing.setup import Choice, Setup
from slipbench.bench.testing.summary import TestResult, requirement_verdicts
from slipbench.protocol.database.database import load_database
from slipbench.protocol.errors import InputError
from tests.bench.testing.conftest import Run

pytest_plugins = ["pytester"]

MILLISECOND = 1_000_000
REAL_TIME = {name: default for name, default, _ in OPTIONS} | {"slipbench-clock": "real-time"}


class SlowLine:
    """A line whose machine stops for 5 ms once, at 10 ms. It imitates the clock only."""

    real_time = True

    def __init__(self) -> None:
        self.time = 0

    def now_ns(self) -> int:
        return self.time

    def advance(self, time_ns, _listener, _each_frame, _done) -> None:
        before, self.time = self.time, max(self.time, time_ns)
        if before < 10 * MILLISECOND <= self.time:
            self.time += 5 * MILLISECOND


def test_calls_that_are_a_whole_period_late_are_skipped_and_the_lateness_is_kept() -> None:
    bus = BenchBus(SlowLine(), load_database(dbc.MOTORBIKE))  # type: ignore[arg-type]
    calls: list[tuple[int, int]] = []

    def tick(number: int, due: int) -> bool:
        calls.append((number, due))
        return True

    bus.every("1 ms", tick)
    bus.run("20 ms")
    assert [number for number, _ in calls] == [*range(10), *range(15, 20)]
    assert all(due == number * MILLISECOND for number, due in calls)
    assert bus.lateness == pytest.approx(0.005)


def test_time_that_making_the_parts_took_is_no_lateness() -> None:
    line = SlowLine()
    line.time = 20 * MILLISECOND
    bus = BenchBus(line, load_database(dbc.MOTORBIKE))  # type: ignore[arg-type]
    bus.every("1 ms", lambda _number, _due: True)
    line.time += 700 * MILLISECOND
    bus.run("20 ms")
    assert bus.lateness == 0.0


def test_a_test_that_was_late_leaves_its_requirements_in_doubt(run: Run) -> None:
    late = Measurement(LATENESS, 12.0, "ms", at_most=10.0)
    result = TestResult("test_a", "failed", "", [late], ["SAF-3"])
    assert requirement_verdicts([result])["SAF-3"][0] == "in doubt"
    text = """
        import pytest

        @pytest.mark.requirement("SAF-3")
        def test_late(bus, vehicle):
            bus.run("50 ms")
        """
    options = ("--slipbench-clock", "real-time", "--slipbench-interface", "virtual")
    result = run(text, *options, "--slipbench-lateness", "1e-9")
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(
        [f"*{LATENESS}: * ms, expected at most 1e-09 ms*", "SAF-3: in doubt*"]
    )
    run(text, *options, "--slipbench-lateness", "inf").assert_outcomes(passed=1)


@pytest.mark.parametrize("interface", ["virtual", "slipbench"])
def test_faults_act_on_a_live_bus(interface: str, tmp_path: Path) -> None:
    options = {"slipbench-interface": interface, "slipbench-channel": f"test-{interface}"}
    bench = Setup(Choice.of(REAL_TIME | options), tmp_path, "test")
    try:
        bench.stimulus.cyclic("RiderControls", grip="10 %").ramp("grip", "60 %", over="200 ms")
        bench.stimulus.when("RiderControls.grip > 30 %").freeze("RiderControls", "60 ms")
        reached = bench.stimulus.wait_for("RiderControls.grip >= 60 %", within="20 s")
        assert reached > 0.0
        faults = [fault for _, fault in bench.bus.faults("RiderControls", "20 s")]
        assert faults.count("repeated") >= 3
        assert bench.stimulus.never_occurred() == []
    finally:
        bench.close()


@pytest.mark.parametrize("interface", ["virtual", "slipbench"])
def test_a_fault_on_a_live_bus_begins_at_once(interface: str, tmp_path: Path) -> None:
    options = {"slipbench-interface": interface, "slipbench-channel": f"now-{interface}"}
    bench = Setup(Choice.of(REAL_TIME | options), tmp_path, "test")
    try:
        bench.stimulus.cyclic("RiderControls")
        bench.bus.run("1 s")
        bench.stimulus.drop("RiderControls", "3600 s")
        bench.bus.run("100 ms")  # for what was underway
        number = bench.bus.times("RiderControls").size
        bench.bus.run("500 ms")
        assert bench.bus.times("RiderControls").size == number > 10
    finally:
        bench.close()


def test_a_trial_runs_in_real_time_and_its_record_is_whole(tmp_path: Path) -> None:
    bench = Setup(Choice.of(REAL_TIME | {"slipbench-interface": "virtual"}), tmp_path, "test")
    try:
        bench.vehicle  # noqa: B018
        bench.trial.wait_for("armed", within="60 s")
        outcome = bench.trial.close()
        assert outcome.lateness.due > 500
        recording = bench.trial.read()
        assert recording.description["bus"]["interface"] == "virtual"
        assert recording.frame_count > 1000
    finally:
        bench.close()


def test_error_frames_are_refused_where_nobody_can_make_them(tmp_path: Path) -> None:
    bench = Setup(Choice.of(REAL_TIME | {"slipbench-interface": "virtual"}), tmp_path, "test")
    try:
        with pytest.raises(InputError, match="error frames cannot be made"):
            bench.stimulus.disturb("RiderControls", "1 s")
    finally:
        bench.close()


def test_a_fault_that_could_have_no_effect_is_refused(tmp_path: Path) -> None:
    bench = Setup(Choice.of(REAL_TIME | {"slipbench-interface": "virtual"}), tmp_path, "test")
    try:
        with can.Bus(interface="virtual", channel="pytest") as device:
            bench.bus.run("1 ms")  # the bus of the test is open before the device speaks
            device.send(can.Message(arbitration_id=0x20, data=bytes(8), is_extended_id=False))
            bench.bus.run("10 ms")
            with pytest.raises(InputError, match="frames of a real device cannot be changed"):
                bench.stimulus.drop("EcuStatus", "1 s")
        with pytest.raises(InputError, match="needs the simulated clock"):
            bench.stimulus.drop("RiderControls", "1 s", to="gateway")
        assert bench.bus.marks == []
    finally:
        bench.close()


# The node that changes what is sent


class Wire:
    """A bus that keeps what is sent; nothing is received."""

    channel_info = "wire"

    def __init__(self) -> None:
        self.sent: list[bytes] = []

    def send(self, message: can.Message, timeout: float | None = None) -> None:
        self.sent.append(bytes(message.data))


@pytest.mark.parametrize(
    ("fault", "sent", "later"),
    [
        (Lost(1.0, Where(1e-3, 3e-3)), [0, 3, 4], []),
        (Duplicated(1.0, Where(1e-3, 3e-3)), [0, 1, 1, 2, 2, 3, 4], []),
        (Frozen(Where(1e-3, 3e-3)), [0, 0, 0, 3, 4], []),
        (Delayed(1.0, 1e-2, 0.0, Where(1e-3, 3e-3)), [0, 3, 4], [1, 2]),
        (Lost(1.0, Where(identifiers=frozenset({0x99}))), [0, 1, 2, 3, 4], []),
        (Lost(1.0, Where(senders=frozenset({"another"}))), [0, 1, 2, 3, 4], []),
    ],
)
def test_own_frames_are_changed_before_they_are_sent(fault, sent: list, later: list) -> None:
    wire, now = Wire(), [0]
    node = FaultyNode(wire, "mine", lambda: now[0], count())  # type: ignore[arg-type]
    node.set_faults((fault,), 0, seed=1)
    for number in range(5):
        now[0] = number * MILLISECOND + 1
        node.send(can.Message(arbitration_id=0x10, data=[number], is_extended_id=False))
        node.send_delayed()
    assert [data[0] for data in wire.sent] == sent
    now[0] += 100 * MILLISECOND
    node.send_delayed()
    assert [data[0] for data in wire.sent[len(sent) :]] == later
    node.shutdown()


def test_a_corrupt_frame_differs_in_one_bit() -> None:
    wire = Wire()
    node = FaultyNode(wire, "mine", lambda: 0, count())  # type: ignore[arg-type]
    node.set_faults((Corrupted(1.0),), 0, seed=1)
    node.send(can.Message(arbitration_id=0x10, data=bytes(8), is_extended_id=False))
    assert int.from_bytes(wire.sent[0], "big").bit_count() == 1
    node.shutdown()
