"""Outcome and quick look of a run, from the files of its folder."""

import json
from pathlib import Path
from typing import Any

from slipbench.bench.session.session_folder import QUICK_LOOK
from slipbench.protocol.codec.messages import Phase
from slipbench.protocol.configuration import load_toml
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.run_folder import DESCRIPTION

LOOK_KEYS = ("verdict", "reason", "counts", "proposed_amplitude", "lines", "margins")
OUTCOME_KEYS = ("valid", "invalid", "phase", "trip", "detail", "notes")
EXCITING = Phase.EXCITING.name.lower()


class EndOfRun:
    """The end of a run, read again only where a file was changed.

    pressed  ns, when the button was pressed
    """

    def __init__(self, folder: Path) -> None:
        """Nothing is read yet."""
        self._folder = folder
        self._stamps: dict[str, int] = {}
        self.outcome: dict[str, Any] = {}
        self.look: dict[str, Any] = {}
        self.pressed: tuple[int, ...] = ()

    def read(self) -> bool:
        """Whether there is something new."""
        changed = False
        if self._changed(DESCRIPTION):
            outcome, self.pressed = _outcome(self._folder / DESCRIPTION)
            changed |= outcome != self.outcome
            self.outcome = outcome
        if self._changed(QUICK_LOOK):
            self.look = _look(self._folder / QUICK_LOOK)
            changed = True
        return changed

    def last_phase(self) -> dict[str, str]:
        """The phase in which the trial ended, for buses on which no status reports it."""
        return {"phase": str(self.outcome["phase"])} if "phase" in self.outcome else {}

    def _changed(self, name: str) -> bool:
        try:
            stamp = (self._folder / name).stat().st_mtime_ns
        except OSError:
            return False
        if self._stamps.get(name) == stamp:
            return False
        self._stamps[name] = stamp
        return True


def _outcome(path: Path) -> tuple[dict[str, Any], tuple[int, ...]]:
    """The outcome in run.toml, empty while the trial runs; and when the button was pressed, ns."""
    try:
        outcome = load_toml(path).get("outcome", {})
    except InputError:
        return {}, ()
    phases = outcome.get("phases", [])
    pressed = tuple(each["time_ns"] for each in phases if each["phase"] == EXCITING)
    return {key: outcome[key] for key in OUTCOME_KEYS if key in outcome}, pressed


def _look(path: Path) -> dict[str, Any]:
    try:
        look = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return {key: look[key] for key in LOOK_KEYS if key in look}
