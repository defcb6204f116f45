"""`init`, `doctor`, `--version` and completion: what a new user runs first."""

import itertools
import os
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

import slipbench
from slipbench import command, doctor
from slipbench.bench.trials.preparation import prepare
from slipbench.init_folder import FOLDERS, init_folder
from slipbench.plant.vehicle_file import load_vehicle
from slipbench.protocol.configuration import read_toml
from slipbench.protocol.controller_file import ControllerFile
from slipbench.protocol.database.database import load_database
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.role_map import RoleMap
from slipbench.protocol.shipped_files import shipped_files
from tests.paths import DEMONSTRATION


def run(*arguments: str | Path) -> Result:
    return CliRunner().invoke(command.app, [str(one) for one in arguments])


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("init") / "my_bike"
    assert run("init", folder).exit_code == 0
    return folder


def test_every_trial_of_a_new_folder_is_ready_to_run_there(folder: Path) -> None:
    trials = sorted((folder / "trials").glob("*.toml"))
    assert {path.stem for path in trials} == {"my_trial", *shipped_files("trial")}
    for path in trials:
        prepared = prepare(path, folder / "database" / "motorbike.dbc")
        assert prepared.vehicle_path == (folder / "vehicles" / "motorcycle.toml").resolve()
        if prepared.controller_path:
            assert prepared.controller_path.is_relative_to(folder.resolve())


def test_a_trial_of_a_new_folder_runs(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    path = Path("trials/short.toml")
    text = Path("trials/my_trial.toml").read_text(encoding="utf-8")
    path.write_text(text.replace('"30 s"', '"1 s"'), encoding="utf-8")
    done = run("trial", path, "--dbc", "database/motorbike.dbc", "--out", "run")
    assert done.exit_code == 0, done.output
    path.unlink()


def test_the_files_of_a_new_folder_are_those_that_ship(folder: Path) -> None:
    for kind, name in FOLDERS.items():
        for path in shipped_files(kind).values():
            assert (folder / name / path.name).is_file()
    vehicle = load_vehicle(folder / "vehicles" / "motorcycle.toml")
    assert vehicle.motorcycle == load_vehicle(DEMONSTRATION).motorcycle
    for path in (folder / "controllers").glob("*.toml"):
        read_toml(path, ControllerFile)
    for path in (folder / "database").glob("*.dbc"):
        load_database(path)


def test_the_files_of_a_new_folder_name_its_own_databases(folder: Path) -> None:
    named = [
        (path, read_toml(path, RoleMap).database)
        for kind in ("roles", "bindings")
        for path in (folder / kind).glob("*.toml")
    ]
    databases = [(path.parent / database).resolve() for path, database in named if database]
    assert (folder / "database" / "superbike.dbc").resolve() in databases
    assert [path for path in databases if not path.is_file()] == []


def test_every_section_of_the_vehicle_file_has_a_comment(folder: Path) -> None:
    lines = (folder / "vehicles" / "motorcycle.toml").read_text(encoding="utf-8").splitlines()
    bare = [
        line
        for before, line in itertools.pairwise(lines)
        if line.startswith("[") and not line.startswith("[[") and not before.startswith("#")
    ]
    assert bare == []


def test_init_overwrites_nothing(folder: Path) -> None:
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    with pytest.raises(InputError, match="nothing was written"):
        init_folder(folder)
    assert before == {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_init_with_one_file_in_the_way_writes_nothing(tmp_path: Path) -> None:
    (tmp_path / "models").mkdir()
    (tmp_path / "models" / "silverbox.toml").write_text("mine")
    with pytest.raises(InputError, match=r"models/silverbox\.toml"):
        init_folder(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["models"]


@pytest.mark.parametrize("name", ["file/inside", "x" * 300, "\0"])
def test_a_folder_that_cannot_be_made_is_a_message(tmp_path: Path, name: str) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(InputError):
        init_folder(tmp_path / name)


def test_version_is_that_of_the_installed_package() -> None:
    assert run("--version").output == f"slipbench {version('slipbench')}\n"
    assert slipbench.__version__ == version("slipbench")
    assert "__version__" in dir(slipbench)


def test_doctor_finds_no_error_where_the_tests_run() -> None:
    done = run("doctor")
    assert done.exit_code == 0, done.output
    for topic in ("versions", "libraries", "kernel CAN", "real-time scheduling", "locked memory"):
        assert f"{topic}: " in done.output


def test_every_check_that_is_not_ok_says_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    def poor(_: str) -> float:
        return 0.0

    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    monkeypatch.setattr(doctor, "_limit", poor)
    monkeypatch.setattr(doctor, "one_processor", lambda: True)
    monkeypatch.setattr(doctor, "_version", lambda _: "")
    monkeypatch.setattr(doctor, "find_spec", lambda _: None)
    monkeypatch.setattr(doctor, "version", lambda _: "0")
    monkeypatch.setattr(doctor, "LEAST_SPACE", float("inf"))
    monkeypatch.setattr(doctor, "_can_devices", lambda: iter([("can0", "down")]))
    found = {check.topic: check for check in doctor.checks()}
    assert found["libraries"].state == "error"
    assert "rtprio" in found["real-time scheduling"].remedy
    assert "memlock unlimited" in found["locked memory"].remedy
    assert "ulimit -n" in found["open files"].remedy
    assert found["processors"].state == found["disk space here"].state == "warning"
    assert found["interface can0"].remedy == "sudo ip link set can0 up type can bitrate 1000000"
    assert found["slipbench[mdf]"].remedy == "pip install 'slipbench[mdf]'"
    assert all(one.remedy for one in found.values() if one.state in ("warning", "error"))


def test_doctor_ends_with_status_2_where_no_trial_can_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("SLIPBENCH_CACHE", str(tmp_path / "file" / "inside"))
    done = run("doctor")
    assert done.exit_code == 2
    assert "set SLIPBENCH_CACHE to a folder that can be written" in done.output


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_shell_completes_commands_and_shipped_names(shell: str) -> None:
    words = {"bash": ("COMP_WORDS", "slipbench trial thr"), "zsh": ("_TYPER_COMPLETE_ARGS",) * 2}
    name, line = words.get(shell, ("_TYPER_COMPLETE_ARGS", ""))
    environment = {
        **os.environ,
        "_SLIPBENCH_COMPLETE": f"complete_{shell}",
        name: "slipbench trial thr" if shell != "bash" else line,
        "COMP_CWORD": "2",
        "_TYPER_COMPLETE_FISH_ACTION": "get-args",
    }
    code = "import sys; sys.argv = ['slipbench']; from slipbench.command import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, text=True, capture_output=True, check=False
    )
    assert "throttle_sweep" in done.stdout, done.stderr
