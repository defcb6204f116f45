"""Lateness of the loop without and with a live view or a Foxglove stream, at 8 000 frames/s.

`python benchmarks/view.py [seconds]`. A loop at 1 kHz, with the rights of a trial's loop, writes eight
frames per tick into the ring, and the recorder writes them to the disk, both as in a trial. The frames
are those of a recorded excitation, and numbered ones up to 8 000 frames/s. With the view, a page (a
WebSocket client in this process) receives its updates; with the stream, a client receives all topics.
Every frame must be in the recording.
"""

import json
import multiprocessing
import os
import re
import shutil
import statistics
import struct
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import closing, suppress
from itertools import cycle, islice, pairwise
from multiprocessing.connection import Connection
from pathlib import Path

from timing.quantiles import HEAD, Row
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from slipbench.bench.foxglove.stream_process import live_stream
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
Client = Callable[[str, float], str]
VIEW, STREAM = "with view and page", "with Foxglove stream and client"
RIDES = 6
SUBPROTOCOL = "foxglove.sdk.v1"
PATIENCE = 60.0  # s that a client waits for its connection
QUIET = 0.1  # s after which no more topics come


def main(seconds: float = SECONDS) -> None:
    """Print the table."""
    print(f"{os.cpu_count()} processors, load average {os.getloadavg()[0]:.1f} before the run")
    print(f"\nloop at 1 kHz and 8 000 frames/s, {seconds:g} s each\n{HEAD}", flush=True)
    notes = []
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "trial"
        run_trial(prepare(TRIAL), source, None)
        entries = recorded_entries(source / FRAMES)
        medians: dict[str, list[float]] = {}
        for number, (name, client) in enumerate(islice(cycle(CLIENTS.items()), RIDES)):
            run = prepared_folder(source, Path(folder) / f"run-{number}")
            notes.append(f"{name}: {ride(run, entries, seconds, name, client)}")
            lateness = read_ticks(run / TICKS, MILLISECOND)
            medians.setdefault(name, []).append(statistics.median(lateness.lateness))
            print(Row(name, lateness.lateness, lateness.skipped), flush=True)
    for name, values in medians.items():
        print(f"{name}: median lateness {statistics.median(values) * 1e-3:.1f} us")
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


def ride(run: Path, entries: list[Entry], seconds: float, name: str, client: Client | None) -> str:
    """Run loop, recorder and what serves; what was recorded and what a client received, in words."""
    lines: list[str] = []
    page, stream = (address_of("127.0.0.1:0") if name == each else None for each in (VIEW, STREAM))
    memory, ring = create_shared()
    spawning = multiprocessing.get_context("spawn")
    ours, theirs = spawning.Pipe()
    recorder = start_recorder(memory.name, run, ["can0"], tick_table(prepare(TRIAL).trial))
    loop = spawning.Process(target=run_loop, args=(memory.name, entries, seconds, theirs))
    with (
        live_view(run, page, lines.append, take_look=False),
        live_stream(run, stream, lines.append),
    ):
        loop.start()
        theirs.close()
        received = client(lines[0], seconds) if client else ""
        written, full, refused = ours.recv()
        loop.join()
    recorder.join()
    ring.release()
    memory.close()
    memory.unlink()
    recorded = (run / FRAMES).read_bytes().count(b"\n")
    rights = f"; not granted: {', '.join(refused)}" if refused else ""
    return f"{written} frames written, {recorded} recorded, {full} refused by the ring{received}{rights}"


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
    with (
        connect(f"ws://{address[1]}/live", max_size=None, open_timeout=PATIENCE) as page,
        suppress(ConnectionClosed),
    ):
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


def follow(line: str, seconds: float) -> str:
    """Receive all topics of a stream for most of the run; their rate and delay in words."""
    address = re.search(r"ws://\S+", line)
    assert address, line
    delays: list[float] = []
    with (
        connect(
            address[0], subprotocols=[SUBPROTOCOL], max_size=None, open_timeout=PATIENCE
        ) as client,
        suppress(ConnectionClosed),
    ):
        subscribe(client)
        begin = time.monotonic()
        while time.monotonic() < begin + 0.8 * seconds:
            data = client.recv()
            if isinstance(data, bytes) and data[0] == 1:
                delays.append(time.time_ns() - struct.unpack_from("<Q", data, 5)[0])
        taken = time.monotonic() - begin
    delays = sorted(
        delays[len(delays) // 4 :]
    )  # the first come late: frames wait for subscriptions
    p50, p99 = (delays[int(share * len(delays))] * 1e-6 for share in (0.5, 0.99))
    rate = len(delays) / 0.75 / taken
    return f"; client: {rate:.0f} messages/s, delay p50 {p50:.0f} ms, p99 {p99:.0f} ms"


def subscribe(client: ClientConnection) -> None:
    """Subscribe to all topics when they have come, each with a message of its own."""
    channels: list[int] = []
    with suppress(TimeoutError):
        while True:
            data = client.recv(timeout=QUIET if channels else None)
            tree = json.loads(data) if isinstance(data, str) else {}
            channels += [each["id"] for each in tree.get("channels", [])]
    subscriptions = [{"id": each, "channelId": each} for each in channels]
    client.send(json.dumps({"op": "subscribe", "subscriptions": subscriptions}))


CLIENTS: dict[str, Client | None] = {"without": None, VIEW: watch, STREAM: follow}


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else SECONDS)
