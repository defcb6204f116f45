"""Laws of the commands: a mistake is one message and status 2; nothing is overwritten."""

import subprocess
import sys

import pyarrow.csv
import pytest
from pyarrow import parquet

from slipbench import command
from tests.paths import ROOT
from tests.protocol.recording.test_import import DBC, ROLES, drive


@pytest.fixture
def slipbench_in(monkeypatch, capsys):
    """Run the command in a folder, in this process; gives status, what it printed, what it told."""

    def run(folder, *arguments):
        monkeypatch.chdir(folder)
        monkeypatch.setenv("COLUMNS", "120")
        monkeypatch.setattr(sys, "argv", ["slipbench", *map(str, arguments)])
        with pytest.raises(SystemExit) as end:
            command.main()
        printed = capsys.readouterr()
        return end.value.code, printed.out, printed.err

    return run


@pytest.fixture
def folder(tmp_path):
    """A folder with a log, a database and a role map."""
    (tmp_path / "drive.log").write_bytes(b"".join(drive()))
    (tmp_path / "car.dbc").write_text(DBC)
    (tmp_path / "roles.toml").write_text(ROLES)
    return tmp_path


DECODE = ("decode", "drive.log", "--dbc", "car.dbc", "--out")
IMPORT = ("import", "drive.log", "--dbc", "car.dbc", "--roles", "roles.toml", "--out", "runs/a")


def test_decode_writes_every_known_sample(slipbench_in, folder):
    status, out, err = slipbench_in(folder, *DECODE, "x.parquet")
    assert status == 0, err
    assert "600 frames" in out
    assert "0x333 200" in out  # not known, and counted
    table = parquet.read_table(folder / "x.parquet")
    assert table.num_rows == 800
    assert parquet.ParquetFile(folder / "x.parquet").num_row_groups == 4
    first = table.slice(0, 1).to_pylist()[0]
    assert first == {
        "time": 0.0,
        "time_ns": 1_700_000_000_000_000_000,
        "bus": "can0",
        "message": "Wheels",
        "signal": "Front",
        "value": 50.0,
        "unit": "km/h",
        "label": None,
        "exact": None,
    }


def test_decode_writes_only_what_is_asked_for(slipbench_in, folder):
    status, _, err = slipbench_in(folder, *DECODE, "x.csv", "--signals", "Wheels.Front, Gear")
    assert status == 0, err
    table = pyarrow.csv.read_csv(folder / "x.csv")
    assert set(table["signal"].to_pylist()) == {"Front", "Gear"}
    assert table.num_rows == 400


def test_import_tells_what_it_bound_and_what_is_missing(slipbench_in, folder):
    (folder / "roles.toml").write_text(ROLES + '[roles.lean_angle]\ntable = "l"\ncolumn = "c"\n')
    status, out, err = slipbench_in(folder, *IMPORT)
    assert status == 0, err
    assert "rear_wheel_speed" in out
    assert "missing: lean_angle" in out
    assert "600 frames" in out
    assert err == ""  # no progress bar where nobody looks


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ((*DECODE, "drive.log"), "exists"),
        ((*DECODE, "x.xlsx"), ".parquet or .csv"),
        ((*DECODE, "x.csv", "--signals", "Gaer"), "did you mean 'Gear'"),
        (("decode", "no.log", "--dbc", "car.dbc", "--out", "x.csv"), "no such file"),
        (("decode", "drive.log", "--dbc", "no.dbc", "--out", "x.csv"), "no.dbc"),
        (("decode", "drive.log", "drive.log", "--dbc", "car.dbc", "--out", "x.csv"), "one log"),
        (("decode", "car.dbc", "--dbc", "car.dbc", "--out", "x.csv"), "not a log"),
        ((*IMPORT, "--table", "gps"), "NAME=FILE"),
        ((*IMPORT, "--table", "../x=drive.log"), "NAME=FILE"),
        ((*IMPORT, "--table", "gps=no.csv"), "no role is bound to the table 'gps'"),
        ((*IMPORT[:-1], "."), "--out"),
        (("import", "drive.log", "--roles", "roles.toml", "--out", "x"), "--dbc"),
        (
            ("import", "drive.log", "--roles", "no.toml", "--dbc", "car.dbc", "--out", "x"),
            "no.toml",
        ),
    ],
)
def test_a_mistake_is_one_message_and_status_2(slipbench_in, folder, arguments, told):
    before = sorted(folder.rglob("*"))
    status, out, err = slipbench_in(folder, *arguments)
    assert status == 2
    assert told in err
    assert "Traceback" not in err + out
    assert sorted(path for path in folder.rglob("*") if path.name != "runs") == before


@pytest.mark.parametrize("command", ["decode", "import"])
def test_help_has_examples_and_exit_codes(slipbench_in, folder, command):
    status, out, _ = slipbench_in(folder, command, "--help")
    assert status == 0
    assert f"slipbench {command} drive.log" in out
    assert "Exit status" in out


def test_help_loads_no_library_of_logs():
    """The command answers at once: what reads logs is loaded where a log is read."""
    code = (
        "import sys, slipbench.protocol.commands; print([m for m in ('can', 'asammdf', 'pyarrow',"
    )
    code += " 'cantools') if m in sys.modules])"
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"


def test_the_command_itself_ends_without_a_traceback(folder):
    """As a process of its own: status 2 and one message."""
    done = subprocess.run(
        [sys.executable, "-m", "slipbench", "decode", "no", "--dbc", "x", "--out", "y"],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 2
    assert done.stderr.startswith("slipbench: x: ")
    assert "Traceback" not in done.stderr


NOTHING = ["time (s),speed (km/h)\n0,\n1,\n", "time (s),speed (km/h)\n,1\n,2\n", "a,b\n1,2\n3,4\n"]


@pytest.mark.parametrize("table", NOTHING)
def test_an_import_of_no_frame_and_no_sample_is_refused(slipbench_in, folder, table):
    (folder / "t.csv").write_text(table)
    (folder / "r.toml").write_text('title = "t"\n[roles.lean_angle]\ncolumn = "speed"\n')
    status, out, err = slipbench_in(
        folder, "import", "t.csv", "--roles", "r.toml", "--out", "runs/t"
    )
    assert (status, "Traceback" in err + out) == (2, False), out
    assert not (folder / "runs" / "t").exists()


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_a_decode_of_no_sample_is_refused(slipbench_in, folder, ending):
    (folder / "drive.log").write_text("(1.0) can0 777#00\n(2.0) can0 777#00\n")
    status, _, err = slipbench_in(folder, *DECODE, f"x.{ending}")
    assert (status, "no sample to write" in err) == (2, True), err
    assert not list(folder.glob("x.*"))


@pytest.mark.parametrize("form", ["mf4", "blf", "asc", "parquet", "mcap"])
def test_an_export_below_a_file_is_refused(slipbench_in, folder, form):
    assert slipbench_in(folder, *IMPORT)[0] == 0
    status, _, err = slipbench_in(
        folder, "export", "runs/a", "--format", form, "--out", "drive.log/x"
    )
    assert (status, "cannot be written" in err, "Traceback" in err) == (2, True, False)
