"""An uncertainty set as a TOML file, so that controllers can use it without identification.

    write(found, Path("slip_from_throttle.toml")); read(Path("slip_from_throttle.toml"))

SI throughout; a complex number is a pair, real part first; what was not measured is nan.
"""

from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from slipbench.identification.models.rational_model import RationalModel
from slipbench.identification.models.uncertainty_set import UncertaintySet, Weight
from slipbench.identification.response.response import ComplexArray
from slipbench.protocol.configuration import load_toml


def write(found: UncertaintySet, path: Path) -> None:
    """Write a set as TOML, in SI."""
    path.write_text(tomli_w.dumps(_told(found)), encoding="utf-8")


def read(path: Path) -> UncertaintySet:
    """Uncertainty set of a file. Raises InputError without a file, KeyError for other content."""
    table = load_toml(path)
    nominal, weight = table["nominal"], table["weight"]
    return UncertaintySet(
        RationalModel(
            nominal["input"],
            nominal["output"],
            _complex(nominal["zeros"]),
            _complex(nominal["poles"]),
            nominal["gain"],
            nominal["delay"],
        ),
        Weight(weight["gain"], np.array(weight["sections"])),
        np.array(table["frequency"]),
        np.array(table["bound"]),
        {name: _complex(pairs) for name, pairs in table["members"].items()},
    )


def _told(found: UncertaintySet) -> dict[str, Any]:
    g, w = found.nominal, found.weight
    return {
        "frequency": found.frequency.tolist(),
        "bound": found.bound.tolist(),
        "nominal": {
            "input": g.input,
            "output": g.output,
            "gain": float(g.gain),
            "delay": float(g.delay),
            "zeros": _pairs(g.zeros),
            "poles": _pairs(g.poles),
        },
        "weight": {"gain": float(w.gain), "sections": w.sections.tolist()},
        "members": {name: _pairs(value) for name, value in found.members.items()},
    }


def _pairs(value: ComplexArray) -> list[list[float]]:
    return [[float(v.real), float(v.imag)] for v in value]


def _complex(pairs: list[list[float]]) -> ComplexArray:
    return np.array([complex(*pair) for pair in pairs], dtype=np.complex128)
