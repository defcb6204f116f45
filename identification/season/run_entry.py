"""Entry of a run folder, from its description, trial, quick look and identification."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from datetime import UTC, date, datetime
from pathlib import Path
from typing import Any

from slipbench.identification.season.entry import Entry
from slipbench.identification.season.folders import IDENTIFICATION, QUICK_LOOK, Folder
from slipbench.identification.season.identified import with_identification
from slipbench.identification.season.json_file import read_json, text_at
from slipbench.protocol.configuration import load_toml, read_toml
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.run_folder import DESCRIPTION, FRAMES, TABLES, TRIAL
from slipbench.protocol.recording.tags import tags_of
from slipbench.protocol.trial_file import RPM, Multisine, Square, Sweep, TrialFile

INCOMPLETE = "incomplete"
Step = Callable[[Path, Entry], Entry]


def run_entry(root: Path, folder: Folder) -> Entry:
    """Entry of a run folder; what is damaged or missing is its fault, all else is there.

    The frames are not decoded: `slipbench identify` does that.
    """
    entry = Entry(folder)
    for step in STEPS:
        try:
            entry = step(root / folder.path, entry)
        except InputError as fault:
            entry = entry.with_faults(in_one_line(fault, root))
    return entry if entry.verdict else replace(entry, verdict=entry.outcome)


def in_one_line(fault: InputError, root: Path) -> str:
    """A fault as one line, with paths relative to `root`: the index may be moved with its folder."""
    text = ", ".join(line.strip() for line in str(fault).splitlines())
    return text.replace(f"{root}/", "")


def _described(run: Path, entry: Entry) -> Entry:
    if not (run / DESCRIPTION).exists():
        return replace(
            entry.with_faults(f"there is no {DESCRIPTION}: the recording was not completed"),
            outcome=INCOMPLETE,
        )
    description = load_toml(run / DESCRIPTION)
    about, outcome = (_table(description, name) for name in ("run", "outcome"))
    recorded = text_at(about, "kind")
    ended = text_at(outcome, "phase") or ("" if recorded != "trial" else INCOMPLETE)
    trip = text_at(outcome, "trip")
    duration = about.get("duration")
    return replace(
        entry,
        recorded=recorded,
        started=_time(about.get("started")) or _time(about.get("imported")),
        vehicle=text_at(about, "vehicle") or text_at(about, "what"),
        duration=float(duration) if isinstance(duration, int | float) else None,
        outcome=ended,
        trip="" if trip == "none" else trip,
        reason=text_at(outcome, "invalid") or text_at(outcome, "detail"),
    )


def _tagged(run: Path, entry: Entry) -> Entry:
    if not (run / DESCRIPTION).exists():
        return entry
    tags = tags_of(load_toml(run / DESCRIPTION), str(run / DESCRIPTION))
    entry = entry.with_tags(tags)
    if "date" not in tags:
        return entry
    stated = _time(tags["date"])
    if stated is None:
        return entry.with_faults(f"tags.date = {tags['date']!r} is no date such as 2026-05-03")
    return replace(entry.with_tags({k: v for k, v in tags.items() if k != "date"}), started=stated)


def _with_frames(run: Path, entry: Entry) -> Entry:
    """Check that there is something that was recorded."""
    frames = run / FRAMES
    if frames.exists():
        empty = frames.is_file() and frames.stat().st_size == 0
        return entry.with_faults(f"{FRAMES} is empty") if empty else entry
    if (run / TABLES).is_dir():
        return entry
    return entry.with_faults(f"there is no {FRAMES}")


def _with_trial(run: Path, entry: Entry) -> Entry:
    if not (run / TRIAL).exists():
        if entry.recorded == "trial":
            return entry.with_faults(f"there is no {TRIAL}")
        return entry
    trial = read_toml(run / TRIAL, TrialFile, recorded=True)
    point = trial.operating_point
    return replace(
        entry,
        trial=trial.name,
        actuator=trial.excitation.actuator,
        excitation=_excitation(trial),
        amplitude=str(trial.excitation.amplitude),
        gear=point.gear,
        engine_speed=round(float(point.engine_speed) / RPM, 3),
    )


def _looked_at(run: Path, entry: Entry) -> Entry:
    if not (run / QUICK_LOOK).exists():
        return entry
    look = read_json(run / QUICK_LOOK)
    return replace(
        entry, verdict=text_at(look, "verdict"), reason=text_at(look, "reason") or entry.reason
    )


def _identified(run: Path, entry: Entry) -> Entry:
    if not (run / IDENTIFICATION).exists():
        return entry
    return with_identification(entry, run / IDENTIFICATION)


STEPS: tuple[Step, ...] = (_described, _tagged, _with_frames, _with_trial, _looked_at, _identified)


def _excitation(trial: TrialFile) -> str:
    """Waveform and band in words."""
    match trial.excitation:
        case Sweep(waveform=waveform, start=start, stop=stop):
            return f"{waveform.replace('_', ' ')} {start} to {stop}"
        case Square(frequency=frequency):
            return f"square {frequency}"
        case Multisine(lowest=lowest, highest=highest):
            return f"multisine {lowest} to {highest}"
    return ""


def _table(tree: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    """A table of run.toml; empty where there is none. Raises InputError where it is something else."""
    found = tree.get(name, {})
    if not isinstance(found, Mapping):
        raise InputError(f"{name} is no table", where=DESCRIPTION, found=repr(found))
    return found


def _time(value: object) -> datetime | None:
    """A time in UTC without a zone, as the index has it; None for what is no time."""
    try:
        found = value if isinstance(value, date) else datetime.fromisoformat(str(value))
    except ValueError:
        return None
    if not isinstance(found, datetime):
        found = datetime(found.year, found.month, found.day)
    return found.astimezone(UTC).replace(tzinfo=None) if found.tzinfo else found
