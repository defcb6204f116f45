"""The command `export-fmu`: what it writes, and what it refuses."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from slipbench.command import app
from slipbench.fmu_check import require_valid
from slipbench.plant.fmu import library
from slipbench.protocol.errors import InputError


def export(*arguments: str | Path) -> str:
    done = CliRunner().invoke(app, ["export-fmu", *map(str, arguments)], catch_exceptions=False)
    return done.output


def test_it_writes_a_checked_fmu_and_the_file_beside_it(headers: Path, tmp_path: Path) -> None:
    out = tmp_path / "motorcycle.fmu"
    said = export("demonstration", "--out", out)
    require_valid(out)
    assert "deviate from the plant by at most" in said
    assert "act in a sensor: tooth_misplacement" in said
    assert out.with_suffix(".toml").exists()
    with pytest.raises(InputError, match="nothing is overwritten"):
        export("demonstration", "--out", out)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("--gear", "9"), "no such gear"),
        (("--engine-speed", "40000 rpm"), "cannot start there"),
        (("--engine-speed", "40 m"), "not a quantity"),
        (("--step", "0.3 ms"), "internal step cannot be used"),
        (("--step", "-1 ms"), "internal step cannot be used"),
    ],
)
def test_what_cannot_be_exported_is_refused(
    headers: Path, tmp_path: Path, arguments: tuple[str, ...], sentence: str
) -> None:
    with pytest.raises(InputError, match=sentence):
        export("nominal", "--out", tmp_path / "one.fmu", *arguments)
    assert not list(tmp_path.iterdir())


def test_a_path_that_cannot_be_written_is_refused(headers: Path) -> None:
    with pytest.raises(InputError, match="cannot be written"):
        export("demonstration", "--out", "/proc/motorcycle.fmu")


def test_a_missing_compiler_is_said_with_the_command_that_installs_one(
    headers: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr(library, "find_spec", lambda _: None)
    with pytest.raises(InputError, match=r"there is none(.|\n)*apt install gcc"):
        export("demonstration", "--out", tmp_path / "one.fmu")


def test_a_compiler_that_fails_is_quoted(
    headers: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    broken = tmp_path / "cc"
    broken.write_text("#!/bin/sh\necho 'no space left for headers' >&2\nexit 1\n")
    broken.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    with pytest.raises(InputError, match="no space left for headers"):
        export("demonstration", "--out", tmp_path / "one.fmu")
