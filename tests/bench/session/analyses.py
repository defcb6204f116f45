"""`explain` in a session replaced by its files, so that a test takes seconds.

It does not imitate the analysis: the nominal vehicle is the improved one, and the questions are given.
"""

import json
import shutil
from pathlib import Path

from slipbench import session_explain
from slipbench.plant.vehicles import builtin_vehicle
from tests.bench.session.plans import plan_file, trial_file

NOMINAL = builtin_vehicle("nominal")
QUESTION = ("nothing", "backlash")
BACKLASH = '\n[[effects]]\nname = "backlash"\nslack = { value = 12, unit = "mrad" }\n'
LIMITS = {"engine_speed": ["9500 rpm", "13000 rpm"], "speed": ["36 m/s", "51 m/s"], "slip": "12 %"}
POINT = {"engine_speed": "11500 rpm"}
EXCITATION = {
    "actuator": "throttle",
    "waveform": "linear_sweep",
    "start": "0.5 Hz",
    "stop": "12 Hz",
    "duration": "4 s",
    "amplitude": "2 %",
}


def explained_by_files(monkeypatch, question: tuple[str, ...] = QUESTION) -> list[list[str]]:
    """Replace `explain`; the list receives the training runs of every call."""
    calls: list[list[str]] = []

    def explain(session, chosen, vehicle):
        calls.append([one.run.name for one in chosen.training])
        memo = session.folder / session_explain.MEMO
        memo.mkdir(exist_ok=True)
        shutil.copyfile(NOMINAL, memo / "v.improved.toml")
        tree = {
            "vehicle": str(vehicle),
            "improved": "v.improved.toml",
            "runs": [f"../runs/{one.run.name}" for one in chosen.training],
            "questions": [[_stated(name) for name in question]] if question else [],
        }
        (memo / "hypotheses.json").write_text(json.dumps(tree))
        verdict = {"mismatch": {"found": True}, "effects": [], "next_trial": None}
        (memo / session_explain.VERDICT).write_text(json.dumps(verdict))
        return 0

    monkeypatch.setattr(session_explain, "_explain", explain)
    return calls


def _stated(name: str) -> dict[str, object]:
    return {"effect": name} | ({} if name == "nothing" else {"dials": [1.0, 0.0], "spread": 0.5})


def backlash_plan(folder: Path) -> Path:
    """Plan of one trial on a motorcycle that is the nominal one but for a backlash."""
    vehicle = folder / "bike.toml"
    vehicle.write_text(NOMINAL.read_text(encoding="utf-8") + BACKLASH, encoding="utf-8")
    base = trial_file(folder, limits=LIMITS, operating_point=POINT)
    text = (folder / base).read_text(encoding="utf-8")
    lines = [
        'vehicle = "bike.toml"' if line.startswith("vehicle = ") else line
        for line in text.splitlines()
    ]
    (folder / base).write_text("\n".join(lines) + "\n", encoding="utf-8")
    return plan_file(folder, {"file": base, "repeats": 2, "excitation": EXCITATION})
