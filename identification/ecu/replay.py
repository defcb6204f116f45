"""An exported script and the designed controller on the same slip of a recording.

Both get the slip and the speed that the recording has at each tick. The recording was made without
this script, so its slip does not respond to it: the replay compares two laws, and shows when the
script would have acted; it does not show what the slip would then have been.
"""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from slipbench.controllers.slip_controller import SlipState
from slipbench.controllers.slip_estimator import SLOWEST
from slipbench.identification.ecu.exported_law import ExportedLaw
from slipbench.identification.ecu.lua_machine import EcuCommands, LuaMachine
from slipbench.identification.ecu.lua_script import LEAST, held_ticks, script
from slipbench.identification.signals.aligned import aligned
from slipbench.identification.signals.dataset import dataset
from slipbench.identification.signals.motion import Motion, motion
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.channel import FloatArray
from slipbench.protocol.recording.recording import Recording
from slipbench.protocol.recording.run_folder import read

AGREES = (
    0.01  # of the largest reduction: 0.1 deg of timing, 0.05 % of throttle, below what either holds
)
KMH = 3.6


@dataclass(frozen=True, eq=False)
class WheelSamples:
    """ratio: driven over reference wheel speed; speed: km/h; NaN: not valid. Shape (n,), per tick."""

    ratio: FloatArray
    speed: FloatArray


@dataclass(frozen=True, eq=False)
class Replayed:
    """samples: input; script, designed: commands of either; difference: largest, share of the range."""

    law: ExportedLaw
    samples: WheelSamples
    script: EcuCommands
    designed: EcuCommands
    difference: float

    @property
    def agrees(self) -> bool:
        """Whether both give the same commands but for single precision."""
        return self.difference <= AGREES


def replayed_run(law: ExportedLaw, run: Path) -> Replayed:
    """Replay a recording. Raises InputError where it has no slip, or lupa is missing."""
    return replay(law, wheel_samples(read(run), law.tick))


def wheel_samples(recording: Recording, tick: float) -> WheelSamples:
    """Speeds of a recording at ticks of `tick` s: the last sample before each. Raises InputError."""
    data = aligned(recording)
    base = dataset(data)
    moved = motion(data, base)
    if not isinstance(moved, Motion):
        raise InputError(
            "no slip in this recording",
            where=str(recording.folder),
            expected="speeds of the driven and of a free wheel",
            found=moved.reason,
        )
    at = np.arange(base.time[0], base.time[-1], tick)
    last = np.searchsorted(base.time, at, side="right") - 1
    driven, reference = moved.driven[last], moved.reference[last]
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(reference > 0.0, driven / reference, np.nan)
    return WheelSamples(ratio, KMH * reference)


def replay(law: ExportedLaw, samples: WheelSamples) -> Replayed:
    """Run script and controller on the same samples. Raises InputError where lupa is missing."""
    run = LuaMachine(script(law)).ticks(samples.ratio.tolist(), samples.speed.tolist())
    designed = designed_commands(law, samples)
    return Replayed(law, samples, run, designed, _difference(law, run, designed))


def designed_commands(law: ExportedLaw, samples: WheelSamples) -> EcuCommands:
    """Commands of the controller in double precision, with the script's rules for unknown slip."""
    controller, state = law.controller, None
    unknown, rows, speed = 0, [], math.nan
    for ratio, kmh in zip(samples.ratio.tolist(), samples.speed.tolist(), strict=True):
        slip, v = ratio - 1.0, kmh / KMH
        if v > SLOWEST and slip >= LEAST:
            unknown, speed = 0, v
            state = state or _started(law, slip, speed)
        else:
            unknown, slip = unknown + 1, math.nan
            state = state if unknown <= held_ticks(law.tick) else None
        if state is not None:
            *_, state = controller.update(state, law.target, slip, speed, law.tick)
        rows.append((state.throttle, state.spark) if state else (0.0, 0.0))
    throttle, spark = np.array(rows, dtype=float).reshape(-1, 2).T
    return EcuCommands(throttle, spark)


def _started(law: ExportedLaw, slip: float, speed: float) -> SlipState:
    return law.controller.start(0.0, 0.0, slip, speed)


def _difference(law: ExportedLaw, one: EcuCommands, other: EcuCommands) -> float:
    """Largest difference of a command, as a share of the largest reduction."""
    file = law.file
    throttle = file.mixed.throttle if file.mixed else file.limits
    pairs = {
        "throttle": [(one.throttle, other.throttle, throttle.low)],
        "spark": [(one.spark, other.spark, file.limits.low)],
    }
    pairs["mixed"] = pairs["throttle"] + pairs["spark"]
    return max(
        (float(np.max(np.abs(a - b))) / -low for a, b, low in pairs[file.actuator] if a.size),
        default=0.0,
    )
