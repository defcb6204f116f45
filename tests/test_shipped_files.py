"""A file that ships with slipbench is found by its name; a path is never replaced by another."""

import sys
from pathlib import Path

import pytest

from slipbench import command
from slipbench.bench.trials.preparation import prepare
from slipbench.dbc import MOTORBIKE
from slipbench.identification.fleet.fleet_file import read_fleet
from slipbench.protocol.errors import InputError
from slipbench.protocol.shipped_files import (
    PATTERNS,
    completion_of,
    file_or_shipped,
    is_shipped,
    shipped_files,
)
from tests.paths import ROOT, TRIALS, with_full_paths


@pytest.mark.parametrize("kind", sorted(PATTERNS))
def test_every_shipped_file_of_a_kind_is_found_by_its_name(kind: str) -> None:
    known = shipped_files(kind)
    assert known
    for name, path in known.items():
        assert file_or_shipped(name, kind) == path
        assert path.is_file()
        assert is_shipped(path)


def test_the_kinds_cover_every_example() -> None:
    there = {path.resolve() for path in (ROOT / "examples").rglob("*.toml")}
    found = {path.resolve() for kind in PATTERNS for path in shipped_files(kind).values()}
    assert there <= found


def test_a_file_of_the_user_goes_before_a_shipped_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("throttle_sweep").touch()
    assert file_or_shipped("throttle_sweep", "trial") == Path("throttle_sweep")
    assert not is_shipped(Path("throttle_sweep"))


@pytest.mark.parametrize(
    ("name", "kind", "message"),
    [
        ("trials/throttle_sweep.toml", "trial", "write throttle_sweep"),
        ("throttle_sweep.toml", "trial", "write throttle_sweep"),
        ("motorbike.dbc", "database", "write motorbike"),
        ("throtle_sweep", "trial", "one of .*throttle_sweep"),
        ("demonstration", "trial", "ships no trial of this name"),
    ],
)
def test_a_missing_path_names_the_shipped_file_and_never_takes_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, kind: str, message: str
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=message):
        file_or_shipped(name, kind)


@pytest.mark.parametrize("name", ["nothing.toml", "a/b", "\0", "x.y" * 100, "", ".."])
def test_any_other_missing_path_is_left_to_its_reader(name: str) -> None:
    assert file_or_shipped(name, "trial") == Path(name)


def test_a_trial_file_names_its_vehicle_and_controller(tmp_path: Path) -> None:
    text = (TRIALS / "slip_steps_mixed.toml").read_text(encoding="utf-8")
    path = tmp_path / "trial.toml"
    path.write_text(
        text.replace("../../plant/vehicles/demonstration.toml", "demonstration").replace(
            "../controllers/mixed.toml", "mixed"
        ),
        encoding="utf-8",
    )
    by_name = prepare(path, MOTORBIKE)
    path.write_text(with_full_paths(text.replace("../../plant", str(ROOT / "plant"))), "utf-8")
    by_path = prepare(path, MOTORBIKE)
    assert by_name.vehicle_path == by_path.vehicle_path
    assert by_name.controller_path == by_path.controller_path


def test_a_fleet_file_names_its_vehicle(tmp_path: Path) -> None:
    path = tmp_path / "fleet.toml"
    path.write_text('[[analyses]]\nname = "one"\nvehicle = "nominal"\ntraining = ["runs/a"]\n')
    assert Path(read_fleet(path)[0].vehicle).is_file()


@pytest.mark.parametrize(
    ("arguments", "names"),
    [
        (("trial", "no_trial"), "throttle_sweep"),
        (("trial", "throttle_sweep", "--dbc", "no_database"), "motorbike"),
        (("vehicle", "no_trial", "--interface", "slipbench"), "throttle_sweep"),
        (("decode", "x.log", "--dbc", "no_database", "--out", "x.csv"), "motorbike"),
        (("import", "x.log", "--roles", "no_roles", "--out", "x"), "subaru_wrx"),
        (("compare", "no_controller", "--page", "x.html"), "mixed"),
        (("compare", "mixed", "--page", "x.html", "--vehicle", "none"), "demonstration"),
        (("explain", "run", "--vehicle", "no_vehicle"), "nominal"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else value,
)
def test_every_command_that_takes_such_a_file_finds_it_by_name(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: tuple[str, ...],
    names: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["slipbench", *arguments])
    with pytest.raises(SystemExit) as end:
        command.main()
    assert end.value.code == 2
    assert names in capsys.readouterr().err


def test_completion_offers_local_paths_and_shipped_names(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("throats").mkdir()
    Path("throats/one.toml").touch()
    Path("thr.toml").touch()
    complete = completion_of("trial")
    assert {"throats/", "thr.toml", "throttle_sweep"} <= set(complete("thr"))
    assert complete("throats/") == ["throats/one.toml"]
    assert complete("nowhere/") == []
