"""One sweep, cut out of a recording, with the phase of its excitation.

    found = identify(read(folder))
    run = swept_run_of(found, "throttle_position")     # SweptRun or NoSweep

The phase is the echoed command's, also where the input is the measured throttle: harmonics are
harmonics of the command.
"""

from dataclasses import dataclass

import numpy as np

from slipbench.identification.signals.swept_phase import NoSweep, SweptPhase, swept_phase
from slipbench.protocol.recording.channel import FloatArray

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
