"""Short session plans for tests."""

from pathlib import Path

import tomli_w

from slipbench.protocol.configuration import load_toml
from tests.paths import DEMONSTRATION, TRIALS

EXCITATION = {
    "actuator": "throttle",
    "waveform": "linear_sweep",
    "amplitude": "2 %",
    "start": "1 Hz",
    "stop": "6 Hz",
    "duration": "3 s",
}
SHORT = {"name": "sweep", "file": "throttle_sweep", "repeats": 1, "excitation": EXCITATION}


def plan_file(folder: Path, *trials: dict, **changes: object) -> Path:
    """Write a plan of these trials; each is SHORT with its changes, None removes a key."""
    rows = [{**SHORT, **trial} for trial in trials or ({},)]
    rows = [{key: value for key, value in row.items() if value is not None} for row in rows]
    tree = {"name": "day", "trial": rows, **changes}
    path = folder / "plan.toml"
    path.write_text(tomli_w.dumps(tree))
    return path


def trial_file(folder: Path, **tables: dict) -> str:
    """Write the shipped throttle sweep with other keys in these tables, and return its name."""
    tree = load_toml(TRIALS / "throttle_sweep.toml")
    tree["vehicle"] = str(DEMONSTRATION)
    for name, changes in tables.items():
        tree[name] = {**tree.get(name, {}), **changes}
    (folder / "base.toml").write_text(tomli_w.dumps(tree))
    return "base.toml"
