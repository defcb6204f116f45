"""The sweep of a recording, cut out for the analyses that follow its phase.

run = swept_run_of(identify(read(folder)))            # SweptRun or NoSweep
"""

from dataclasses import replace

import numpy as np

from slipbench.identification.response.identify import Identification
from slipbench.identification.response.responses import (
    INPUTS,
    MOST_UNKNOWN,
    STILL,
    excited_actuator,
)
from slipbench.identification.response.swept_run import SweptRun, swept_run
from slipbench.identification.signals.filters import bridged
from slipbench.identification.signals.motion import NoMotion
from slipbench.identification.signals.named import COMPUTED, named_signal
from slipbench.identification.signals.swept_phase import NoSweep
from slipbench.identification.signals.trial_window import NoExcitation
from slipbench.protocol.recording.channel import FloatArray


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
    """Input, output and excited command during the excitation, shape (n,) each in SI, and their roles.

    given, taken: roles of input and output; by default the excited command and slip.
    """
    if isinstance(found.window, NoExcitation):
        return NoSweep(found.window.reason)
    if found.pair is not None:
        names = (given or found.pair[0], taken, given or found.pair[0])
    else:
        actuator = excited_actuator(found.recording.trial, found.base, found.window)
        names = (given or INPUTS[actuator][0], taken, INPUTS[actuator][0])
    parts = []
    for name in names:
        part = _part(found, name)
        if isinstance(part, NoSweep):
            return part
        parts.append(part)
    return tuple(parts), names


def _part(found: Identification, name: str) -> FloatArray | NoSweep:
    """A signal during the excitation, or why it cannot be had."""
    assert not isinstance(found.window, NoExcitation)
    if name in COMPUTED and isinstance(found.motion, NoMotion):
        return NoSweep(found.motion.reason)
    signal = named_signal(found.base, found.motion, name)
    if signal is None:
        return NoSweep(f"{name} was not recorded")
    part = signal[found.window.exciting]
    unknown = float(np.mean(~np.isfinite(part)))
    if unknown > MOST_UNKNOWN:
        return NoSweep(f"{100 * unknown:.0f} % of {name} is not known in the trial")
    filled = bridged(part)
    return NoSweep(f"{name} did not move in the trial") if np.std(filled) < STILL else filled
