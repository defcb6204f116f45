"""Part of a run's entry from identification.json: the verdict, and parameters with intervals.

Names: of the model from the command to slip `natural_frequency`, `damping_ratio`, `dead_time`; of
another model with its path, as in `dead_time_from_throttle_position`.
"""

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

from slipbench.identification.report.identification_file import (
    IDENTIFICATION_VERSION,
    ModeEntry,
    ModelEntry,
    ResonanceEntry,
    SlipEntry,
    ValidationEntry,
    VerdictEntry,
)
from slipbench.identification.season.entry import Entry, Parameter, around, column
from slipbench.identification.season.json_file import number, read_json, text_at
from slipbench.protocol.configuration import Section, parse
from slipbench.protocol.errors import InputError

Part = TypeVar("Part", bound=Section)


def with_identification(entry: Entry, path: Path) -> Entry:
    """The entry with verdict and parameters of an identification.json.

    A part of the file that is damaged is a fault of the entry, the others count. Raises InputError
    where the file cannot be read or is of another version.
    """
    tree = read_json(path)
    if (version := tree.get("schema_version")) != IDENTIFICATION_VERSION:
        raise InputError(
            "this version of the file is unknown",
            where=str(path),
            expected=IDENTIFICATION_VERSION,
            found=str(version),
            remedy="identify the run again",
        )
    faults: list[str] = []
    verdict = next(_parts(tree, "verdict", VerdictEntry, faults), None)
    found = {one.name: one for one in reversed([*_parameters(tree, faults)])}
    if verdict is not None:
        entry = replace(entry, verdict=verdict.word, reason="; ".join(verdict.reasons))
    duration = number(tree.get("duration"))
    return replace(
        entry,
        recording=text_at(tree, "recording"),
        duration=entry.duration if duration is None else duration,
        parameters=tuple(found[name] for name in sorted(found)),
    ).with_faults(*(f"identification.json: {one}" for one in faults))


def _parts(tree: dict[str, Any], key: str, model: type[Part], faults: list[str]) -> Iterator[Part]:
    """Yield the entry, or each of the entries, at a key; one that is damaged is named in `faults`."""
    found = tree.get(key)
    for one in found if isinstance(found, list) else [found]:
        if one is None:
            continue
        try:
            yield parse(one, model, key)
        except InputError as fault:
            faults.append(" ".join(str(fault).split()))


def _parameters(tree: dict[str, Any], faults: list[str]) -> Iterator[Parameter]:
    peak = next(_parts(tree, "resonance", ResonanceEntry, faults), None)
    if peak is not None:
        yield from around("resonance", "Hz", peak.frequency)
        yield from around("resonance_peak", "1", peak.peak)
        yield from around("low_frequency_gain", "SI", peak.low_frequency_gain)
        yield from around("servo_bandwidth", "Hz", peak.servo_bandwidth)
    for slip in _parts(tree, "slip", SlipEntry, faults):
        yield from around("slip_mean", "1", slip.mean)
        yield from around("rolling_radius_ratio", "1", slip.rolling_radius_ratio)
    yield from around("coherence_min", "1", number(tree.get("coherence_min")))
    delays = tree.get("delays")
    if isinstance(delays, dict):
        yield from around(
            "group_delay", "s", number(delays.get("input_to_slip", delays.get("input_to_output")))
        )
        yield from around("encoder_delay", "s", number(delays.get("encoder")))
    main = _main(tree)
    for model in _parts(tree, "models", ModelEntry, faults):
        yield from _of_model(model, main, peak.frequency if peak else None)
    for one in _parts(tree, "validations", ValidationEntry, faults):
        yield from around(_named("nrmse_fit", (one.input, one.output), main), "%", one.nrmse_fit)


def _main(tree: dict[str, Any]) -> tuple[str, str]:
    """Input and output of the first model: the path that the report is about."""
    models = tree.get("models")
    first = models[0] if isinstance(models, list) and models else {}
    return (
        (text_at(first, "input"), text_at(first, "output")) if isinstance(first, dict) else ("", "")
    )


def _named(name: str, path: tuple[str, str], main: tuple[str, str]) -> str:
    if path == main:
        return name
    output = "" if path[1] == main[1] else f"to_{path[1]}"
    return column(name, f"from_{path[0]}", output)


def _of_model(
    model: ModelEntry, main: tuple[str, str], resonance: float | None
) -> Iterator[Parameter]:
    path = (model.input, model.output)
    interval = model.delay_interval
    if interval is not None:
        yield Parameter(_named("dead_time", path, main), "s", model.delay, *interval)
    mode = _mode(model.modes, resonance)
    if mode is not None:
        frequency, damping = (
            _named(name, path, main) for name in ("natural_frequency", "damping_ratio")
        )
        yield from around(frequency, "Hz", mode.frequency, mode.frequency_deviation)
        yield from around(damping, "1", mode.damping, mode.damping_deviation)


def _mode(modes: tuple[ModeEntry, ...], resonance: float | None) -> ModeEntry | None:
    """Pole pair nearest to the resonance, or the least damped one; as a comparison of runs takes it."""
    pairs = [one for one in modes if one.damping < 1 and one.frequency > 0]
    if not pairs:
        return None
    if resonance:
        return min(pairs, key=lambda one: abs(math.log(one.frequency / resonance)))
    return min(pairs, key=lambda one: one.damping)
