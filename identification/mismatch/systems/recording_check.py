"""Check a recording against the system of a model file, and select its usable channels.

An unusable recording raises an error; an unusable channel is excluded with a reason, and the others
are analysed.
"""

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from slipbench.identification.mismatch.systems.model_file import Input, ModelFile, Output
from slipbench.identification.signals.aligned import Aligned
from slipbench.plant.signals import Floats
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.channel import Channel
from slipbench.protocol.recording.recording import Recording

GAP = 10.0
"""A gap is longer than this multiple of the median interval and of the model file's period."""

SPARSE = 1.5
"""Sampling interval of an output, in periods of the model file, above which a note is given."""

COARSE = 2.5
"""Sampling interval of a held input, in periods of the model file, above which a note is given."""
REGULAR = 0.9
"""Least share of intervals within 20 % of the median for a channel sampled at a fixed rate."""

FREE = "every input is constant: only the response to the initial state is analysed"


def usable(recording: Recording, file: ModelFile) -> Recording:
    """Return the recording without constant outputs. Raises InputError.

    A unit other than the model file's is an error, and so is a recording in which every input and
    output is constant. Inputs may be constant where an output changes: after a step before the
    recording, in a hold or in a coast-down, the initial state excites the system.
    """
    declared: list[Input | Output] = [*file.inputs.values(), *file.outputs.values()]
    for entry in declared:
        if entry.role in recording.channels:
            _check_unit(recording, entry)
    outputs = [o.role for o in file.outputs.values() if o.role in recording.channels]
    excluded = {
        role: f"constant at {recording.channels[role].value[0]:.6g}"
        for role in outputs
        if _is_constant(recording.channels[role])
    }
    if outputs and len(excluded) == len(outputs) and _inputs_constant(recording, file):
        raise InputError(
            "nothing changes in the recording: every input and every output is constant",
            where=str(recording.folder),
            expected=f"one of {', '.join(entry.role for entry in declared)} moves",
            remedy="check the sensors, or give a recording in which something moves",
        )
    channels = {r: c for r, c in recording.channels.items() if r not in excluded}
    return replace(recording, channels=channels, missing={**recording.missing, **excluded})


def _inputs_constant(recording: Recording, file: ModelFile) -> bool:
    return all(_is_constant(recording.channels.get(i.role)) for i in file.inputs.values())


def _check_unit(recording: Recording, entry: Input | Output) -> None:
    channel = recording.channels[entry.role]
    if isinstance(entry, Input) and entry.slope_over > 0.0:
        return
    if channel.unit != entry.size.si_unit:
        raise InputError(
            f"the unit of {entry.role} in the recording is another than in the model file",
            where=str(recording.folder),
            expected=entry.size.si_unit,
            found=channel.unit,
            remedy="check that recording, role map and model file are of the same system",
        )


def _is_constant(channel: Channel | None) -> bool:
    """Return whether a channel was recorded and is constant."""
    if channel is None or not channel.value.size:
        return False
    value = channel.value[np.isfinite(channel.value)]
    return not value.size or float(np.ptp(value)) == 0.0


def window(
    data: Aligned, file: ModelFile, covering: Iterable[Floats]
) -> tuple[float, float, tuple[str, ...]]:
    """Return begin and end of the longest segment with all inputs and no gap, s, and notes.

    covering: times of the inputs, or of the outputs where the system has no input, s, (n,) each.
    Held inputs have no gaps; interpolated inputs are unknown in a gap.
    """
    times = list(covering)
    start = float(max(time[0] for time in times))
    end = float(min(time[-1] for time in times))
    gaps = sorted(
        gap
        for entry in file.inputs.values()
        if not entry.steps
        for gap in _gaps(data.time[entry.role], file.period)
    )
    segments, segment_start = [], start
    for last, first in gaps:
        segments.append((segment_start, last))
        segment_start = max(segment_start, first)
    segments.append((segment_start, end))
    chosen = max(segments, key=lambda pair: pair[1] - pair[0])
    gap_text = ", ".join(f"{last:.3g} to {first:.3g} s" for last, first in gaps)
    note = (f"inputs have gaps ({gap_text}): {chosen[0]:.3g} to {chosen[1]:.3g} s is analysed",)
    return *chosen, (*(note if gaps else ()), *_constant_inputs(data.recording, file))


def sparse_outputs(data: Aligned, file: ModelFile, outputs: Iterable[str]) -> tuple[str, ...]:
    """Return a note for each output that is sampled less often than the residual bins.

    Bins between two samples are interpolated linearly and count as independent samples: with n bins
    per sample, confidence intervals are too narrow by about the square root of n.
    """
    notes = []
    for name in outputs:
        role = file.outputs[name].role
        time = data.recording.channels[role].time
        ratio = float(np.median(np.diff(time))) / file.period if time.size > 1 else 0.0
        if ratio > SPARSE:
            notes.append(
                f"{name.replace('_', ' ')} is sampled every {ratio * file.period:.3g} s, and period ="
                f" {file.period:.3g} s: intervals are too narrow by about {math.sqrt(ratio):.1f};"
                " period is that of the slowest output"
            )
    return tuple(notes)


def coarse_inputs(data: Aligned, file: ModelFile) -> tuple[str, ...]:
    """Return a note for each held input that is sampled much less often than the residual bins.

    A command holds its value between samples. A measured quantity does not: a zero-order hold
    delays it by half of the sampling interval and adds steps.
    """
    notes = []
    for name, entry in file.inputs.items():
        channel = data.recording.channels[entry.role]
        intervals = np.diff(channel.time)
        if not entry.steps or not intervals.size or _is_constant(channel) or entry.slope_over > 0.0:
            continue
        median = float(np.median(intervals))
        fixed_rate = np.mean(np.abs(intervals - median) < 0.2 * median) > REGULAR
        if fixed_rate and median > COARSE * file.period:
            notes.append(
                f"input {name.replace('_', ' ')} is held for {median:.3g} s from sample to sample, and"
                f" period = {file.period:.3g} s: where it was measured and not commanded, held ="
                " false lets it follow lines between samples"
            )
    return tuple(notes)


def _constant_inputs(recording: Recording, file: ModelFile) -> tuple[str, ...]:
    """Return a note for each constant input: an effect there is not identifiable."""
    if file.inputs and _inputs_constant(recording, file):
        return (FREE,)
    return tuple(
        f"input {name.replace('_', ' ')} is constant: no effect that acts there can be identified"
        for name, entry in file.inputs.items()
        if _is_constant(recording.channels.get(entry.role))
    )


def _gaps(time: Floats, period: float) -> list[tuple[float, float]]:
    intervals = np.diff(time)
    wide = np.flatnonzero(intervals > GAP * max(float(np.median(intervals)), period))
    return [(float(time[k]), float(time[k + 1])) for k in wide]
