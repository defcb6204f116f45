"""What a real kernel and real processes do to a trial; each case is a row of docs/fault_matrix.md.

The rider's throttle is watched by candump: what the ECU says that it grants.
"""

import errno
import os
import resource
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import can
import pytest

from slipbench import dbc
from slipbench.protocol.codec.codec import Codec
from slipbench.protocol.codec.messages import ActuatorCommand, EcuStatus
from slipbench.protocol.database.database import load_database
from slipbench.protocol.recording.recording import Recording
from slipbench.protocol.recording.run_folder import read
from tests.bench.bus.wires import VCAN
from tests.socketcan.inside.interfaces import set_interface
from tests.socketcan.inside.programs import (
    ON_THE_BUS,
    candump,
    short_trial,
    slipbench,
    wait_for_listeners,
)

SILENCE = 0.020  # s, after which the devices take authority back
LATENESS = 0.030  # s that a process may be late on a loaded machine
INTO_IT = 0.5  # s of excitation before something happens


@dataclass(frozen=True)
class Broken:
    """What a trial left to which something was done at `struck` (s, the bus's own time)."""

    struck: float
    status: int
    said: str
    vehicle_status: int
    vehicle_said: str
    folder: Path
    witness: Path

    def heard(self) -> Iterator[tuple[float, object]]:
        """Every message that candump heard, decoded, and when."""
        codec = Codec(load_database(dbc.MOTORBIKE))
        for message in can.LogReader(self.witness):
            if not message.is_error_frame:
                yield message.timestamp, codec.decode(message.arbitration_id, message.data)

    def held_until(self) -> float:
        """When the ECU said last that the bench has the throttle."""
        return max(t for t, m in self.heard() if isinstance(m, EcuStatus) and m.authority)

    def asked_until(self) -> float:
        """When the bench asked last for authority."""
        return max(t for t, m in self.heard() if isinstance(m, ActuatorCommand) and m.authority)


@contextmanager
def programs(folder: Path) -> "Iterator[tuple[subprocess.Popen[str], subprocess.Popen[str], Path]]":
    """A vehicle and a trial on the bus, in the midst of the excitation."""
    folder.mkdir(exist_ok=True)
    file = short_trial(folder)
    vehicle = slipbench("vehicle", file, *ON_THE_BUS)
    wait_for_listeners(2)
    trial = slipbench("trial", file, *ON_THE_BUS, "--real-time", "--out", folder / "run")
    assert trial.stdout
    said: list[str] = []
    while not any("exciting" in line for line in said[-1:]):
        said.append(trial.stdout.readline())
        assert said[-1], f"it never came to exciting: {''.join(said)}"
    time.sleep(INTO_IT)
    try:
        yield trial, vehicle, folder / "run"
    finally:
        for process in (trial, vehicle):
            process.kill()
            process.wait()


def broken(
    folder: Path,
    strike: "Callable[[subprocess.Popen[str], subprocess.Popen[str]], None]",
    mend: "Callable[[subprocess.Popen[str], subprocess.Popen[str]], None]" = lambda *_: None,
) -> Broken:
    """Do `strike` to a trial, `mend` a while later, and let both programs end."""
    log = folder / "witness.log"
    with candump(log), programs(folder) as (trial, vehicle, run):
        struck = time.time()
        strike(trial, vehicle)
        time.sleep(0.2)
        mend(trial, vehicle)
        said, _ = trial.communicate(timeout=60)
        vehicle.send_signal(signal.SIGINT)
        vehicle_said, _ = vehicle.communicate(timeout=10)
    return Broken(struck, trial.returncode, said, vehicle.returncode, vehicle_said, run, log)


def exciting_from(recording: Recording) -> float:
    """When the excitation began, s; what was late before, while programs started, is no fault."""
    [began] = [
        phase["time_ns"]
        for phase in recording.description["outcome"]["phases"]
        if phase["phase"] == "exciting"
    ]
    return float(began - recording.start_time_ns) * 1e-9


def children(process: "subprocess.Popen[str]") -> list[int]:
    """The loop and the recorder of a trial, in the order in which they were started."""
    listed = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text(encoding="ascii")
    return [
        pid
        for pid in sorted(map(int, listed.split()))
        if b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes()
    ]


@pytest.fixture
def _up_again() -> Iterator[None]:
    yield
    set_interface(VCAN, up=True)


