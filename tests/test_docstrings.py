"""Every public function states its arrays' shapes or units, and the errors that it raises."""

import inspect
from pathlib import Path
from typing import Any

import pytest

import slipbench
from slipbench.bench.trials.outcome import Outcome
from slipbench.identification.models.rational_model import RationalModel
from slipbench.identification.models.study import Study
from slipbench.identification.response.identify import Identification
from slipbench.identification.response.response import FrequencyResponse
from slipbench.protocol.logs.decoded_log import DecodedLog
from slipbench.protocol.recording.channel import Channel
from tests.docstring_rules import PACKAGES, faults, functions
from tests.paths import ROOT

# Directories whose docstrings are complete. The list ends as PACKAGES and "src/slipbench".
CLEAN: tuple[str, ...] = (
    "bench/bus",
    "bench/testing",
    "bench/commands.py",
    "bench/loop",
    "bench/replay",
    "bench/vehicle",
    "bench/gateway",
    "bench/safety",
    "bench/trials",
    "controllers",
    "identification",
    "plant",
    "protocol/export",
    "protocol/logs",
    "protocol/recording",
    "protocol/tables",
    "protocol/codec",
    "protocol/database",
    "src/slipbench",
    "studies",
)


@pytest.mark.parametrize("directory", CLEAN)
def test_public_functions_state_shapes_units_and_errors(directory: str) -> None:
    assert faults(ROOT, directory) == []


def test_what_the_public_interface_reaches_states_it_too() -> None:
    """Functions, classes and the methods of classes in `slipbench.__all__`, wherever they are."""
    reached = {getattr(slipbench, name) for name in slipbench.__all__}
    reached |= {
        Outcome,
        Identification,
        FrequencyResponse,
        Study,
        RationalModel,
        DecodedLog,
        Channel,
    }
    owners = {(path_of(each), each.__name__) for each in reached}
    found = [
        fault
        for function in functions(ROOT, *(path for path, _ in owners))
        if (function.path, function.name.partition(".")[0]) in owners
        for fault in function.faults()
    ]
    assert found == []


def path_of(public: Any) -> str:
    """Path of the module that defines a public name, relative to the repository."""
    return Path(inspect.getfile(public)).resolve().relative_to(ROOT).as_posix()


HEAD = "import numpy as np\nimport numpy.typing as npt\nFloats = npt.NDArray[np.float64]\n"


@pytest.mark.parametrize(
    ("source", "fault"),
    [
        ('def f(t: Floats) -> float:\n    """Mean speed."""\n', "f: states neither shape nor unit"),
        (
            'def f() -> npt.NDArray[np.bool_]:\n    """What s is. A m."""\n',
            "neither shape nor unit",
        ),
        ('def f(t: Floats) -> float:\n    """Number of frames."""\n', "neither shape nor unit"),
        ('def f(t: Floats) -> float:\n    """Mean speed in m/s."""\n', ""),
        ('def f(t: Floats) -> float:\n    """Mean speed. t: s."""\n', ""),
        ('def f(t: Floats) -> float:\n    """Largest of the values, (n, 2)."""\n', ""),
        ('def _f(t: Floats) -> float:\n    """Mean speed."""\n', ""),
        (
            'def f() -> None:\n    """Check."""\n    if f:\n        raise ValueError("no")\n',
            "f: does not say that it raises ValueError",
        ),
        (
            'def f() -> None:\n    """Check. Raises KeyError."""\n    raise ValueError("no")\n',
            "f: does not say that it raises ValueError",
        ),
        ('def f() -> None:\n    """Check. Raises ValueError."""\n    raise ValueError("no")\n', ""),
        (
            'class B:\n    def f(self, t: Floats) -> None:\n        """Take t in s."""\n\n'
            "class C(B):\n    def f(self, t: Floats) -> None:\n        pass\n",
            "",
        ),
        (
            'class C:\n    def f(self) -> Floats:\n        """Speed."""\n',
            "C.f: states neither shape nor unit",
        ),
    ],
)
def test_the_rules_find_what_is_missing_and_nothing_else(
    tmp_path: Path, source: str, fault: str
) -> None:
    for package in PACKAGES:
        (tmp_path / package).mkdir()
    (tmp_path / "plant" / "module.py").write_text(HEAD + source, encoding="utf-8")
    found = "\n".join(faults(tmp_path, "plant"))
    assert fault in found if fault else found == ""
