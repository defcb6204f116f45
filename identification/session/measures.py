"""Figures measured in a run's recording, on which the quick look is based."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from slipbench.identification.response.identify import Identification
from slipbench.identification.response.response import FrequencyResponse, reliable_band
from slipbench.identification.response.responses import INPUTS, excited_actuator
from slipbench.identification.session.margins import margins, requests
from slipbench.identification.session.pooled import pooled
from slipbench.identification.session.repeatability import Repeatability, repeatability
from slipbench.identification.signals.trial_window import TrialWindow
from slipbench.protocol.trial_file import RPM, Limits, Multisine, Square, Sweep, TrialFile

STOP = 0.001  # of the opening, or rad: resolution of commands and of the position sensor
HARMONICS = 5  # of a square wave that count as planned: the others have under 1 % of its power


@dataclass(frozen=True)
class Measures:
    """Figures of one run.

    run, trial      names of the run folder and of the trial
    actuator        that was excited
    amplitude       of the trial, as written
    point           operating point of the trial, for people
    response        from command to slip; None: `no_response` says why
    planned, band   planned and reliable band, Hz
    covered         share of the planned lines that are reliable
    coherence       median over the planned band
    repeatability   against the pooled earlier repeats; None without any
    repeats         number of earlier repeats
    clipping        share of the excitation that the actuator did not follow, or at its stop
    margins         by limit; 1: nothing used, 0: at the limit
    larger          amplitude that the trial's own limits still allow, over the present one
    trip, detail    reason of the trip, "" without; and in words
    late            why the timing is invalid, "" where it is valid
    lateness        largest lateness of a tick, s
    """

    run: str
    trial: str
    actuator: str = ""
    amplitude: str = ""
    point: str = ""
    response: FrequencyResponse | None = None
    no_response: str = ""
    planned: tuple[float, float] | None = None
    band: tuple[float, float] | None = None
    covered: float = 0.0
    coherence: float = math.nan
    repeatability: Repeatability | None = None
    repeats: int = 0
    clipping: float = 0.0
    margins: Mapping[str, float] = field(default_factory=dict)
    larger: float = 1.0
    trip: str = ""
    detail: str = ""
    late: str = ""
    lateness: float = math.nan


def measures(found: Identification, earlier: Sequence[FrequencyResponse] = ()) -> Measures:
    """Figures of an identified run. earlier: responses of the same trial from command to slip."""
    recording, trial = found.recording, found.recording.trial
    outcome = recording.description.get("outcome", {})
    lateness = recording.description.get("lateness", {})
    trip = str(outcome.get("trip", ""))
    actuator = ""
    if isinstance(found.window, TrialWindow):
        actuator = excited_actuator(trial, found.base, found.window)
    response = next(
        (r for r in found.responses if actuator and (r.input, r.output) == _path(actuator)), None
    )
    planned = _planned(trial, response)
    lines = _planned_lines(response, trial, planned)
    return Measures(
        recording.folder.name,
        trial.name if trial else "",
        actuator,
        str(trial.excitation.amplitude) if trial else "",
        _point(trial),
        response,
        "" if response else _why_not(found),
        planned,
        reliable_band(response) if response else None,
        float(np.mean(response.reliable[lines])) if response and lines.any() else 0.0,
        float(np.median(response.coherence[lines])) if response and lines.any() else math.nan,
        repeatability(response, pooled(earlier)) if response and earlier else None,
        len(earlier),
        _clipping(found, actuator),
        margins(found),
        _larger(trial),
        "" if trip == "none" else trip,
        str(outcome.get("detail", "")),
        str(outcome.get("invalid", "")),
        float(lateness.get("max", math.nan)),
    )


def _path(actuator: str) -> tuple[str, str]:
    return INPUTS[actuator][0], "slip"


def _point(trial: TrialFile | None) -> str:
    if trial is None:
        return ""
    point = trial.operating_point
    return f"gear {point.gear}, {point.engine_speed / RPM:.0f} rpm"


def _why_not(found: Identification) -> str:
    if not isinstance(found.window, TrialWindow):
        return found.window.reason
    reasons = [one.reason for one in found.left_out if "response" in one.analysis]
    return reasons[0] if reasons else "no response from command to slip was estimated"


def _planned(
    trial: TrialFile | None, response: FrequencyResponse | None
) -> tuple[float, float] | None:
    """Lowest and highest frequency that the excitation was made for, Hz."""
    match trial.excitation if trial else None:
        case Sweep(start=start, stop=stop):
            return min(float(start), float(stop)), max(float(start), float(stop))
        case Multisine(lowest=lowest, highest=highest):
            return float(lowest), float(highest)
        case Square(frequency=frequency):
            return float(frequency), HARMONICS * float(frequency)
    if response is None:
        return None
    return float(response.frequency[0]), float(response.frequency[-1])


def _planned_lines(
    response: FrequencyResponse | None, trial: TrialFile | None, planned: tuple[float, float] | None
) -> np.ndarray:
    """Lines of a response in the planned band; a sweep that ended early lacks those above."""
    if response is None or planned is None:
        return np.zeros(0, dtype=bool)
    frequency = response.frequency
    return np.asarray((frequency >= 0.999 * planned[0]) & (frequency <= 1.001 * planned[1]))


def _clipping(found: Identification, actuator: str) -> float:
    """Share of the requests that the actuator did not follow, or did at its mechanical stop.

    A request counts that lies outside the range which the applied command reached; this does not
    depend on the delay between them.
    """
    if not isinstance(found.window, TrialWindow) or actuator not in INPUTS:
        return 0.0
    part = found.window.exciting
    command, position = (found.base.get(role) for role in INPUTS[actuator])
    requested = requests(found, actuator)
    unreached = at_stop = 0.0
    if command is not None and requested:
        value, applied = requested["value"], command[part]
        low, high = np.nanmin(applied) - STOP, np.nanmax(applied) + STOP
        unreached = float(np.mean((value < low) | (value > high)))
    if actuator == "throttle" and position is not None:
        at_stop = float(np.mean((position[part] <= STOP) | (position[part] >= 1.0 - STOP)))
    return max(unreached, at_stop)


def _larger(trial: TrialFile | None) -> float:
    """Amplitude that the limits on the command allow, over the present one."""
    if trial is None or not trial.excitation.amplitude:
        return 1.0
    limits: Limits = trial.limits
    allowed = {
        "throttle": limits.throttle_deviation,
        "spark": min(-limits.spark[0], limits.spark[1]),
        "slip": limits.slip,
    }[trial.excitation.actuator]
    return float(allowed) / float(trial.excitation.amplitude)


def unreadable(run: Path, reason: str) -> Measures:
    """Figures of a run that cannot be read or identified."""
    return Measures(run.name, "", no_response=reason)


def tree(of: Measures) -> dict[str, Any]:
    """Figures for quick_look.json: SI, frequencies in Hz, NaN as null."""
    found = of.repeatability
    return {
        "run": of.run,
        "trial": of.trial,
        "actuator": of.actuator,
        "amplitude": of.amplitude,
        "operating_point": of.point,
        "planned_band": of.planned and list(of.planned),
        "reliable_band": of.band and list(of.band),
        "covered": of.covered,
        "coherence": _finite(of.coherence),
        "repeatability": found
        and {
            "distance": found.distance,
            "expected": found.expected,
            "chance": found.chance,
            "lines": found.lines,
            "repeats": of.repeats,
        },
        "clipping": of.clipping,
        "margins": dict(of.margins),
        "trip": of.trip,
        "detail": of.detail,
        "late": of.late,
        "lateness": _finite(of.lateness),
        "no_response": of.no_response,
        "response": of.response and response_tree(of.response),
    }


def response_tree(of: FrequencyResponse) -> dict[str, Any]:
    """A response for JSON; `response_from` reads it."""
    return {
        "input": of.input,
        "output": of.output,
        "frequency": of.frequency.tolist(),
        "real": of.value.real.tolist(),
        "imaginary": of.value.imag.tolist(),
        "coherence": of.coherence.tolist(),
        "deviation": of.deviation.tolist(),
        "quantile": of.quantile,
        "method": of.method,
        "stride": of.stride,
    }


def response_from(made: Mapping[str, Any]) -> FrequencyResponse:
    """Response that `response_tree` wrote."""
    return FrequencyResponse(
        made["input"],
        made["output"],
        np.asarray(made["frequency"], dtype=np.float64),
        np.asarray(made["real"]) + 1j * np.asarray(made["imaginary"]),
        np.asarray(made["coherence"], dtype=np.float64),
        np.asarray(made["deviation"], dtype=np.float64),
        float(made["quantile"]),
        str(made["method"]),
        int(made["stride"]),
    )


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
