"""What pip installs: one import package with every data file, which runs beside a user's own code.

The environment is clean: it holds the wheel alone, and sees the libraries of the environment that
runs the tests. Nothing here uses the network.
"""

import os
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import venv
import zipfile
from pathlib import Path

import pytest

from slipbench.protocol.extras import EXTRA_OF
from tests.imports import PACKAGES
from tests.paths import ROOT

SOURCES = ("pyproject.toml", "LICENSE", "README.md", "src", *PACKAGES)
NOT_SOURCES = shutil.ignore_patterns("__pycache__", "*.egg-info", "*.pyc", "*.nbi", "*.nbc")
LIBRARIES = sysconfig.get_path("purelib")

BUILD = """
import sys
from setuptools import build_meta
print(getattr(build_meta, sys.argv[1])(sys.argv[2]))
"""
USERS_OWN = 'OURS = "the user\'s own package"\n'
USERS_TEST = """
import can
import bench
import protocol

def test_two_nodes_on_the_virtual_bus():
    assert bench.OURS == protocol.OURS == "the user's own package"
    address = dict(interface="slipbench", channel="test-package")
    with can.Bus(**address) as one, can.Bus(**address) as other:
        one.send(can.Message(arbitration_id=0x123, data=b"abc", is_extended_id=False))
        received = other.recv(10.0)
    assert received is not None and bytes(received.data) == b"abc"

def test_a_measurement(measure):
    measure("time", 1.0, "ms", at_most=2.0, requirement="SAF-1")
"""
# No library of an extra can be imported, as on a laptop with the base installation.
BASE_ONLY = f"import sys\nsys.modules.update(dict.fromkeys({sorted(EXTRA_OF)}))\n"


def run(*command: str | Path, where: Path) -> str:
    done = subprocess.run(
        [*command],
        cwd=where,
        env={k: v for k, v in os.environ.items() if k != "PYTHONPATH"},
        check=False,
        text=True,
        capture_output=True,
    )
    assert done.returncode == 0, f"{command}: {done.returncode}\n{done.stdout}{done.stderr}"
    return done.stdout


def build(tree: Path, kind: str, out: Path) -> Path:
    """Build a distribution of a source tree; returns the archive."""
    printed = run(sys.executable, "-c", BUILD, f"build_{kind}", out, where=tree)
    return out / printed.splitlines()[-1]


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a copy of the files that a distribution is made of."""
    tree = tmp_path_factory.mktemp("tree")
    for name in SOURCES:
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, tree / name, symlinks=True, ignore=NOT_SOURCES)
        else:
            shutil.copy(ROOT / name, tree / name)
    return tree


@pytest.fixture(scope="module")
def wheel(tree: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the wheel that is built from the source distribution, as an installer does."""
    out = tmp_path_factory.mktemp("distributions")
    with tarfile.open(build(tree, "sdist", out)) as archive:
        archive.extractall(out, filter="data")
    unpacked = next(path for path in out.iterdir() if path.is_dir())
    return build(unpacked, "wheel", out)


@pytest.fixture(scope="module")
def environment(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return an environment into which only the wheel is installed."""
    folder = tmp_path_factory.mktemp("environment")
    venv.create(folder, with_pip=False, symlinks=True)
    pip = (sys.executable, "-m", "pip", "--python", folder / "bin" / "python")
    quiet = ("--quiet", "--disable-pip-version-check")
    run(*pip, "install", *quiet, "--no-deps", "--no-index", wheel, where=folder)
    return folder


def installed_in(environment: Path) -> Path:
    return next(environment.glob("lib/python*/site-packages"))


@pytest.fixture(scope="module")
def users_folder(environment: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a user's own packages `bench`, `protocol` and `tests`."""
    (installed_in(environment) / "libraries.pth").write_text(LIBRARIES + "\n", encoding="utf-8")
    folder = tmp_path_factory.mktemp("users_folder")
    for package in ("bench", "protocol", "tests"):
        (folder / package).mkdir()
        (folder / package / "__init__.py").write_text(USERS_OWN, encoding="utf-8")
    (folder / "tests" / "test_bus.py").write_text(USERS_TEST, encoding="utf-8")
    return folder


def files_of(wheel: Path) -> set[str]:
    return {name for name in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in name}


def test_the_wheel_holds_every_file_of_the_packages(wheel: Path, tree: Path) -> None:
    there = {
        f"slipbench/{path.relative_to(tree)}"
        for package in PACKAGES
        for path in (tree / package).rglob("*")
        if path.is_file()
    }
    own = {path.name for path in (tree / "src/slipbench").iterdir() if path.is_file()}
    below = {
        str(path.relative_to(tree / "src"))
        for folder in (tree / "src/slipbench").iterdir()
        if folder.is_dir() and not folder.is_symlink()
        for path in folder.rglob("*")
        if path.is_file()
    }
    assert files_of(wheel) == there | below | {f"slipbench/{name}" for name in own}


def test_a_wheel_from_the_tree_and_one_from_the_source_distribution_are_the_same(
    wheel: Path, tree: Path, tmp_path: Path
) -> None:
    assert files_of(build(tree, "wheel", tmp_path)) == files_of(wheel)


def test_slipbench_is_the_only_import_package_that_is_installed(environment: Path) -> None:
    names = {path.name for path in installed_in(environment).iterdir()} - {"libraries.pth"}
    assert {name for name in names if not name.endswith(".dist-info")} == {"slipbench"}


def test_beside_the_users_own_packages_a_trial_is_run_and_identified_without_extras(
    environment: Path, users_folder: Path
) -> None:
    (installed_in(environment) / "sitecustomize.py").write_text(BASE_ONLY, encoding="utf-8")
    command = environment / "bin" / "slipbench"
    package = installed_in(environment) / "slipbench"
    text = (package / "examples/trials/throttle_sweep.toml").read_text(encoding="utf-8")
    vehicle = package / "plant/vehicles/demonstration.toml"
    text = text.replace("../../plant/vehicles/demonstration.toml", str(vehicle))
    (users_folder / "sweep.toml").write_text(text.replace('"30 s"', '"8 s"'), encoding="utf-8")
    folder = run(command, "trial", "sweep.toml", where=users_folder).strip()
    run(command, "identify", folder, where=users_folder)
    assert (users_folder / folder / "report.html").exists()
    assert "held-out" in run(command, "explain", "--help", where=users_folder)
    (installed_in(environment) / "sitecustomize.py").unlink()


def test_beside_the_users_own_packages_pytest_opens_the_virtual_bus_and_has_the_fixtures(
    environment: Path, users_folder: Path
) -> None:
    pytest_ = (environment / "bin" / "python", "-m", "pytest", "-q", "-p", "no:cacheprovider")
    printed = run(*pytest_, "tests", where=users_folder)
    assert "2 passed" in printed
    assert "SAF-1: passed" in printed
