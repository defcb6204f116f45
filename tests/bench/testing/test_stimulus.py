"""Laws of stimulus: faults begin on signals, messages are protected, and nothing stays silent."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from slipbench.bench.bus.faults import FaultPlan, Lost, Where
from slipbench.bench.testing.bench_bus import SignalTimeoutError
from slipbench.bench.testing.plugin import OPTIONS
from slipbench.bench.testing.setup import Choice, Setup
from slipbench.protocol.errors import InputError
from tests.bench.testing.conftest import Run

pytest_plugins = ["pytester"]

OPTIONS_OF = {name: default for name, default, _ in OPTIONS}
CYCLE = 0.005  # s, of EngineStatus


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Setup]:
    """A bench on the simulated clock."""
    made = Setup(Choice.of(OPTIONS_OF), tmp_path, "test")
    yield made
    made.close()


def gaps(times: np.ndarray) -> np.ndarray:
    return np.diff(times)


def test_a_message_is_dropped_from_the_frame_on_which_the_condition_holds(bench: Setup) -> None:
    bench.vehicle  # noqa: B018
    limit = "EngineStatus.engine_speed > 13000 rpm"
    bench.stimulus.when(limit).drop("EngineStatus", "30 ms")
    bench.bus.run("100 ms")
    times = bench.bus.times("EngineStatus")
    # the first frame fires; those within 30 ms after it are lost, then every cycle again
    assert times[1] - times[0] == pytest.approx(0.035, abs=3e-4)
    assert gaps(times[1:]) == pytest.approx(CYCLE, abs=3e-4)
    assert [fault for _, fault in bench.bus.faults("EngineStatus")] == ["lost"]
    assert gaps(bench.bus.times("EcuStatus")).max() < 2e-3


def test_what_is_injected_is_marked_for_the_plots_with_its_times(bench: Setup) -> None:
    bench.bus.run("100 ms")
    bench.stimulus.drop("RiderControls", "30 ms")
    bench.stimulus.after("20 ms").freeze("EcuStatus", "10 ms")
    bench.bus.run("50 ms")
    lost, frozen = bench.bus.marks
    assert lost == (pytest.approx(0.1), pytest.approx(0.13), "RiderControls lost")
    assert frozen == (pytest.approx(0.12), pytest.approx(0.13), "EcuStatus frozen")


def test_a_drop_may_concern_one_receiver_only(bench: Setup) -> None:
    other = bench.bus.node("other")
    bench.stimulus.drop("RiderControls", "50 ms", to="other")
    bench.stimulus.cyclic("RiderControls", grip="10 %")
    bench.bus.run("100 ms")
    heard = [frame.timestamp - 1.0 for frame in iter(lambda: other.recv(0), None)]
    assert min(heard) > 0.05
    assert bench.bus.times("RiderControls").size > len(heard) + 8


@pytest.mark.parametrize(
    ("act", "seen"),
    [
        (lambda actions: actions.corrupt("RiderControls", "1 s"), "wrong CRC"),
        (lambda actions: actions.freeze("RiderControls", "1 s"), "repeated"),
        (lambda actions: actions.duplicate("RiderControls", "1 s"), "repeated"),
        (lambda actions: actions.drop("RiderControls", "1 s", chance=0.5), "lost"),
        (lambda actions: actions.delay("RiderControls", "1 s", "1 ms", "20 ms"), "lost"),
    ],
    ids=["corrupt", "freeze", "duplicate", "drop", "delay"],
)
def test_each_fault_is_that_of_the_bus(bench: Setup, act, seen: str) -> None:
    bench.stimulus.cyclic("RiderControls", grip="10 %")
    bench.bus.node("receiver")
    act(bench.stimulus.after("100 ms"))
    bench.bus.run("99 ms")
    assert bench.bus.faults("RiderControls") == []
    bench.bus.run("400 ms")
    faults = bench.bus.faults("RiderControls")
    assert seen in {fault for _, fault in faults}
    assert min(time for time, _ in faults) > 0.1


def test_a_disturbed_message_is_an_error_on_the_wire_until_the_end(bench: Setup) -> None:
    command = bench.stimulus.cyclic("RiderControls")
    bench.bus.node("receiver")
    bench.bus.run("20 ms")
    bench.stimulus.disturb("RiderControls", "2 ms")
    bench.bus.run("50 ms")
    assert bench.bus.traffic.errors > 0
    assert bench.bus.faults("RiderControls") == []  # the controller repeats
    assert command.refused == 0


def test_a_fault_plan_counts_from_now(bench: Setup) -> None:
    bench.stimulus.cyclic("RiderControls")
    bench.bus.run("100 ms")
    bench.stimulus.inject_plan(FaultPlan((Lost(1.0, Where(begin=0.05, end=0.1)),), seed=3))
    bench.bus.run("200 ms")
    times = bench.bus.times("RiderControls")
    gap = int(np.argmax(gaps(times)))
    assert (times[gap], times[gap + 1]) == pytest.approx((0.145, 0.2), abs=6e-3)


def test_a_cyclic_message_has_counter_crc_clock_and_the_values_that_are_given(bench: Setup) -> None:
    bench.stimulus.cyclic("ActuatorCommand", authority=1, throttle="12.5 %", spark="-0.1 rad")
    bench.bus.run("1 s")
    assert bench.bus.faults("ActuatorCommand") == []
    assert gaps(bench.bus.times("ActuatorCommand")) == pytest.approx(1e-3, abs=1e-5)
    assert bench.bus.value("ActuatorCommand.throttle") == pytest.approx(12.5)
    assert bench.bus.value("ActuatorCommand.spark", "rad") == pytest.approx(-0.1, abs=2e-4)
    times, clock = bench.bus.trace("ActuatorCommand.time", unit="s")
    assert clock == pytest.approx(times, abs=3e-4)


def test_a_ramp_is_linear_and_ends_at_its_target(bench: Setup) -> None:
    rider = bench.stimulus.cyclic("RiderControls", grip="10 %")
    bench.bus.run("100 ms")
    rider.ramp("grip", "30 %", over="200 ms")
    bench.bus.run("300 ms")
    times, grip = bench.bus.trace("RiderControls.grip")
    expected = np.interp(times, [0.1, 0.3], [10.0, 30.0])
    assert grip == pytest.approx(expected, abs=0.15)  # raw step 0.1 %, frame 0.1 ms after its value


def test_a_pause_and_a_stop_are_silence_and_the_counter_goes_on(bench: Setup) -> None:
    rider = bench.stimulus.cyclic("RiderControls")
    bench.bus.run("50 ms")
    rider.pause("40 ms")
    bench.bus.run("100 ms")
    assert gaps(bench.bus.times("RiderControls")).max() == pytest.approx(0.045, abs=5.1e-3)
    rider.stop()
    number = bench.bus.times("RiderControls").size
    bench.bus.run("100 ms")
    assert bench.bus.times("RiderControls").size == number
    rider.start()
    rider.stop()
    rider.start()
    bench.bus.run("20 ms")
    assert bench.bus.times("RiderControls").size == number + 4
    assert bench.bus.faults("RiderControls") == []


def test_a_wait_ends_at_the_frame(bench: Setup) -> None:
    bench.stimulus.cyclic("RiderControls", grip=10).ramp("grip", 30, over="200 ms")
    found = bench.stimulus.wait_for("RiderControls.grip >= 20 %", within="1 s")
    assert bench.bus.now == pytest.approx(found, abs=1e-6)
    assert bench.bus.times("RiderControls")[-1] == found
    assert found == pytest.approx(0.1, abs=6e-3)


def test_a_wait_that_is_not_met_says_what_the_signal_did(bench: Setup) -> None:
    bench.stimulus.cyclic("RiderControls", grip=12.5)
    with pytest.raises(SignalTimeoutError, match=r"21 frames, values 12.5 to 12.5 %, last 12.5 %"):
        bench.stimulus.wait_for("RiderControls.grip > 20 %", within="101 ms")
    with pytest.raises(SignalTimeoutError, match="no frame of EcuStatus arrived"):
        bench.stimulus.wait_for("EcuStatus.authority == 1", within="10 ms")


def test_a_value_with_a_wrong_crc_is_no_value(bench: Setup) -> None:
    """A receiver rejects such a frame: it must not end a wait or fire a trigger."""
    rider = bench.stimulus.cyclic("RiderControls", grip=10)
    bench.bus.run("50 ms")
    bench.stimulus.corrupt("RiderControls", "100 ms")
    fired: list[float] = []
    bench.stimulus.when("RiderControls.grip != 10 %", optional=True).call(lambda: fired.append(1))
    bench.bus.run("99 ms")
    assert fired == []
    assert bench.bus.value("RiderControls.grip") == 10
    bench.stimulus.corrupt("RiderControls", float("inf"))
    rider.set(grip=30)
    with pytest.raises(SignalTimeoutError, match="none of 20 frames of RiderControls held a valid"):
        bench.stimulus.wait_for("RiderControls.grip == 30 %", within="100 ms")


def test_a_trigger_acts_once_or_every_time(bench: Setup) -> None:
    fired: list[str] = []
    above = "RiderControls.grip > 50 %"
    bench.stimulus.when(above).call(lambda: fired.append("once"))
    bench.stimulus.when(above, every_time=True).call(lambda: fired.append("every"))
    rider = bench.stimulus.cyclic("RiderControls")
    for grip in (0, 60, 70, 0, 80):
        rider.set(grip=grip)
        bench.bus.run("20 ms")
    assert fired == ["once", "every", "every"]


def test_a_trigger_that_never_fired_fails_the_test(run: Run) -> None:
    result = run(
        """
        def test_silent(stimulus, bus):
            stimulus.when("RiderControls.grip > 50 %").drop("RiderControls", "20 ms")
            stimulus.cyclic("RiderControls", grip=20)
            bus.run("50 ms")

        def test_later(stimulus, bus):
            stimulus.after("100 ms").drop("RiderControls", "20 ms")
            bus.run("50 ms")

        def test_in_time(stimulus, bus):
            stimulus.after("40 ms").drop("RiderControls", "20 ms")
            bus.run("50 ms")

        def test_optional(stimulus, bus):
            stimulus.when("RiderControls.grip > 50 %", optional=True).drop("RiderControls", "20 ms")
            bus.run("50 ms")
        """
    )
    result.assert_outcomes(failed=2, passed=2)
    result.stdout.fnmatch_lines(
        [
            "RiderControls.grip > 50 % never occurred*last value 20 %",
            "after 0.1 s from 0.0000 s: the test ended before*",
        ]
    )


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (lambda s: s.when("EngineStatus.engine_speed > 9000 km/h"), "does not convert"),
        (lambda s: s.when("engine speed above 9000"), "is not a condition"),
        (lambda s: s.when("EngineStatus.engine_speeds > 1"), "did you mean engine_speed"),
        (lambda s: s.drop("EngineStat", "1 s"), "did you mean EngineStatus"),
        (lambda s: s.drop("EngineStatus", "30 rpm"), "is not a quantity"),
        (lambda s: s.wait(-1.0), "no duration"),
        (lambda s: s.wait(float("nan")), "no duration"),
        (lambda s: s.wait(float("inf")), "no duration"),
        (lambda s: s.after("-1 ms"), "no duration"),
        (lambda s: s.drop("EngineStatus", "1 s", to="gatway"), "node 'gatway', which is not"),
        (lambda s: s.cyclic("RiderControls", grip="120 %"), "cannot carry '120 %'"),
        (lambda s: s.cyclic("RiderControls", crc=3), "is computed from the other signals"),
        (lambda s: s.cyclic("RiderControls", grib=3), "did you mean grip"),
        (lambda s: s.cyclic("RiderControls", period=0), "cycle time of RiderControls is not known"),
    ],
)
def test_wrong_input_is_named(bench: Setup, wrong, said: str) -> None:
    with pytest.raises(InputError, match=said):
        wrong(bench.stimulus)


def test_a_message_that_another_node_sends_is_not_sent_as_well(bench: Setup) -> None:
    bench.vehicle  # noqa: B018
    bench.bus.run("20 ms")
    with pytest.raises(InputError, match="another node sends RiderControls"):
        bench.stimulus.cyclic("RiderControls")


def test_the_frames_are_the_same_in_every_run(tmp_path: Path) -> None:
    def frames() -> list[tuple]:
        bench = Setup(Choice.of(OPTIONS_OF), tmp_path, "test")
        bench.vehicle  # noqa: B018
        bench.stimulus.cyclic("ActuatorCommand", authority=1, throttle=9)
        bench.stimulus.when("EcuStatus.authority == 1").drop("ActuatorCommand", "1 s", chance=0.1)
        bench.bus.run("300 ms")
        bench.close()
        return bench.bus.traffic.frames

    first = frames()
    assert len(first) > 1000
    assert first == frames()


def test_another_database_serves_as_well(tmp_path: Path) -> None:
    """Big-endian signals, a value table and a 29-bit identifier, none of which the bench has."""
    path = tmp_path / "other.dbc"
    path.write_text(
        'VERSION ""\n\nNS_ :\n\nBS_:\n\nBU_: ECM\n\n'
        "BO_ 2566844926 Engine: 8 ECM\n"
        ' SG_ speed : 7|16@0+ (0.25,0) [0|16383] "rpm" ECM\n'
        ' SG_ load : 21|10@0- (0.5,10) [-246|265] "%" ECM\n'
        ' SG_ mode : 32|3@1+ (1,0) [0|7] "" ECM\n\n'
        'VAL_ 2566844926 mode 0 "off" 3 "limp home" ;\n'
    )
    options = {**OPTIONS_OF, "slipbench-database": str(path)}
    bench = Setup(Choice.of(options), tmp_path, "test")
    bench.stimulus.when("Engine.mode == limp home").drop("Engine", "1 s")
    engine = bench.stimulus.cyclic("Engine", "10 ms", speed="9000 rpm", load="-100 %", mode="off")
    bench.bus.run("50 ms")
    assert bench.bus.value("Engine.speed") == 9000
    assert bench.bus.value("Engine.load") == -100
    engine.set(mode="limp home")
    bench.bus.run("50 ms")
    assert bench.bus.times("Engine").size == 6
    assert bench.bus.value("Engine.mode") == 3
    bench.close()
