"""Messages for the page: figures as a pit wall reads them, in JSON."""

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

from slipbench.bench.session.rider_line import PHASES, instruction
from slipbench.bench.view.observer import SAMPLED, Observed
from slipbench.protocol.codec.messages import Phase, TripReason
from slipbench.protocol.trial_file import RPM, TrialFile

KMH = 1 / 3.6  # m/s
SCALES = {"throttle_request": 100.0, "throttle": 100.0, "slip": 100.0, "engine_speed": 1 / RPM}
"""Factors from SI to the units of the page: %, rpm, km/h."""
SCALES |= {"wheel_speed": 1 / KMH, "speed": 1 / KMH}
UNITS = {"throttle_request": "%", "throttle": "%", "slip": "%", "engine_speed": "rpm"}
"""Units of the page."""
UNITS |= {"wheel_speed": "km/h", "speed": "km/h"}
FACTORS = tuple(SCALES.get(name, 1.0) for name in SAMPLED)
DIGITS = 7


def to_json(tree: Mapping[str, Any]) -> str:
    """Text of a message; numbers that are unknown (NaN) or infinite become null."""
    return json.dumps(_plain(tree), allow_nan=False, separators=(",", ":"))


def _plain(value: Any) -> Any:
    if isinstance(value, float):
        return float(f"{value:.{DIGITS}g}") if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): _plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(each) for each in value]
    return value


def scaled(samples: Sequence[tuple[float, ...]], start: float) -> list[list[float]]:
    """Samples in the units of the page, time in s since `start` (s). Shape (n, 7)."""
    return [
        [
            (value - start if index == 0 else value) * FACTORS[index]
            for index, value in enumerate(sample)
        ]
        for sample in samples
    ]


def trial_message(trial: TrialFile) -> dict[str, Any]:
    """Constant properties of a trial while it runs."""
    return {
        "trial": trial.name,
        "instruction": instruction(trial),
        "distance": trial.limits.distance,
        "gear": trial.operating_point.gear,
    }


def state_message(observed: Observed, trial: TrialFile, start: float) -> dict[str, Any]:
    """State of a trial after its last frame. start: s, of the recording."""
    vehicle, phase = observed.vehicle, observed.phase
    return {
        "time": observed.time - start,
        "phase": phase.name.lower() if phase is not None else None,
        "line": _line(observed, trial),
        "trip": observed.trip.name.lower() if observed.trip != TripReason.NONE else "",
        "rpm": vehicle.engine.engine_speed / RPM,
        "gear": vehicle.engine.gear if math.isfinite(vehicle.engine.engine_speed) else None,
        "speed": vehicle.speed / KMH,
        "slip": observed.slip * 100,
        "limits": observed.limits,
        "load": observed.bus_load,
        "faults": observed.faults,
        "frames": observed.frames,
        "distance_left": trial.limits.distance - vehicle.distance
        if "distance" in observed.limits
        else None,
    }


def _line(observed: Observed, trial: TrialFile) -> str:
    """Next action of the rider, or the missing condition for arming."""
    if observed.phase in (None, Phase.IDLE):
        return (
            observed.not_armed
            or f"keep gear and engine speed for {trial.operating_point.steady_for}"
        )
    return PHASES[observed.phase]
