"""Short recordings of the virtual motorcycle for tests of the view."""

from pathlib import Path

import tomli_w

from slipbench.bench.trials.preparation import prepare
from slipbench.bench.trials.run import run_trial
from slipbench.protocol.configuration import load_toml
from tests.paths import DEMONSTRATION, TRIALS


def short_trial(folder: Path, duration: str = "3 s", **tables: dict) -> Path:
    """Write the shipped throttle sweep with a shorter excitation and changed tables."""
    tree = load_toml(TRIALS / "throttle_sweep.toml")
    tree["vehicle"] = str(DEMONSTRATION)
    tree["excitation"] |= {"duration": duration, "start": "1 Hz", "stop": "6 Hz"}
    for name, changes in tables.items():
        tree[name] = {**tree.get(name, {}), **changes}
    path = folder / "short.toml"
    path.write_text(tomli_w.dumps(tree))
    return path


def recorded(folder: Path, **tables: dict) -> Path:
    """Run folder of a short trial on the simulated clock."""
    run = folder / "run"
    run_trial(prepare(short_trial(folder, **tables)), run, None)
    return run
