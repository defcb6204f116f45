"""Rules of the project: style, types, imports and locked versions."""

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


def run(*command: str | Path, folder: Path = ROOT) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(
        [PROGRAMS / command[0], *command[1:]],
        cwd=folder,
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
def test_style_types_and_import_contracts_hold(command: tuple[str, ...]) -> None:
    result = run(*command)
    assert result.returncode == 0, result.stdout


def test_each_library_is_imported_only_by_its_packages() -> None:
    assert breaches(ROOT) == []


@pytest.mark.parametrize("library", sorted(ALLOWED))
def test_a_library_imported_elsewhere_is_reported(tmp_path: Path, library: str) -> None:
    (tmp_path / "controllers").mkdir()
    path = tmp_path / "dbc" / "inner" / "wrong.py"
    path.parent.mkdir(parents=True)
    path.write_text(f"def late() -> None:\n    import {library}.part\n", encoding="utf-8")
    assert breaches(tmp_path) == [f"dbc/inner/wrong.py:2 imports {library}"]


@pytest.mark.parametrize(
    ("importer", "imported", "contract"),
    [
        ("bench.loop.loop", "identification", "Layers: bench and identification"),
        ("identification.words", "bench", "Layers: bench and identification"),
        ("identification.signals", "identification.models", "Layers of identification"),
        ("protocol.codec.codec", "plant", "Layers: bench and identification"),
        ("plant.wheel", "protocol", "Layers: bench and identification"),
        ("controllers.slip", "plant", "Layers: bench and identification"),
        ("protocol.codec.codec", "bench", "Layers: bench and identification"),
        ("dbc.check", "protocol", "Layers: bench and identification"),
        ("identification.words", "dbc", "Only the bench and protocol import"),
        (
            "identification.mismatch.fit",
            "studies.blind_validation",
            "Layers: bench and identification",
        ),
        (
            "identification.mismatch.fit",
            "identification.mismatch.naming",
            "Layers of the mismatch analysis",
        ),
        (
            "identification.mismatch.simulation",
            "identification.mismatch.motorcycle",
            "Layers of the mismatch analysis",
        ),
        (
            "studies.blind_validation.generator.ride",
            "plant",
            "The generator of hidden cases imports neither",
        ),
        (
            "studies.blind_validation.generator.ride",
            "identification.mismatch",
            "The generator of hidden cases imports neither",
        ),
        ("bench.gateway.gateway", "plant", "In the bench only the virtual motorcycle"),
        ("bench.safety.permit", "controllers", "The safety gate imports neither"),
        ("bench.safety.trial", "bench.gateway.slip_control", "The safety gate imports neither"),
        ("bench.gateway.gateway", "command", "No package imports the tests"),
        ("plant.wheel", "command", "No package imports the tests"),
    ],
)
def test_a_forbidden_import_breaks_its_contract(
    tmp_path: Path, importer: str, imported: str, contract: str
) -> None:
    make_project(tmp_path, importer, imported)
    result = run("lint-imports", "--no-cache", folder=tmp_path)
    assert result.returncode == 1, result.stdout
    assert re.search(rf"{contract}.* BROKEN", result.stdout), result.stdout


def test_an_allowed_import_keeps_all_contracts(tmp_path: Path) -> None:
    make_project(tmp_path, "bench.vehicle.virtual_motorcycle", "plant")
    result = run("lint-imports", "--no-cache", folder=tmp_path)
    assert result.returncode == 0, result.stdout


def make_project(root: Path, importer: str, imported: str) -> None:
    """Make a project of empty modules with the real names and contracts, and one import."""
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
    required = [*project["dependencies"], *(one for extra in extras.values() for one in extra)]
    locked = dict(locked_versions())
    for requirement in map(Requirement, required):
        if requirement.name == "slipbench":  # an extra made of extras
            assert requirement.extras < set(extras)
            continue
        version = locked.get(requirement.name.lower())
        assert version, f"{requirement} is not in requirements.lock; run: make lock"
        assert requirement.specifier.contains(version), f"{requirement}, locked {version}"


def test_the_lock_holds_versions_and_hashes_and_no_address() -> None:
    text = (ROOT / "requirements.lock").read_text(encoding="utf-8")
    marker = r"( ; [\w .<>=!*'\"()]+)?"  # a library that some Pythons or machines need
    pin, hashed = rf"[a-z0-9.-]+==[\w.+!]+{marker} \\", r"    --hash=sha256:[0-9a-f]{64}( \\)?"
    unexpected = [
        line
        for line in text.splitlines()
        if line and not re.fullmatch(rf"{pin}|{hashed}|\s*#.*", line)
    ]
    assert unexpected == []


def locked_versions() -> Iterator[tuple[str, str]]:
    text = (ROOT / "requirements.lock").read_text(encoding="utf-8")
    yield from re.findall(r"^([a-z0-9.-]+)==(\S+)", text, re.MULTILINE)
