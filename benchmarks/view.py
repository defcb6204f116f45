"""Lateness of the loop without and with a live view, at 8 000 frames/s.

`python benchmarks/view.py [seconds]`. A loop at 1 kHz, with the rights of a trial's loop, writes eight
frames per tick into the ring, and the recorder writes them to the disk, both as in a trial. The frames
are those of a recorded excitation, and numbered ones up to 8 000 frames/s. With the view, a page (a
WebSocket client in this process) receives its updates. Every frame must be in the recording.
"""

import json
import multiprocessing
import os
import re
import shutil
import sys
import tempfile
import time
from contextlib import closing, suppress
from itertools import cycle, islice, pairwise
from multiprocessing.connection import Connection
from pathlib import Path

from timing.quantiles import HEAD, Row
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from slipbench.bench.loop.clock import MILLISECOND, MonotonicClock
from slipbench.bench.loop.loop import run_periodic
from slipbench.bench.loop.realtime_process import realtime_process
from slipbench.bench.loop.recorder import start_recorder
from slipbench.bench.loop.ring import SENT, attach_shared, create_shared
from slipbench.bench.loop.ticks import TICKS, read_ticks, tick_recorder, tick_table
from slipbench.bench.trials.preparation import prepare
from slipbench.bench.trials.run import run_trial
from slipbench.bench.view.access import address_of
from slipbench.bench.view.view_process import live_view
from slipbench.protocol.logs.candump_line import LINE
from slipbench.protocol.recording.run_folder import DESCRIPTION, FRAMES

SECONDS = 20.0
PER_TICK = 8  # frames: 8 000 frames/s
OF_THE_TRIAL = 4300  # of these, frames/s of the recorded trial
NUMBERED = 0x6FF
TRIAL = Path(__file__).parents[1] / "examples" / "trials" / "throttle_sweep.toml"
Entry = tuple[int, int, bytes]  # identifier, flags, data


def main(seconds: float = SECONDS) -> None:
    """Print the table."""
    print(f"{os.cpu_count()} processors, load average {os.getloadavg()[0]:.1f} before the run")
    print(f"\nloop at 1 kHz and 8 000 frames/s, {seconds:g} s each\n{HEAD}", flush=True)
    notes = []
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "trial"
        run_trial(prepare(TRIAL), source, None)
        entries = recorded_entries(source / FRAMES)
        for number, view in enumerate((False, True, False, True)):
            run = prepared_folder(source, Path(folder) / f"run-{number}")
            name = "with view and page" if view else "without view"
            notes.append(f"{name}: {ride(run, entries, seconds, view)}")
            lateness = read_ticks(run / TICKS, MILLISECOND)
            print(Row(name, lateness.lateness, lateness.skipped), flush=True)
    print("", *notes, sep="\n")


def recorded_entries(log: Path) -> list[Entry]:
    """Frames of a recorded trial from its button on, in their order."""
    entries = []
    for line in log.read_bytes().splitlines():
        if found := LINE.fullmatch(line):
            flags = SENT if found["direction"] == b"T" else 0
            data = bytes.fromhex(found["classic"].decode())
            entries.append((int(found["identifier"], 16), flags, data))
    return entries[3 * OF_THE_TRIAL :]


def prepared_folder(source: Path, folder: Path) -> Path:
    """Run folder of a trial that begins."""
    shutil.copytree(source, folder, ignore=shutil.ignore_patterns(FRAMES, TICKS))
    description = (source / DESCRIPTION).read_text().partition("[outcome]")[0]
    (folder / DESCRIPTION).write_text(description)
    return folder


def ride(run: Path, entries: list[Entry], seconds: float, view: bool) -> str:
    """Run loop, recorder and view; what was recorded and what the page received, in words."""
    lines: list[str] = []
    address = address_of("127.0.0.1:0") if view else None
    memory, ring = create_shared()
    spawning = multiprocessing.get_context("spawn")
    ours, theirs = spawning.Pipe()
    recorder = start_recorder(memory.name, run, ["can0"], tick_table(prepare(TRIAL).trial))
    loop = spawning.Process(target=run_loop, args=(memory.name, entries, seconds, theirs))
    with live_view(run, address, lines.append, take_look=False):
        loop.start()
        theirs.close()
        page = watch(lines[0], seconds) if view else ""
        written, full, refused = ours.recv()
        loop.join()
    recorder.join()
    ring.release()
    memory.close()
    memory.unlink()
    recorded = (run / FRAMES).read_bytes().count(b"\n")
    rights = f"; not granted: {', '.join(refused)}" if refused else ""
    return (
        f"{written} frames written, {recorded} recorded, {full} refused by the ring{page}{rights}"
    )


def run_loop(name: str, entries: list[Entry], seconds: float, pipe: Connection) -> None:
    """Write frames into the ring in each tick: main function of the loop's process."""
    memory, ring = attach_shared(name)
    clock, most = MonotonicClock(), round(seconds * 1000)
    source, written, full = cycle(entries), 0, 0
    of_the_trial = 0

    def tick(number: int, _due: int) -> bool:
        nonlocal written, full, of_the_trial
        share = (number + 1) * OF_THE_TRIAL // 1000 - of_the_trial
        of_the_trial += share
        count = (NUMBERED, 0, (number & 0xFFFF).to_bytes(2, "big"))
        for identifier, flags, data in (*islice(source, share), *[count] * (PER_TICK - share)):
            taken = ring.append(clock.now_ns(), identifier, flags, data)
            written, full = written + taken, full + (not taken)
        return number < most - 1

    with realtime_process() as refused:
        run_periodic(tick, MILLISECOND, clock, most, tick_recorder(ring))
    ring.close()
    pipe.send((written, full, [text.partition(" was ")[0] for text in refused]))
    ring.release()
    with closing(memory):
        pipe.close()


def watch(line: str, seconds: float) -> str:
    """Receive the updates of a page for most of the run; their rate in words."""
    address = re.search(r"http://([^/]+)/", line)
    assert address, line
    times, behind = [], 0.0
    with connect(f"ws://{address[1]}/live", max_size=None) as page, suppress(ConnectionClosed):
        begin = time.monotonic()
        while time.monotonic() < begin + 0.8 * seconds:
            state = json.loads(page.recv())
            if state["type"] == "update" and state.get("frames"):
                times.append(time.monotonic())
                behind = max(behind, state["not_read"])
    gaps = sorted(after - before for before, after in pairwise(times))
    rate = (len(times) - 1) / (times[-1] - times[0])
    return (
        f"; page: {rate:.1f} updates/s, p99 of the time between two"
        f" {gaps[int(0.99 * len(gaps))] * 1e3:.0f} ms, {behind:.0f} bytes not shown"
    )


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else SECONDS)
