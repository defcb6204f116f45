"""From the loop to the disk: no frame is reordered, no loss is unreported."""

import errno
import io
import os
import resource
import signal
import subprocess
import sys
import textwrap
import time
from contextlib import contextmanager
from itertools import count

import pytest
from hypothesis import given
from hypothesis import strategies as st

from slipbench.bench.loop.recorder import Recorder, candump_line, start_recorder
from slipbench.bench.loop.ring import EXTENDED, FD, SENT, Ring, Slot, create_shared
from slipbench.bench.loop.ticks import TickTable
from slipbench.bench.trials.live_trial import _finish

TABLE = TickTable(1_000_000, 500_000)

frames = st.builds(
    Slot,
    st.integers(0, 2**62),
    st.integers(0, 0x7FF),
    st.sampled_from([0, SENT]),
    st.binary(max_size=8),
    st.integers(0, 255),
)


@given(st.lists(st.one_of(frames, st.none()), max_size=200), st.integers(1, 16))
def test_a_ring_returns_its_frames_in_order_and_rejects_when_full(actions, slots):
    ring, inside, taken, given_back = Ring.local(slots), 0, [], []
    for frame in actions:
        if frame is None:
            given_back += list(ring.drain())
            inside = 0
        elif ring.append(*frame):
            taken.append(frame)
            inside += 1
        else:
            assert inside == slots
    assert given_back + list(ring.drain()) == taken


@pytest.mark.parametrize(
    ("frame", "line"),
    [
        (Slot(1_500_000_000, 0x10, SENT, b"\x01\xab"), "(0000000001.500000) can0 010#01AB T\n"),
        (Slot(0, 0x12345, EXTENDED, b""), "(0000000000.000000) can0 00012345# R\n"),
        (
            Slot(999, 0x7FF, FD, b"\x00" * 12),
            "(0000000000.000000) can0 7FF##0" + "00" * 12 + " R\n",
        ),
    ],
)
def test_lines_are_those_of_candump(frame, line):
    assert candump_line(frame, "can0") == line


class FullDisk(io.RawIOBase):
    """A file on a disk that fills up. It does not imitate a disk that recovers."""

    def __init__(self, room):
        self.room, self.kept = room, b""

    def write(self, data):
        if len(self.kept) >= self.room:
            raise OSError(28, "No space left on device")
        part = bytes(data)[: self.room - len(self.kept)]
        self.kept += part
        return len(part)


def test_a_full_disk_is_reported_to_the_loop_and_keeps_what_was_written():
    ring, disk = Ring.local(), FullDisk(100)
    recorder = Recorder(ring, disk, ["can0"], io.BytesIO(), TABLE)
    for number in range(10):
        ring.append(number * 1000, 0x10, 0, bytes(8))
    recorder.drain()
    assert ring.failed
    assert ring.why_failed == os.strerror(errno.ENOSPC)
    assert "No space left" in recorder.error
    assert disk.kept.startswith(candump_line(Slot(0, 0x10, 0, bytes(8)), "can0").encode())


def test_the_recorder_process_writes_every_frame_and_ends(tmp_path):
    memory, ring = create_shared()
    process = start_recorder(memory.name, tmp_path, ["can0"], TABLE)
    for number in range(5000):
        assert ring.append(number * 1_000_000, number % 2048, 0, number.to_bytes(8, "little"))
    ring.close()
    process.join(30)
    ring.release()
    memory.close()
    memory.unlink()
    lines = (tmp_path / "frames.log").read_text().splitlines()
    assert process.exitcode == 0
    assert [int(line.split("#")[1].split()[0][:4], 16) for line in lines[:2]] == [0, 0x0100]
    assert len(lines) == 5000


LIMIT = 100_000  # bytes of a file, beyond which the kernel refuses


@contextmanager
def small_files():
    """Let no file grow beyond LIMIT, of this process and of those that it starts meanwhile."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (LIMIT, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_a_recorder_with_a_refused_write_reports_the_cause_and_keeps_what_it_wrote(tmp_path):
    """A separate process whose writes the kernel refuses: as a full disk, with another errno."""
    memory, ring = create_shared()
    with small_files():
        process = start_recorder(memory.name, tmp_path, ["can0"], TABLE)
    numbers, deadline = count(), time.monotonic() + 60
    while not ring.failed and time.monotonic() < deadline:
        ring.append(0, 0x10, 0, next(numbers).to_bytes(8, "little"))
        time.sleep(0.0001)
    ring.close()
    why, told = ring.why_failed, _finish(process, ring)
    ring.release()
    memory.close()
    memory.unlink()
    assert why == os.strerror(errno.EFBIG)
    assert told == [f"the recorder could not write: {why}"]
    log = (tmp_path / "frames.log").read_bytes()
    assert len(log) == LIMIT
    assert len(log.splitlines()) <= next(numbers)
    assert all(line.endswith(b" R") for line in log.splitlines()[:-1])


def test_a_ring_that_is_not_read_is_reported_as_such():
    ring = Ring.local()
    ring.fail()
    assert ring.failed
    assert ring.why_failed == ""
    ring.fail(errno.ENOSPC)
    assert ring.why_failed == "", "the first word stays"


LOOP = """
    import sys, time
    from pathlib import Path
    from slipbench.bench.loop.recorder import start_recorder
    from slipbench.bench.loop.ring import create_shared
    from slipbench.bench.loop.ticks import TickTable

    def main():
        memory, ring = create_shared()
        start_recorder(memory.name, Path(sys.argv[1]), ["can0"], TickTable(1_000_000, 500_000))
        print("started", flush=True)
        number, begin = 0, time.monotonic()
        while True:
            while number < (time.monotonic() - begin) * 4000:
                ring.append(time.monotonic_ns(), 0x10, 0, number.to_bytes(8, "little"))
                number += 1
            time.sleep(0.001)

    if __name__ == "__main__":
        main()
"""


def test_a_killed_loop_loses_under_50_ms_of_frames(tmp_path):
    script, log = tmp_path / "loop.py", tmp_path / "frames.log"
    script.write_text(textwrap.dedent(LOOP))
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    loop = subprocess.Popen(
        [sys.executable, str(script), str(tmp_path)], env=environment, stdout=subprocess.PIPE
    )
    assert loop.stdout is not None
    loop.stdout.readline()
    deadline = time.monotonic() + 30
    while time.monotonic() < deadline and (not log.exists() or log.stat().st_size < 200_000):
        time.sleep(0.01)
    loop.send_signal(signal.SIGKILL)
    killed = time.monotonic_ns()
    loop.wait()
    size = -1
    while size != log.stat().st_size:  # the recorder outlives the loop until the ring is empty
        size = log.stat().st_size
        time.sleep(0.3)
    last = log.read_text().splitlines()[-1]
    lost = killed * 1e-9 - float(last[1 : last.index(")")])
    numbers = [int(line.split("#")[1][:4], 16) for line in log.read_text().splitlines()]
    assert lost < 0.05
    assert len(numbers) == len(set(numbers)) or len(numbers) > 65536
