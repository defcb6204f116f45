"""The base installation needs no library of an extra; a missing one is named with its command."""

import ast
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from importlib.metadata import requires
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from slipbench.identification.cluster import ALL_PROCESSORS, done_by
from slipbench.protocol.errors import InputError
from slipbench.protocol.extras import EXTRA_OF
from tests.imports import PACKAGES
from tests.paths import ROOT
from tests.protocol.recording.test_import import DBC, ROLES, drive

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
EXTRAS = PROJECT["optional-dependencies"]
OURS = sorted(path for package in (*PACKAGES, "src") for path in (ROOT / package).rglob("*.py"))

BASE_ONLY = """
import sys
for library in {hidden}:
    sys.modules[library] = None
from slipbench.command import main
sys.argv = ["slipbench", *sys.argv[1:]]
main()
"""


@pytest.mark.parametrize("library", sorted(EXTRA_OF))
def test_the_extra_that_is_named_installs_the_library(library: str) -> None:
    installed = {
        Requirement(one).name.removesuffix("-sdk") for one in EXTRAS[EXTRA_OF[library]]
    }  # foxglove-sdk is imported as foxglove
    assert library in installed | {"dask"}  # distributed depends on dask
    if library == "dask":
        assert any(Requirement(one).name == "dask" for one in requires("distributed") or ())


def test_the_base_installs_no_library_of_an_extra() -> None:
    base = {Requirement(one).name for one in PROJECT["dependencies"]}
    assert base.isdisjoint({*EXTRA_OF, "pandas", "lxml", "lz4"})


def test_no_file_imports_a_library_of_an_extra_by_itself() -> None:
    found = [
        f"{path.relative_to(ROOT)} imports {name}" for path in OURS for name in imports_of(path)
    ]
    assert [one for one in found if one.rpartition(" ")[2] in EXTRA_OF] == []


def imports_of(path: Path) -> Iterator[str]:
    """Yield the libraries that a file imports, except those for types only."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for_types = {
        id(inner)
        for node in ast.walk(tree)
        if isinstance(node, ast.If) and getattr(node.test, "id", "") == "TYPE_CHECKING"
        for inner in ast.walk(node)
    }
    for node in ast.walk(tree):
        if id(node) not in for_types:
            yield from (name.partition(".")[0] for name in imported(node))


def imported(node: ast.AST) -> list[str]:
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    return [node.module or ""] if isinstance(node, ast.ImportFrom) else []


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a log, a recording of it, and tables."""
    folder = tmp_path_factory.mktemp("extras")
    (folder / "drive.log").write_bytes(b"".join(drive()))
    (folder / "car.dbc").write_text(DBC)
    (folder / "roles.toml").write_text(ROLES)
    (folder / "one.csv").write_text("Time,u,y\n0,0,0\n0.1,1,2\n")
    (folder / "one.mf4").write_bytes(b"MDF     4.10    " + bytes(200))
    options = ("--dbc", "car.dbc", "--roles", "roles.toml", "--out", "run")
    done = base_only(folder, sorted(EXTRA_OF), "import", "drive.log", *options)
    assert done.returncode == 0, done.stderr
    return folder


def base_only(
    folder: Path, hidden: list[str], *arguments: str
) -> "subprocess.CompletedProcess[str]":
    """Run the command in a folder, with libraries hidden from it."""
    return subprocess.run(
        [sys.executable, "-c", BASE_ONLY.format(hidden=hidden), *arguments],
        cwd=folder,
        text=True,
        capture_output=True,
        check=False,
    )


@pytest.mark.parametrize(
    ("library", "arguments"),
    [
        ("pyarrow", ("decode", "drive.log", "--dbc", "car.dbc", "--out", "x.parquet")),
        ("pyarrow", ("decode", "drive.log", "--dbc", "car.dbc", "--out", "x.csv")),
        ("pyarrow", ("export", "run", "--format", "parquet")),
        ("pyarrow", ("export", "run", "--format", "asc")),
        ("pyarrow", ("model", "one.csv", "--input", "u", "--output", "y", "--out", "model")),
        ("duckdb", ("runs", ".")),
        ("asammdf", ("export", "run", "--format", "mf4")),
        ("asammdf", ("decode", "one.mf4", "--dbc", "car.dbc", "--out", "x.csv")),
        ("mcap", ("export", "run", "--format", "mcap")),
        ("starlette", ("trial", "throttle_sweep", "--view")),
        ("uvicorn", ("trial", "throttle_sweep", "--view-address", "127.0.0.1:0")),
        ("websockets", ("view", "run")),
    ],
    ids=lambda value: value if isinstance(value, str) else f"{value[0]} {value[-1]}",
)
def test_a_missing_library_is_named_with_the_command_that_installs_it(
    folder: Path, library: str, arguments: tuple[str, ...]
) -> None:
    done = base_only(folder, [library], *arguments)
    assert done.returncode == 2, done.stderr
    assert f"this needs {library}, which is not installed" in done.stderr
    assert f"remedy: pip install 'slipbench[{EXTRA_OF[library]}]'" in done.stderr
    assert "Traceback" not in done.stderr


def test_without_dask_jobs_in_parallel_name_its_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r"pip install 'slipbench\[cluster\]'"):
        list(done_by(ALL_PROCESSORS, abs, {"one": (1,)}))


IMPORT_ALL = """
import pkgutil, sys
sys.modules.update(dict.fromkeys({hidden}))
import slipbench
for module in pkgutil.walk_packages(slipbench.__path__, "slipbench."):
    if not module.name.endswith("__main__"):
        __import__(module.name)
"""


def test_every_module_can_be_imported_without_any_extra() -> None:
    code = IMPORT_ALL.format(hidden=sorted(EXTRA_OF))
    done = subprocess.run([sys.executable, "-c", code], text=True, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
