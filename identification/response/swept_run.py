"""One sweep, cut out of a recording, with the phase of its excitation.

    found = identify(read(folder))
    run = swept_run_of(found, "throttle_position")     # SweptRun or NoSweep

The phase is the echoed command's, also where the input is the measured throttle: harmonics are
harmonics of what was asked for.
"""

from dataclasses import dataclass, replace

import numpy as np

from identification.response.identify import Identification
from identification.response.responses import INPUTS, MOST_UNKNOWN, STILL, excited_actuator
from identification.signals.filters import bridged
from identification.signals.motion import NoMotion
from identification.signals.swept_phase import NoSweep, SweptPhase, swept_phase
from identification.signals.trial_window import NoExcitation
from protocol.channel import FloatArray

RESTS = 0.01  # of the usual step from sample to sample


@dataclass(frozen=True)
class SweptRun:
    """Input and output while a sweep excited.

    u, y: (n,) without unknown samples; rate: Hz; sweep: phase (n,) and frequency (n,) in Hz;
    input, output: roles.
    """

    u: FloatArray
    y: FloatArray
    rate: float
    sweep: SweptPhase
    input: str = "u"
    output: str = "y"


def swept_run(
    u: FloatArray, y: FloatArray, rate: float, command: FloatArray | None = None
) -> SweptRun | NoSweep:
    """Join input and output of one sweep. command: (n,), whose phase counts; else it is u's."""
    command = u if command is None else command
    part = moving(command)
    sweep = swept_phase(command[part], rate)
    return sweep if isinstance(sweep, NoSweep) else SweptRun(u[part], y[part], rate, sweep)


def moving(command: FloatArray) -> slice:
    """Leave out the rest before and after a waveform, in which it is no sine. command: (n,)."""
    steps = np.abs(np.diff(command))
    alive = np.flatnonzero(steps > RESTS * np.median(steps))
    return slice(int(alive[0]), int(alive[-1]) + 2) if alive.size else slice(0, command.size)


def swept_run_of(
    found: Identification, given: str | None = None, taken: str = "slip"
) -> SweptRun | NoSweep:
    """Cut the sweep out of a recording. given, taken: roles; the excited command and slip."""
    parts = signals_of(found, given, taken)
    if isinstance(parts, NoSweep):
        return parts
    signals, names = parts
    run = swept_run(signals[0], signals[1], found.base.rate, signals[2])
    return replace(run, input=names[0], output=names[1]) if isinstance(run, SweptRun) else run


def signals_of(
    found: Identification, given: str | None = None, taken: str = "slip"
) -> tuple[tuple[FloatArray, ...], tuple[str, ...]] | NoSweep:
    """Input, output and excited command during the excitation, and their roles."""
    if isinstance(found.window, NoExcitation):
        return NoSweep(found.window.reason)
    actuator = excited_actuator(found.recording.trial, found.base, found.window)
    command = INPUTS[actuator][0]
    names = (given or command, taken, command)
    parts = []
    for name in names:
        part = _part(found, name)
        if isinstance(part, NoSweep):
            return part
        parts.append(part)
    return tuple(parts), names


def _part(found: Identification, name: str) -> FloatArray | NoSweep:
    """Give a signal during the excitation, or why it cannot be had."""
    assert not isinstance(found.window, NoExcitation)
    if name == "slip":
        if isinstance(found.motion, NoMotion):
            return NoSweep(found.motion.reason)
        signal = found.motion.slip.ratio
    else:
        signal = found.base.signals.get(name, np.empty(0))
    if not signal.size:
        return NoSweep(f"{name} was not recorded")
    part = signal[found.window.exciting]
    unknown = float(np.mean(~np.isfinite(part)))
    if unknown > MOST_UNKNOWN:
        return NoSweep(f"{100 * unknown:.0f} % of {name} is not known in the trial")
    filled = bridged(part)
    return NoSweep(f"{name} did not move in the trial") if np.std(filled) < STILL else filled
