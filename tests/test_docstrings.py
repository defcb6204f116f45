"""Every public function states its arrays' shapes or units, and the errors that it raises."""

from pathlib import Path

import pytest

from tests.docstring_rules import PACKAGES, faults
from tests.paths import ROOT

# Directories whose docstrings are complete. The list ends as PACKAGES and "src/slipbench".
CLEAN: tuple[str, ...] = (
    "controllers",
    "identification/models",
    "identification/response",
    "identification/signals",
    "plant",
    "src/slipbench",
)


@pytest.mark.parametrize("directory", CLEAN)
def test_public_functions_state_shapes_units_and_errors(directory: str) -> None:
    assert faults(ROOT, directory) == []


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
