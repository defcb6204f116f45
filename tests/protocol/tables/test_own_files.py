"""Law: what slipbench decodes or exports is read back as the same channels, units and times."""

import numpy as np
import pytest

from slipbench.dbc import MOTORBIKE
from slipbench.protocol.database.database import load_database
from slipbench.protocol.export import export_run
from slipbench.protocol.logs import read_log
from slipbench.protocol.logs.candump_line import format_line
from slipbench.protocol.logs.decode import sort_log
from slipbench.protocol.logs.decode_file import decode_file
from slipbench.protocol.logs.sample_table import chosen
from slipbench.protocol.recording.role_map import TableRules
from slipbench.protocol.tables import read_table, samples

ANY = TableRules()
START_NS = 1_700_000_000 * 10**9
KNOWN = load_database(MOTORBIKE)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A run folder with random payloads of every message of the database."""
    folder = tmp_path_factory.mktemp("own") / "run"
    folder.mkdir()
    random = np.random.default_rng(11)
    print("seed 11")
    lines, time = [], START_NS
    for _ in range(30):
        for message in KNOWN.messages:
            time += 1_000_000
            data = random.bytes(message.length)
            lines.append(format_line(time, "can0", message.identifier, data))
    (folder / "frames.log").write_bytes(b"".join(lines))
    (folder / "database.dbc").write_bytes(MOTORBIKE.read_bytes())
    return folder


def truth(run):
    """ "message.signal" -> times (s since 1970), finite values and the unit, as slipbench decodes."""
    frames = read_log(run / "frames.log").frames
    found = {}
    for held in sort_log(frames, KNOWN).frames.values():
        for signal in held.message.signals:
            one = held.samples(signal.name)
            good = np.isfinite(one.value.astype(np.float64))
            time = frames.time_ns[one.rows[good]] * 1e-9
            name = f"{held.message.name}.{signal.name}"
            found[name] = time, one.value[good].astype(np.float64), signal.unit
    return found


def check(table, expected, prefix, *, since):
    assert len(expected) > 20
    for name, (time, value, unit) in expected.items():
        found = samples(table, prefix + name, "", ANY)
        assert found.value == pytest.approx(value, rel=1e-12), name
        assert found.time == pytest.approx(time - since, abs=1e-6), name
        assert found.unit == unit, name


@pytest.mark.parametrize("ending", [".csv", ".parquet"])
def test_decoded_samples_are_a_long_table(run, tmp_path, ending):
    """Times in it count from the first frame."""
    out = tmp_path / f"x{ending}"
    decode_file(run / "frames.log", KNOWN, chosen(KNOWN, []), out)
    first = read_log(run / "frames.log").frames.time_ns[0] * 1e-9
    check(read_table(out), truth(run), "", since=first)


def test_exported_mcap(run, tmp_path):
    exported = export_run(run, "mcap", tmp_path / "x.mcap")
    expected = {name: each for name, each in truth(run).items() if each[1].size}
    check(read_table(exported.path), expected, "can0/", since=0.0)
