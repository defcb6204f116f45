"""Whether a recording is one of a model file's system at all, and which of its channels are of use.

What nothing can be made of is refused in words; a channel of no use is left out with the reason,
and the others are judged.
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
"""Usual distances of two samples, and periods of the model file, beyond which they are a gap."""

SPARSE = 1.5
"""Periods of the model file between the samples of an output, beyond which it is said."""

COARSE = 2.5
"""Periods of the model file from sample to sample of a held input, beyond which it is said."""
REGULAR = 0.9
"""Share of the samples of a channel that come at its usual distance, within a fifth, of a clock."""

FREE = "every input is constant: only the response to the initial state is analysed"


def usable(recording: Recording, file: ModelFile) -> Recording:
    """Return the recording without constant outputs. Raises InputError.

    Another unit than the model file's is refused, and a recording in which nothing changes. Inputs
    may be constant where an output changes: after a step that began before the recording, in a
    hold or a coast-down the initial state excites the system.
    """
    everything: list[Input | Output] = [*file.inputs.values(), *file.outputs.values()]
    for told in everything:
        if told.role in recording.channels:
            _check_unit(recording, told)
    outputs = [o.role for o in file.outputs.values() if o.role in recording.channels]
    dead = {
        role: f"constant at {recording.channels[role].value[0]:.6g}"
        for role in outputs
        if _rests(recording.channels[role])
    }
    if outputs and len(dead) == len(outputs) and _inputs_rest(recording, file):
        raise InputError(
            "nothing changes in the recording: every input and every output is constant",
            where=str(recording.folder),
            expected=f"one of {', '.join(told.role for told in everything)} moves",
            remedy="check the sensors, or give a recording in which something moves",
        )
    channels = {r: c for r, c in recording.channels.items() if r not in dead}
    return replace(recording, channels=channels, missing={**recording.missing, **dead})


def _inputs_rest(recording: Recording, file: ModelFile) -> bool:
    return all(_rests(recording.channels.get(i.role)) for i in file.inputs.values())


def _check_unit(recording: Recording, told: Input | Output) -> None:
    channel = recording.channels[told.role]
    if isinstance(told, Input) and told.slope_over > 0.0:
        return
    if channel.unit != told.size.si_unit:
        raise InputError(
            f"the unit of {told.role} in the recording is another than in the model file",
            where=str(recording.folder),
            expected=told.size.si_unit,
            found=channel.unit,
            remedy="check that recording, role map and model file are of the same system",
        )


def _rests(channel: Channel | None) -> bool:
    """Tell whether a channel was recorded and never moves."""
    if channel is None or not channel.value.size:
        return False
    value = channel.value[np.isfinite(channel.value)]
    return not value.size or float(np.ptp(value)) == 0.0


def window(
    data: Aligned, file: ModelFile, covering: Iterable[Floats]
) -> tuple[float, float, tuple[str, ...]]:
    """Take what all inputs cover, the longest piece without a gap, and say what was cut.

    covering: times of the inputs, or of the outputs where the system has no input. Inputs that are
    held may rest for long; those along lines are unknown in a gap.
    """
    times = list(covering)
    start = float(max(time[0] for time in times))
    end = float(min(time[-1] for time in times))
    gaps = sorted(
        gap
        for told in file.inputs.values()
        if not told.steps
        for gap in _gaps(data.time[told.role], file.period)
    )
    pieces, begun = [], start
    for last, first in gaps:
        pieces.append((begun, last))
        begun = max(begun, first)
    pieces.append((begun, end))
    best = max(pieces, key=lambda piece: piece[1] - piece[0])
    where = ", ".join(f"{last:.3g} to {first:.3g} s" for last, first in gaps)
    cut = (f"inputs have gaps ({where}): {best[0]:.3g} to {best[1]:.3g} s is analysed",)
    return *best, (*(cut if gaps else ()), *_at_rest(data.recording, file))


def sparse_outputs(data: Aligned, file: ModelFile, shown: Iterable[str]) -> tuple[str, ...]:
    """Say which outputs are sampled less often than residuals are judged.

    Between two samples a bin takes the line, and counts as if it were a sample of its own: with n
    bins a sample, intervals are too narrow by about the square root of n.
    """
    notes = []
    for name in shown:
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
    """Say which held inputs are staircases beside the residuals, if they were measured.

    A command holds from one sample to the next. What was measured does not: held, it comes late by
    half of the distance between samples, and in steps.
    """
    notes = []
    for name, told in file.inputs.items():
        channel = data.recording.channels[told.role]
        between = np.diff(channel.time)
        if not told.steps or not between.size or _rests(channel) or told.slope_over > 0.0:
            continue
        usual = float(np.median(between))
        on_a_clock = np.mean(np.abs(between - usual) < 0.2 * usual) > REGULAR
        if on_a_clock and usual > COARSE * file.period:
            notes.append(
                f"input {name.replace('_', ' ')} is held for {usual:.3g} s from sample to sample, and"
                f" period = {file.period:.3g} s: where it was measured and not commanded, held ="
                " false lets it follow lines between samples"
            )
    return tuple(notes)


def _at_rest(recording: Recording, file: ModelFile) -> tuple[str, ...]:
    """Say which inputs never change: what acts there cannot be told from an offset."""
    if file.inputs and _inputs_rest(recording, file):
        return (FREE,)
    return tuple(
        f"input {name.replace('_', ' ')} is constant: no effect that acts there can be identified"
        for name, told in file.inputs.items()
        if _rests(recording.channels.get(told.role))
    )


def _gaps(time: Floats, period: float) -> list[tuple[float, float]]:
    apart = np.diff(time)
    wide = np.flatnonzero(apart > GAP * max(float(np.median(apart)), period))
    return [(float(time[k]), float(time[k + 1])) for k in wide]