@pytest.mark.usefixtures("_up_again")
def test_an_interface_that_goes_down_ends_both_programs_with_a_word_about_it(
    tmp_path: Path,
) -> None:
    done = broken(tmp_path, lambda *_: set_interface(VCAN, up=False))
    assert done.status == 3, done.said
    assert "tripped: the CAN controller is off the bus" in done.said
    assert done.vehicle_status == 2, done.vehicle_said
    assert "the CAN bus failed" in done.vehicle_said
    assert "Traceback" not in done.said + done.vehicle_said
    assert read(done.folder).description["outcome"]["trip"] == "bus_off"


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_a_vehicle_that_is_killed_or_stopped_is_not_commanded_any_more(
    tmp_path: Path, number: signal.Signals
) -> None:
    done = broken(
        tmp_path,
        lambda _, vehicle: vehicle.send_signal(number),
        lambda _, vehicle: vehicle.send_signal(signal.SIGCONT),
    )
    assert done.status == 3, done.said
    assert "silent for" in done.said
    assert done.asked_until() - done.struck < SILENCE + LATENESS
    assert read(done.folder).description["outcome"]["trip"] == "stale"


def test_a_loop_that_is_stopped_loses_authority_and_does_not_take_it_again(tmp_path: Path) -> None:
    done = broken(
        tmp_path,
        lambda trial, _: os.kill(children(trial)[0], signal.SIGSTOP),
        lambda trial, _: os.kill(children(trial)[0], signal.SIGCONT),
    )
    assert done.status == 3, done.said
    assert done.held_until() - done.struck < SILENCE + LATENESS
    assert read(done.folder).description["outcome"]["trip"] == "timing"
    assert "watchdog timeout at" in done.vehicle_said


def test_a_recorder_that_is_killed_ends_the_trial(tmp_path: Path) -> None:
    done = broken(tmp_path, lambda trial, _: os.kill(children(trial)[1], signal.SIGKILL))
    assert done.status == 3, done.said
    assert "the recorder cannot write" in done.said
    assert "the recorder's process died (signal 9)" in done.said
    assert done.held_until() - done.struck < 0.1 + SILENCE + LATENESS
    assert read(done.folder).frame_count > 1000


def test_a_recorder_that_is_stopped_for_a_while_loses_nothing(tmp_path: Path) -> None:
    done = broken(
        tmp_path,
        lambda trial, _: os.kill(children(trial)[1], signal.SIGSTOP),
        lambda trial, _: os.kill(children(trial)[1], signal.SIGCONT),
    )
    assert done.status == 0, done.said
    recording = read(done.folder)
    late = [fault for fault in recording.faults if fault.fault == "lost"]
    assert [fault for fault in late if fault.first_time > exciting_from(recording)] == []


def fill_the_disk(recorder: int) -> None:
    """Have the kernel refuse whatever a process writes from now on to files that are not short."""
    resource.prlimit(recorder, resource.RLIMIT_FSIZE, (1000, 1000))


def test_a_recorder_whose_writes_are_refused_ends_the_trial_and_keeps_what_it_wrote(
    tmp_path: Path,
) -> None:
    done = broken(tmp_path, lambda trial, _: fill_the_disk(children(trial)[1]))
    assert done.status == 3, done.said
    assert "tripped: the recorder cannot write" in done.said
    assert f"the recorder could not write: {os.strerror(errno.EFBIG)}" in done.said
    assert done.held_until() - done.struck < SILENCE + LATENESS
    assert read(done.folder).frame_count > 1000


@pytest.mark.parametrize("by", [3600, -3600])
def test_a_clock_that_is_set_moves_neither_the_throttle_nor_the_record(
    tmp_path: Path, by: int
) -> None:
    before = time.clock_gettime(time.CLOCK_REALTIME) - time.monotonic()

    def set_by(seconds: float) -> None:
        now = time.monotonic() + before + seconds
        time.clock_settime(time.CLOCK_REALTIME, now)

    try:
        set_by(0)
    except PermissionError:
        pytest.skip("this kernel's clock may not be set; on user-mode Linux it may")
    try:
        done = broken(tmp_path, lambda *_: set_by(by))
    finally:
        set_by(0)
    assert done.status == 0, done.said
    recording = read(done.folder)
    assert recording.duration < 60
    excited = exciting_from(recording)
    late = [fault for fault in recording.faults if fault.fault in ("lost", "stale")]
    assert [fault for fault in late if fault.first_time > excited] == []
