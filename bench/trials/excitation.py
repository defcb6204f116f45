"""Excitations: offsets from the operating point, as pure functions of time."""

import math
from dataclasses import dataclass
from operator import itemgetter

import numpy as np
import numpy.typing as npt

from slipbench.protocol.errors import InputError
from slipbench.protocol.quantity import shown
from slipbench.protocol.trial_file import Multisine, Square, Sweep, TrialFile
from slipbench.protocol.waveforms import COMMANDS_PER_CYCLE, end_at_zero, waveform

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Excitation:
    """A waveform, sampled at the command period before anything is armed.

    actuator  "throttle" or "spark", or "slip": the target of a controller
    table     (n,) deviation from the operating point at each command, throttle or slip 0..1 or rad
    period    s between commands
    """

    actuator: str
    table: FloatArray
    period: float

    @property
    def duration(self) -> float:
        """Duration of the excitation, s."""
        return self.table.size * self.period

    def value(self, time: float) -> float:
        """Deviation `time` s after the button; zero outside the excitation and for NaN."""
        if not math.isfinite(time):
            return 0.0
        index = math.floor(time / self.period + 1e-3)  # rounding may put time below the sample
        return float(self.table[index]) if 0 <= index < self.table.size else 0.0


def plan_excitation(trial: TrialFile, where: str = "") -> Excitation:
    """Waveform of a trial. where: the trial file, for messages.

    Raises InputError where a frequency is above what the command rate allows, or where amplitude or
    rate exceed the trial's own limits.
    """
    spec, limits, where = trial.excitation, trial.limits, where or trial.name
    limit, rate = {
        "throttle": (limits.throttle_deviation, limits.throttle_rate),
        "spark": (min(-limits.spark[0], limits.spark[1]), limits.spark_rate),
        "slip": (limits.slip, math.inf),  # a target: the controller limits its actuator itself
    }[spec.actuator]
    _check_amplitude(trial, limit, where)
    _check_frequency(trial, where)
    count = round(spec.duration / trial.command.period)
    time = np.arange(count, dtype=np.float64) * trial.command.period
    wave = float(spec.amplitude) * waveform(trial.excitation)(time)
    step = rate * trial.command.period
    if spec.actuator == "slip":
        return Excitation(spec.actuator, wave, trial.command.period)
    wave = _limit_rate(wave, step) if isinstance(spec, Square) else end_at_zero(wave)
    _check_rate(trial, wave, rate, where)
    return Excitation(spec.actuator, wave, trial.command.period)


def _check_frequency(trial: TrialFile, where: str) -> None:
    spec, period = trial.excitation, trial.command.period
    match spec:
        case Sweep():
            key, highest = max(("stop", spec.stop), ("start", spec.start), key=itemgetter(1))
        case Square():
            key, highest = "frequency", spec.frequency
        case Multisine():
            key, highest = "highest", spec.highest
            _check_multisine(spec, where)
    carried = 1 / (COMMANDS_PER_CYCLE * period)
    if highest > carried * (1 + 1e-9):
        raise InputError(
            f"excitation.{key} = {highest} is more than the command rate carries",
            where=where,
            expected=f"at most {shown(carried, highest)}: {COMMANDS_PER_CYCLE} commands in a"
            f" cycle, a command every {period}",
            found=f"{highest}",
            remedy="lower it or shorten command.period",
        )


def _check_multisine(spec: Multisine, where: str) -> None:
    lines = np.arange(1, int(spec.highest * spec.period + 1e-9) + 1, 2)
    if not np.any(lines >= spec.lowest * spec.period - 1e-9):
        raise InputError(
            "excitation: no odd harmonic lies between lowest and highest",
            where=where,
            found=f"{spec.lowest} .. {spec.highest} with a period of {spec.period}",
            remedy="lengthen the period or widen the band",
        )
    if spec.duration < spec.period:
        raise InputError(
            "excitation.duration is shorter than one period of the multisine",
            where=where,
            expected=f"at least {spec.period}",
            found=f"{spec.duration}",
            remedy="lengthen excitation.duration or shorten excitation.period",
        )


def _check_amplitude(trial: TrialFile, limit: float, where: str) -> None:
    amplitude = trial.excitation.amplitude
    if not 0 < amplitude <= limit and not amplitude == 0 == _least_amplitude(trial):
        key = {"throttle": "throttle_deviation"}.get(
            trial.excitation.actuator, trial.excitation.actuator
        )
        raise InputError(
            f"excitation.amplitude = {trial.excitation.amplitude} is outside the trial's limits",
            where=where,
            expected=f"above 0 and at most {shown(limit, amplitude)} (limits.{key})",
            found=f"{amplitude}",
            remedy=f"lower the amplitude, or widen limits.{key} if the rider can take it",
        )


def _least_amplitude(trial: TrialFile) -> float:
    """Return the least amplitude: a target may stand still, an excitation may not."""
    return 0.0 if trial.excitation.actuator == "slip" else math.inf


def _check_rate(trial: TrialFile, wave: FloatArray, rate: float, where: str) -> None:
    fastest = float(np.max(np.abs(np.diff(wave, prepend=0.0, append=0.0)))) / trial.command.period
    if isinstance(trial.excitation, Sweep | Multisine) and fastest > rate * (1 + 1e-9):
        raise InputError(
            "the excitation moves faster than the trial's rate limit",
            where=where,
            expected=f"at most {rate} (limits.{trial.excitation.actuator}_rate)",
            found=shown(fastest, rate),
            remedy="lower the amplitude or the highest frequency, or raise the rate limit",
        )


def _limit_rate(wave: FloatArray, step: float) -> FloatArray:
    """Waveform with ramps in place of jumps, of `step` per command, from zero and back to zero."""
    limited = np.empty_like(wave)
    value, last = 0.0, wave.size - 1
    for index, target in enumerate(wave):
        bound = (last - index) * step  # zero at the last command
        value += float(np.clip(np.clip(target, -bound, bound) - value, -step, step))
        limited[index] = value
    return limited
