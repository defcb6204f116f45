"""The folder of an analysis in which something was left open, made without the analysis."""

import json
import shutil
from pathlib import Path

from slipbench.bench.trials.preparation import prepare
from slipbench.bench.trials.run import run_trial
from slipbench.plant.vehicles import builtin_vehicle
from tests.bench.session.plans import trial_file

SHORT = {
    "waveform": "linear_sweep",
    "start": "0.5 Hz",
    "stop": "12 Hz",
    "duration": "4 s",
    "amplitude": "2 %",
}
LIMITS = {"engine_speed": ["9500 rpm", "13000 rpm"], "speed": ["36 m/s", "51 m/s"], "slip": "12 %"}
POINT = {"engine_speed": "11500 rpm"}


def analysis_folder(folder: Path, *questions: tuple[str, ...], **changes: object) -> Path:
    """Folder of an analysis of one recorded trial. changes: of hypotheses.json, None removes a key."""
    folder.mkdir(parents=True, exist_ok=True)
    trial = trial_file(folder, excitation=SHORT, limits=LIMITS, operating_point=POINT)
    run_trial(prepare(folder / trial), folder / "run", None)
    shutil.copyfile(builtin_vehicle("nominal"), folder / "v.improved.toml")
    tree = {
        "version": 1,
        "vehicle": "v.toml",
        "improved": "v.improved.toml",
        "runs": ["run"],
        "questions": [[{"effect": name, **_numbers(name)} for name in one] for one in questions],
        **changes,
    }
    known = {key: value for key, value in tree.items() if value is not None}
    (folder / "hypotheses.json").write_text(json.dumps(known))
    return folder


def _numbers(name: str) -> dict[str, object]:
    return {} if name == "nothing" else {"dials": [1.0, 0.0], "spread": 0.2}
