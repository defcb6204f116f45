"""One sweep, cut out of a recording, with the phase of its excitation.

    found = identify(read(folder))
    run = swept_run_of(found, "throttle_position")     # SweptRun or NoSweep

The phase is the echoed command's, also where the input is the measured throttle: harmonics are
harmonics of what was asked for.
"""

from dataclasses import dataclass

import numpy as np

from identification.filters import bridged
from identification.identify import Identification
from identification.motion import NoMotion
from identification.responses import INPUTS, MOST_UNKNOWN, STILL, excited_actuator
from identification.swept_phase import NoSweep, SweptPhase, swept_phase
from identification.trial_window import NoExcitation
from protocol.channel import FloatArray


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
    sweep = swept_phase(u if command is None else command, rate)
    return sweep if isinstance(sweep, NoSweep) else SweptRun(u, y, rate, sweep)


def swept_run_of(
    found: Identification, given: str | None = None, taken: str = "slip"
) -> SweptRun | NoSweep:
    """Cut the sweep out of a recording. given, taken: roles; the excited command and slip."""
    if isinstance(found.window, NoExcitation):
        return NoSweep(found.window.reason)
    actuator = excited_actuator(found.recording.trial, found.base, found.window)
    command = INPUTS[actuator][0]
    names = (given or command, taken, command)
    parts = [_part(found, name) for name in names]
    for part in parts:
        if isinstance(part, NoSweep):
            return part
    u, y, reference = (part for part in parts if not isinstance(part, NoSweep))
    sweep = swept_phase(reference, found.base.rate)
    if isinstance(sweep, NoSweep):
        return sweep
    return SweptRun(u, y, found.base.rate, sweep, names[0], names[1])


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
