"""A recording is exported, and an MDF log read, in portions: the same, and in bounded memory."""

import tracemalloc
from functools import partial

import asammdf
import can
import numpy as np
import pytest
from mcap.reader import make_reader
from pyarrow import parquet

from slipbench.dbc import MOTORBIKE
from slipbench.protocol.database.database import load_database
from slipbench.protocol.errors import InputError
from slipbench.protocol.export import ENDINGS, export_run
from slipbench.protocol.logs import read_log, read_portions
from slipbench.protocol.logs.candump import candump_pieces
from slipbench.protocol.logs.candump_line import format_line
from slipbench.protocol.logs.decode import decode, sort_log
from tests.protocol.export.test_export import START, frames_of, run_of

FRAMES = 3000


def lines(count=FRAMES, seed=9):
    """Frames of all messages with random bits; a second bus and CAN FD come late in the log."""
    print("seed", seed)
    random = np.random.default_rng(seed)
    messages = load_database(MOTORBIKE).messages
    for number in range(count):
        message = messages[random.integers(len(messages))]
        late = number > count // 2
        fd = late and number % 7 == 0
        yield format_line(
            START + number * 250_000,
            "can1" if late and number % 3 == 0 else "can0",
            message.identifier,
            random.bytes(64 if fd else message.length),
            fd_flags=1 if fd else None,
            sent=number % 5 == 0,
        )


@pytest.fixture(scope="module")
def both(tmp_path_factory):
    """A recording exported as a whole and in portions, in every format."""
    run = run_of(tmp_path_factory.mktemp("portions") / "run", lines())
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            "slipbench.protocol.export.candump_pieces", partial(candump_pieces, size=20_000)
        )
        done = {
            form: (
                export_run(run, form, run / f"whole{ending}", at_once=10**9),
                export_run(run, form, run / f"parts{ending}", at_once=700),
            )
            for form, ending in ((form, ENDINGS[form] or "_tables") for form in ENDINGS)
        }
    return run, done


@pytest.mark.parametrize("form", sorted(ENDINGS))
def test_what_is_counted_and_told_is_the_same(both, form):
    whole, parts = both[1][form]
    assert (whole.frames, whole.samples) == (parts.frames, parts.samples)
    assert whole.frames == FRAMES
    assert whole.warnings == parts.warnings


@pytest.mark.parametrize("form", ["mf4", "blf", "asc"])
def test_the_frames_are_the_same(both, form):
    run, done = both
    read = [frames_of(each.path) for each in done[form]]
    assert read[0] == read[1]
    assert len(read[1]) == len(frames_of(run / "frames.log"))


def test_python_can_reads_the_portions_of_a_blf_as_one(both):
    with can.BLFReader(both[1]["blf"][1].path) as reader:
        assert reader.object_count == FRAMES
        assert len(list(reader)) == FRAMES


def test_asammdf_finds_every_signal_of_every_portion(both):
    run, done = both
    log = read_log(run / "frames.log").frames
    decoded = decode(sort_log(log, load_database(run / "database.dbc")))
    with asammdf.MDF(done["mf4"][1].path) as mdf:
        for name, signals in decoded.items():
            for signal, samples in signals.items():
                where = mdf.channels_db.get(f"{name}.{signal}", ())
                found = [mdf.get(f"{name}.{signal}", group=g, index=i) for g, i in where]
                values = np.concatenate([each.samples for each in found] or [np.zeros(0)])
                times = np.concatenate([each.timestamps for each in found] or [np.zeros(0)])
                order = np.argsort(times, kind="stable")
                assert np.array_equal(values[order], samples.value, equal_nan=True), (name, signal)


