"""Which run an analysis belongs to: it lends its parameters to the run, and takes tags and date from it."""

import posixpath
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from statistics import fmean

from slipbench.identification.season.entry import Entry

SEGMENT = re.compile(r"@[-+.\de]*:[-+.\de]*$")
Runs = Mapping[str, Entry]
Tag = int | float | str


def joined(entries: Sequence[Entry]) -> list[Entry]:
    """Entries with analyses and runs joined, in their order.

    A run without an identification takes the parameters of one in another folder, which is then no
    entry of its own. Every other analysis gets the date and the tags that its runs have in common; of
    numbers the mean.
    """
    runs = {one.folder.path: one for one in entries if one.folder.kind == "run"}
    kept = {}
    for one in entries:
        if one.folder.kind == "identify":
            owner, fault = _owner(one, runs)
            if owner and not runs[owner].parameters:
                runs[owner] = _identified(runs[owner], one)
                continue
            one = _placed(one, [runs[owner]] if owner else []).with_faults(fault)
        elif one.folder.kind == "explain":
            one = _placed(one, _trained_on(one, runs)).with_faults(_not_here(one, runs))
        kept[one.folder] = one
    return [runs.get(k.path, one) if k.kind == "run" else one for k, one in kept.items()]


def _owner(analysis: Entry, runs: Runs) -> tuple[str, str]:
    """Path of the run of an `identify` and "", or "" and why there is none."""
    if analysis.folder.run:
        return analysis.folder.run, ""
    name = analysis.recording
    named = [path for path in runs if posixpath.basename(path) == name]
    nearest = _nearest(analysis.folder.path, named)
    if len(nearest) == 1:
        return nearest[0], ""
    if not nearest:
        return "", f"its run {name!r} is not in this folder" if name else ""
    return "", f"several runs are called {name!r}: {', '.join(nearest)}"


def _nearest(path: str, others: Sequence[str]) -> list[str]:
    """Those of the other paths that have most folders in common with a path."""

    def shared(other: str) -> int:
        common = posixpath.commonpath([path, other])
        return common.count("/") + 1 if common else 0

    most = max(map(shared, others), default=0)
    return [other for other in others if shared(other) == most]


def _identified(run: Entry, analysis: Entry) -> Entry:
    """A run with the results of an `identify` in another folder."""
    return replace(
        run,
        verdict=analysis.verdict or run.verdict,
        reason=analysis.reason or run.reason,
        parameters=analysis.parameters,
        duration=analysis.duration if run.duration is None else run.duration,
    ).with_faults(analysis.fault)


def _trained_on(analysis: Entry, runs: Runs) -> list[Entry]:
    """Runs from which an `explain` learnt: as stated, else all of its session, or the run it lies in."""
    folder = analysis.folder
    if analysis.training:
        return [runs[path] for path in _stated(analysis) if path in runs]
    if folder.run:
        return [runs[folder.run]]
    return [one for one in runs.values() if folder.session and one.folder.session == folder.session]


def _stated(analysis: Entry) -> list[str]:
    """Paths of the training runs that an `explain` states, without the segments of them."""
    place = analysis.folder.path
    runs = [SEGMENT.sub("", one) for one in analysis.training]
    paths = [posixpath.normpath(posixpath.join(place, one)) for one in runs]
    return list(dict.fromkeys(paths))


def _not_here(analysis: Entry, runs: Runs) -> str:
    lacking = [path for path in _stated(analysis) if path not in runs]
    return f"its training runs are not in this folder: {', '.join(lacking)}" if lacking else ""


def _placed(analysis: Entry, runs: Sequence[Entry]) -> Entry:
    """An analysis with date, vehicle and tags of its runs."""
    began = [one.started for one in runs if one.started is not None]
    vehicles = {one.vehicle for one in runs}
    return replace(
        analysis.with_tags(_common([dict(one.tags) for one in runs])),
        started=min(began, default=None),
        vehicle=vehicles.pop() if len(vehicles) == 1 else "",
    )


def _common(tags: Sequence[Mapping[str, Tag]]) -> dict[str, Tag]:
    """Tags that all have: a value that is the same everywhere, or the mean of numbers."""
    keys = set.intersection(*map(set, tags)) if tags else set()
    found: dict[str, Tag] = {}
    for key in keys:
        values = [one[key] for one in tags]
        numbers = [value for value in values if not isinstance(value, str)]
        if len(set(values)) == 1:
            found[key] = values[0]
        elif len(numbers) == len(values):
            found[key] = fmean(numbers)
    return found
