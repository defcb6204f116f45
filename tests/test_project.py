"""The project keeps its own rules: style, types, imports, versions and documents."""

import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from tests.imports import ALLOWED, PACKAGES, breaches
from tests.paths import ROOT

PROGRAMS = Path(sys.executable).parent


def run(*command: str | Path, where: Path = ROOT) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(
        [PROGRAMS / command[0], *command[1:]],
        cwd=where,
        check=False,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )


@pytest.mark.parametrize(
    "command",
    [
        ("ruff", "check", "."),
        ("ruff", "format", "--check", "."),
        ("mypy", "-p", "slipbench", "-p", "tests.bench.bus", "-p", "tests.socketcan"),
        ("lint-imports", "--no-cache"),
    ],
    ids=" ".join,
)
def test_the_checkers_have_nothing_to_say(command: tuple[str, ...]) -> None:
    said = run(*command)
    assert said.returncode == 0, said.stdout


def test_every_library_is_imported_only_where_it_belongs() -> None:
    assert breaches(ROOT) == []


@pytest.mark.parametrize("library", sorted(ALLOWED))
def test_a_library_in_the_wrong_place_is_found(tmp_path: Path, library: str) -> None:
    (tmp_path / "controllers").mkdir()
    path = tmp_path / "dbc" / "inner" / "wrong.py"
    path.parent.mkdir(parents=True)
    path.write_text(f"def late() -> None:\n    import {library}.part\n", encoding="utf-8")
    assert breaches(tmp_path) == [f"dbc/inner/wrong.py:2 imports {library}"]


@pytest.mark.parametrize(
    ("importer", "imported", "contract"),
    [
        ("bench.loop.loop", "identification", "Users meet only on disk"),
        ("identification.words", "bench", "Users meet only on disk"),
        ("identification.signals", "identification.models", "From signals to answers"),
        ("protocol.codec.codec", "plant", "Users meet only on disk"),
        ("plant.wheel", "protocol", "Users meet only on disk"),
        ("controllers.slip", "plant", "Users meet only on disk"),
        ("protocol.codec.codec", "bench", "Users meet only on disk"),
        ("dbc.check", "protocol", "Users meet only on disk"),
        ("identification.words", "dbc", "The database is for those who are on the wire"),
        ("identification.mismatch.fit", "studies.blind_validation", "Users meet only on disk"),
        ("identification.mismatch.fit", "identification.mismatch.naming", "From what is simulated"),
        (
            "identification.mismatch.simulation",
            "identification.mismatch.motorcycle",
            "From what is simulated",
        ),
        ("studies.blind_validation.generator.ride", "plant", "The proof's generator knows neither"),
        (
            "studies.blind_validation.generator.ride",
            "identification.mismatch",
            "The proof's generator knows neither",
        ),
        ("bench.gateway.gateway", "plant", "In the bench only the virtual motorcycle"),
        ("bench.safety.permit", "controllers", "The safety gate knows neither"),
        ("bench.safety.trial", "bench.gateway.slip_control", "The safety gate knows neither"),
        ("bench.gateway.gateway", "command", "Nobody imports the tests"),
        ("plant.wheel", "command", "Nobody imports the tests"),
    ],
)
def test_an_import_against_the_contract_breaks_it(
    tmp_path: Path, importer: str, imported: str, contract: str
) -> None:
    lay_out(tmp_path, importer, imported)
    said = run("lint-imports", "--no-cache", where=tmp_path)
    assert said.returncode == 1, said.stdout
    assert re.search(rf"{contract}.* BROKEN", said.stdout), said.stdout


def test_imports_within_the_contract_keep_it(tmp_path: Path) -> None:
    lay_out(tmp_path, "bench.vehicle.virtual_motorcycle", "plant")
    said = run("lint-imports", "--no-cache", where=tmp_path)
    assert said.returncode == 0, said.stdout


def lay_out(root: Path, importer: str, imported: str) -> None:
    """Make a project of empty modules with our names and contracts, and one import."""
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    contracts = text[text.index("[tool.importlinter]") :]
    (root / "pyproject.toml").write_text(contracts, encoding="utf-8")
    (root / "slipbench").mkdir()
    for name in ("__init__.py", "command.py"):
        (root / "slipbench" / name).touch()
    for package in PACKAGES:
        for file in (ROOT / package).rglob("*.py"):
            made = root / "slipbench" / file.relative_to(ROOT)
            made.parent.mkdir(parents=True, exist_ok=True)
            made.touch()
    path = root / "slipbench" / Path(*importer.split("."))
    path = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    path.write_text(f"import slipbench.{imported}\n", encoding="utf-8")


def test_the_lock_satisfies_the_project() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"]
    wanted = [*project["dependencies"], *(one for extra in extras.values() for one in extra)]
    locked = dict(locked_versions())
    for requirement in map(Requirement, wanted):
        if requirement.name == "slipbench":  # an extra made of extras
            assert requirement.extras < set(extras)
            continue
        version = locked.get(requirement.name.lower())
        assert version, f"{requirement} is not in requirements.lock; run: make lock"
        assert requirement.specifier.contains(version), f"{requirement}, locked {version}"


def test_the_lock_names_versions_and_hashes_and_no_place_to_fetch_from() -> None:
    text = (ROOT / "requirements.lock").read_text(encoding="utf-8")
    marker = r"( ; [\w .<>=!*'\"()]+)?"  # a library that some Pythons or machines need
    pin, hashed = rf"[a-z0-9.-]+==[\w.+!]+{marker} \\", r"    --hash=sha256:[0-9a-f]{64}( \\)?"
    strange = [
        line
        for line in text.splitlines()
        if line and not re.fullmatch(rf"{pin}|{hashed}|\s*#.*", line)
    ]
    assert strange == []


def locked_versions() -> Iterator[tuple[str, str]]:
    text = (ROOT / "requirements.lock").read_text(encoding="utf-8")
    yield from re.findall(r"^([a-z0-9.-]+)==(\S+)", text, re.MULTILINE)