def test_mcap_and_the_tables_are_the_same(both):
    _, done = both
    told = []
    for each in done["mcap"]:
        with each.path.open("rb") as file:
            told.append(
                [
                    (message.log_time, message.sequence, channel.topic, message.data)
                    for _, channel, message in make_reader(file).iter_messages(log_time_order=False)
                ]
            )
    assert told[0] == told[1]
    whole, parts = (each.path for each in done["parquet"])
    assert sorted(p.name for p in whole.iterdir()) == sorted(p.name for p in parts.iterdir())
    for path in whole.iterdir():
        one, other = parquet.read_table(path), parquet.read_table(parts / path.name)
        assert one.to_pylist() == other.to_pylist()
        assert one.schema.equals(other.schema, check_metadata=True)


def test_an_mdf_log_of_several_groups_is_read_in_order_of_time(both, monkeypatch):
    """Groups of two buses and two widths, of which each is read some frames at a time."""
    run, done = both
    monkeypatch.setattr("slipbench.protocol.logs.through_asammdf.AT_ONCE", 170)
    portions = list(read_portions(done["mf4"][0].path, 300)[1])
    times = np.concatenate([portion.time_ns for portion in portions])
    assert np.array_equal(times, read_log(run / "frames.log").frames.time_ns)


def test_where_a_log_steps_back_between_portions_it_is_told_and_nothing_is_lost(
    tmp_path, monkeypatch
):
    monkeypatch.setattr(
        "slipbench.protocol.export.candump_pieces", partial(candump_pieces, size=2000)
    )
    text = [format_line(START + n * 1000, "can0", 1, b"") for n in (*range(500), *range(100))]
    done = export_run(run_of(tmp_path / "run", text), "blf", at_once=100)
    assert done.frames == 600
    assert any("step back" in warning for warning in done.warnings)


def test_a_damaged_line_far_into_a_log_leaves_nothing_behind(tmp_path, monkeypatch):
    monkeypatch.setattr(
        "slipbench.protocol.export.candump_pieces", partial(candump_pieces, size=2000)
    )
    text = [format_line(START + n * 1000, "can0", 1, b"") for n in range(500)]
    run = run_of(tmp_path / "run", [*text, b"nonsense\n", *text])
    for form in ENDINGS:
        with pytest.raises(InputError, match="line 501"):
            export_run(run, form, at_once=100)
    assert sorted(path.name for path in run.iterdir()) == ["database.dbc", "frames.log"]


SMALL, LARGE = 10_000, 40_000  # frames
FRAGMENT = 200_000  # bytes that asammdf writes, and reads again, at once: 4 MiB otherwise


@pytest.fixture(scope="module")
def small_fragments():
    """What bounds the memory in earnest would be more than these recordings have."""
    usual = asammdf.get_global_option("write_fragment_size")
    asammdf.set_global_option("write_fragment_size", FRAGMENT)
    yield
    asammdf.set_global_option("write_fragment_size", usual)


@pytest.fixture(scope="module")
def long_runs(tmp_path_factory, small_fragments):
    """A short recording and one four times as long, with an MDF log of each."""
    runs = []
    for count in (SMALL, LARGE):
        folder = tmp_path_factory.mktemp("long") / "run"
        runs.append(run_of(folder, lines(count)))
        export_run(runs[-1], "mf4", runs[-1] / "log.mf4")
    return runs


def peak(run, form, at_once):
    """Most memory (bytes) that Python and numpy held at once while the recording was worked on."""
    tracemalloc.start()
    try:
        if form == "read":
            for _ in read_portions(run / "log.mf4", at_once)[1]:
                pass
        else:
            export_run(run, form, run / f"out{at_once}.{form}", at_once=at_once)
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("form", ["mf4", "blf", "parquet", "read"])
def test_memory_does_not_grow_with_the_recording(long_runs, form, monkeypatch):
    monkeypatch.setattr(
        "slipbench.protocol.export.candump_pieces", partial(candump_pieces, size=100_000)
    )
    monkeypatch.setattr("slipbench.protocol.logs.through_asammdf.AT_ONCE", 2000)
    small, large = (peak(run, form, 2000) for run in long_runs)
    print(form, small, large)
    assert large < 1.3 * small


def test_held_whole_it_would(long_runs):
    small, large = (peak(run, "blf", 10**9) for run in long_runs)
    assert large > 2 * small
