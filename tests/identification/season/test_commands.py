"""`slipbench runs` at the command line."""

import re

import pytest

from slipbench.protocol.configuration import load_toml
from tests.bench.test_commands import run
from tests.identification.season.seasons import explain, make_run, write


@pytest.fixture
def season(tmp_path, monkeypatch):
    write(tmp_path / "monday/plan.toml", "name = 'day'")
    make_run(tmp_path / "monday/runs/a-1", 1, {"tyre": "new", "mileage": 100}, 8.0)
    make_run(tmp_path / "monday/runs/a-2", 2, {"tyre": "old", "mileage": 812}, 9.0, "not usable")
    make_run(tmp_path / "tuesday/runs/a-1", 3)
    explain(tmp_path / "monday/memo", 1.5)
    write(tmp_path / "tuesday/runs/b-1/run.toml", b"\xff")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_list_has_every_run_with_verdict_interval_tags_and_faults(season, monkeypatch, capsys):
    status, out, _ = run(monkeypatch, capsys, "runs", ".")
    lines = out.splitlines()
    assert status == 0
    assert lines[0].split()[:4] == ["name", "kind", "session", "date"]
    assert [line.split()[0] for line in lines[1:6]] == ["a-1", "a-2", "memo", "a-1", "b-1"]
    for words in ("2026-05-01 10:00", "new", "812", "not usable", "8.00 (7.80 to 8.20)"):
        assert words in out
    assert "1.50 (1.20 to 1.80)" in out
    assert "fault: tuesday/runs/b-1: " in out
    assert "run.toml: not valid TOML" in out


def test_filter_and_columns(season, monkeypatch, capsys):
    options = (
        "--where",
        "kind = 'run' and mileage > 300",
        "--columns",
        "session, natural_frequency, mileage / 2 as h",
    )
    _, out, _ = run(monkeypatch, capsys, "runs", ".", *options)
    assert [" ".join(line.split()) for line in out.splitlines()] == [
        "session natural_frequency, Hz h",
        "monday 9.00 (8.80 to 9.20) 406",
    ]
    _, out, _ = run(monkeypatch, capsys, "runs", ".", "--columns", "all")
    assert {"name", "tyre", "dead_time_low"} <= set(out.split())
    status, _, err = run(monkeypatch, capsys, "runs", ".", "--columns", "mileag")
    assert status == 2
    assert "did you mean 'mileage'" in err


def test_a_run_and_a_session_are_tagged(season, monkeypatch, capsys):
    tag = ("runs", ".", "--tag")
    _, out, _ = run(monkeypatch, capsys, *tag, "tuesday/a-1", "tyre=worn", "mileage=900")
    assert out == "tuesday/runs/a-1: tyre = worn, mileage = 900\n"
    found = load_toml(season / "tuesday/runs/a-1/run.toml")["tags"]
    assert found == {"tyre": "worn", "mileage": 900}
    _, out, _ = run(monkeypatch, capsys, *tag, "monday", "track=Mugello", "mileage=")
    assert len(out.splitlines()) == 2
    assert load_toml(season / "monday/runs/a-2/run.toml")["tags"] == {
        "tyre": "old",
        "track": "Mugello",
    }


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--tag", "a-1", "x=1"), "several runs are called"),
        (("--tag", "a-3", "x=1"), "did you mean"),
        (("--tag", "a-2"), "at least one KEY=VALUE"),
        (("x=1",), "a tag needs a run"),
        (("--tag", "a-2", "X=1"), "tags.X"),
        (("--tag", "b-1", "x=1"), "not valid TOML"),
        (("--export", "x.csv"), "ends with .parquet"),
        (("--export", "x.parquet", "--trend", "dead_time"), "do not go together"),
        (("--over", "mileage"), "needs --trend"),
        (("--figure", "x.png"), "needs --trend"),
        (("--where", "gear = 1", "--tag", "a-2", "x=1"), "no effect"),
        (("--where", "gear = 1", "--compare", "a-2", "a-1"), "no effect"),
        (("--where", "x = 1", "--export", "x.parquet"), "no column 'x'"),
    ],
)
def test_wrong_input_ends_with_its_reason(season, monkeypatch, capsys, arguments, words):
    status, _, err = run(monkeypatch, capsys, "runs", ".", *arguments)
    assert status == 2
    assert words in err
    assert "Traceback" not in err


def test_an_empty_folder_and_a_filter_that_nothing_fits_say_so(season, monkeypatch, capsys):
    (season / "empty").mkdir()
    assert "no run below" in run(monkeypatch, capsys, "runs", "empty")[1]
    assert "no run fits" in run(monkeypatch, capsys, "runs", ".", "--where", "gear = 99")[1]


def test_an_export_says_how_many_runs(season, monkeypatch, capsys):
    status, out, _ = run(monkeypatch, capsys, "runs", ".", "--export", "x.parquet")
    assert (status, out) == (0, "5 rows: x.parquet\n")


def test_a_narrow_terminal_has_the_columns_that_fit_and_the_names_of_the_others(
    season, monkeypatch, capsys
):
    monkeypatch.setenv("TTY_COMPATIBLE", "1")
    monkeypatch.setenv("NO_COLOR", "1")
    monkeypatch.setenv("COLUMNS", "60")
    _, out, _ = run(monkeypatch, capsys, "runs", ".", "--where", "kind = 'run'")
    plain = re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", out)
    table, _, rest = plain.partition("no room for: ")
    assert "excitation" in rest
    assert "name" in table
    assert max(map(len, table.splitlines())) <= 60
