"""A designed trial as a trial file, and what it is expected to distinguish, in sentences."""

import math
import os
from pathlib import Path
from typing import Any

from slipbench.identification.experiments.bounds import riding_seconds
from slipbench.identification.experiments.hypothesis import NOTHING
from slipbench.identification.experiments.reading import BaseTrial
from slipbench.identification.experiments.search import Designed
from slipbench.identification.mismatch.motorcycle.menu import RPM, excitation_table
from slipbench.protocol.straight import WINDOW

NAME = "next_trial"
KEPT = ("seed", "command", "timing", "limits")
"""Tables of the base trial that the designed one has too."""


def trial_of(designed: Designed, base: BaseTrial, distance: float, folder: Path) -> dict[str, Any]:
    """Content of the trial file, which will lie in a folder.

    Its limits are those of the base trial, word by word; only the distance may be shorter. distance:
    m, from the button to where the rider has to brake.
    """
    choice, tree = designed.choice, base.tree
    rpm = choice.engine_speed / RPM
    found: dict[str, Any] = {
        "name": NAME,
        "description": sentence(designed),
        "vehicle": os.path.relpath(base.vehicle.resolve(), folder.resolve()),
        "operating_point": {
            "gear": choice.gear,
            "engine_speed": f"{rpm:.0f} rpm",
            "engine_speed_window": f"{WINDOW * rpm:.0f} rpm",
            "steady_for": "500 ms",
        },
        "excitation": excitation_table(choice),
    }
    found |= {key: tree[key] for key in KEPT if key in tree}
    allowed = min(distance, float(base.trial.limits.distance))
    found["limits"] = {**found["limits"], "distance": f"{math.floor(allowed)} m"}
    return found


def sentence(designed: Designed) -> str:
    """The trial, the hypotheses that it will distinguish, and the expected evidence."""
    choice, pairs = designed.choice, "; ".join(_pairs(designed))
    return (
        f"{str(choice)[0].upper()}{str(choice)[1:]}, {choice.seconds:g} s: {pairs};"
        f" {riding_seconds(choice):.0f} s on the straight"
    )


def _pairs(designed: Designed) -> list[str]:
    """Each pair with its nats, expected log-likelihood ratio; the strongest first."""
    by_nats = sorted(designed.evidence.nats.items(), key=lambda item: -item[1])
    return [
        f"{_distinguished(*pair)} (expected log-likelihood ratio {n:.3g} nats)"
        for pair, n in by_nats
    ]


def _distinguished(a: str, b: str) -> str:
    a, b = a.replace("_", " "), b.replace("_", " ")
    if NOTHING in (a, b):
        return f"shows whether there is {b if a == NOTHING else a}"
    return f"tells {a} from {b}"
