"""No whole number is rounded on its way from the bus to a file: it is exact, or an error."""

import csv
import json

import asammdf
import numpy as np
import pytest
from mcap.reader import make_reader
from pyarrow import parquet

from slipbench.protocol.database.database import load_database
from slipbench.protocol.errors import InputError
from slipbench.protocol.export import export_run
from slipbench.protocol.logs.candump_line import format_line
from slipbench.protocol.logs.decode_file import decode_file
from slipbench.protocol.logs.sample_table import chosen
from tests.protocol.export.test_export import run_of

# name: byte order and sign, scale, offset
LAYOUTS = {
    "U": ("1+", 1, 0),
    "S": ("1-", 1, 0),
    "M": ("0+", 1, 0),
    "Twice": ("1-", 2, 0),
    "Moved": ("1+", 1, -5),
    "Wide": ("1+", 1000, 7),
    "Negative": ("1-", -3, 1),
}
WITHIN_64_BITS = ("U", "S", "M")


def dbc_of(names):
    """A database with one message of one 64-bit signal for each name."""
    lines = ['VERSION ""', "", "BU_: A", ""]
    for name in names:
        order, scale, offset = LAYOUTS[name]
        start = 7 if order[0] == "0" else 0
        identifier = 0x100 + list(LAYOUTS).index(name)
        lines += [
            f"BO_ {identifier} {name}: 8 A",
            f' SG_ {name}v : {start}|64@{order} ({scale},{offset}) [0|0] "" A',
            "",
        ]
    return "\n".join(lines)


def recorded(names, seed):
    """Candump lines of edge and random values, and the physical values by signal name."""
    random = np.random.default_rng(seed)
    expected, lines = {}, []
    for name in names:
        order, scale, offset = LAYOUTS[name]
        edges = [0, 1, 2**53 - 1, 2**53, 2**53 + 1, 2**63 - 1, 2**63, 2**64 - 1]
        for raw in edges + [int.from_bytes(random.bytes(8), "big") for _ in range(40)]:
            data = raw.to_bytes(8, "big" if order[0] == "0" else "little")
            value = raw - (1 << 64) if order[1] == "-" and raw >= 1 << 63 else raw
            expected.setdefault(f"{name}v", []).append(value * scale + offset)
            identifier = 0x100 + list(LAYOUTS).index(name)
            lines.append(format_line(10**9 + len(lines) * 10**6, "can0", identifier, data))
    return lines, expected


@pytest.fixture
def folder(tmp_path):
    """A log and a database of every layout, and the values in it."""
    lines, expected = recorded(LAYOUTS, 11)
    (tmp_path / "x.log").write_bytes(b"".join(lines))
    (tmp_path / "x.dbc").write_text(dbc_of(LAYOUTS))
    return tmp_path, expected


def decoded(folder, name):
    database = load_database(folder / "x.dbc")
    return decode_file(folder / "x.log", database, chosen(database, []), folder / name)


def test_decode_to_csv_keeps_every_digit(folder):
    path, expected = folder
    decoded(path, "x.csv")
    found = {}
    with (path / "x.csv").open() as file:
        for row in csv.DictReader(file):
            found.setdefault(row["signal"], []).append(int(row["value"]))
    assert found == expected


def test_decode_to_parquet_keeps_every_digit_and_never_a_rounded_value(folder):
    path, expected = folder
    text, _, _ = decoded(path, "x.parquet")
    found, texts = {}, 0
    for row in parquet.read_table(path / "x.parquet").to_pylist():
        assert (row["value"] is None) == (row["exact"] is not None)
        texts += row["value"] is None
        exact = int(row["value"] if row["exact"] is None else row["exact"])
        found.setdefault(row["signal"], []).append(exact)
    assert found == expected
    rounded = {n: sum(int(float(v)) != v for v in values) for n, values in expected.items()}
    assert texts == sum(rounded.values()) > 200
    assert len([w for w in text.warnings if "column `exact`" in w]) == len(expected)


def test_export_to_parquet_keeps_every_digit(tmp_path):
    lines, expected = recorded(LAYOUTS, 12)
    (tmp_path / "x.dbc").write_text(dbc_of(LAYOUTS))
    done = export_run(run_of(tmp_path / "run", lines, tmp_path / "x.dbc"), "parquet")
    for name in LAYOUTS:
        column = parquet.read_table(done.path / f"{name}.parquet")[f"{name}v"]
        assert [int(value) for value in column.to_pylist()] == expected[f"{name}v"]


def test_export_to_mcap_keeps_every_digit(tmp_path):
    lines, expected = recorded(LAYOUTS, 13)
    (tmp_path / "x.dbc").write_text(dbc_of(LAYOUTS))
    done = export_run(run_of(tmp_path / "run", lines, tmp_path / "x.dbc"), "mcap")
    found = {}
    with done.path.open("rb") as file:
        for _, channel, message in make_reader(file).iter_messages():
            if not channel.topic.endswith("/frames"):
                for name, value in json.loads(message.data).items():
                    found.setdefault(name, []).append(value)
    assert found == expected


def test_export_to_mdf_keeps_every_digit_or_is_refused(tmp_path):
    lines, expected = recorded(WITHIN_64_BITS, 14)
    (tmp_path / "x.dbc").write_text(dbc_of(LAYOUTS))
    done = export_run(run_of(tmp_path / "run", lines, tmp_path / "x.dbc"), "mf4")
    with asammdf.MDF(done.path) as mdf:
        for name in WITHIN_64_BITS:
            assert mdf.get(f"{name}.{name}v").samples.tolist() == expected[f"{name}v"]
    for name in ("Twice", "Moved", "Wide", "Negative"):
        lines, _ = recorded([name], 15)
        with pytest.raises(InputError, match="MDF cannot hold"):
            export_run(run_of(tmp_path / name, lines, tmp_path / "x.dbc"), "mf4")
