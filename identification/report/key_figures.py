"""Contents of `identification.json`: results of a recording in SI units."""

import math
from typing import Any

import numpy as np

from slipbench.identification.models.study import Study
from slipbench.identification.report import model_tables, validation_tables
from slipbench.identification.report.headline import headline
from slipbench.identification.report.identification_file import IDENTIFICATION_VERSION
from slipbench.identification.report.run_verdict import RunVerdict
from slipbench.identification.response.identify import Identification, slip_range
from slipbench.identification.response.resonance import Resonance, low_frequency_delay
from slipbench.identification.response.response import (
    FrequencyResponse,
    least_coherence,
    reliable_band,
)
from slipbench.identification.signals.clocks import ClockFit, Unaligned
from slipbench.identification.signals.motion import Motion
from slipbench.identification.signals.teeth import tooth_interval
from slipbench.identification.signals.trial_window import TrialWindow
from slipbench.protocol.recording.channel import FloatArray


def key_figures(
    found: Identification, study: Study, verdict: RunVerdict | None = None
) -> dict[str, Any]:
    """Results as a tree. Frequencies in Hz, times in s, slip and openings as ratios.

    The tree is that of `IdentificationFile`, whose JSON schema is docs/reference/identification.schema.json.
    """
    return {
        "schema_version": IDENTIFICATION_VERSION,
        "recording": found.recording.folder.name,
        "duration": found.recording.duration,
        "headline": headline(found),
        "verdict": verdict and {"word": verdict.word, "reasons": list(verdict.reasons)},
        "selected": found.pair and {"input": found.pair[0], "output": found.pair[1]},
        "trial": _trial(found),
        "slip": _slip(found),
        "resonance": _resonance(found),
        "reliable_band": found.main and reliable_band(found.main),
        "coherence_min": found.main and _rounded(least_coherence(found.main)),
        "delays": delays(found),
        "clocks": {name: _clock(fit) for name, fit in found.data.clocks.items()},
        "faults": [
            {"message": f.message, "fault": f.fault, "count": f.count, "first_time": f.first_time}
            for f in found.recording.faults
        ],
        "warnings": list(found.recording.description.get("warnings", [])),
        "left_out": [
            {"analysis": x.analysis, "reason": x.reason, "missing_roles": list(x.roles)}
            for x in (*found.left_out, *study.left_out)
        ],
        "models": [model_tables.figures(model) for model in study.models],
        "validations": [validation_tables.figures(one) for one in study.validations],
        "responses": [_response(r) for r in found.responses],
    }


def delays(found: Identification) -> dict[str, float]:
    """Delays, s: of the encoder at mean speed; low-frequency group delay of the main response."""
    known: dict[str, float] = {}
    moved = found.motion
    if isinstance(moved, Motion) and moved.axle.teeth_per_turn and moved.axle.radius:
        driven = moved.driven[_part(found)]
        speed = float(np.nanmean(driven)) if np.isfinite(driven).any() else 0.0
        if speed > 0:
            known["encoder"] = tooth_interval(speed, moved.axle.radius, moved.axle.teeth_per_turn)
    if found.main is not None and np.count_nonzero(found.main.reliable) >= 3:
        peak = found.resonance.frequency if isinstance(found.resonance, Resonance) else math.inf
        known[main_delay(found)] = low_frequency_delay(found.main, peak)
    return {key: _rounded(value) for key, value in known.items()}


def main_delay(found: Identification) -> str:
    """Key of the group delay of the main response."""
    slip = found.main is None or found.main.output == "slip"
    return "input_to_slip" if slip else "input_to_output"


def servo_bandwidth(found: Identification) -> float | None:
    """Bandwidth of the throttle servo (-3 dB), Hz; None where it lies outside the band."""
    servo = next((r for r in found.responses if r.output == "throttle_position"), None)
    if servo is None or not servo.reliable.any():
        return None
    gain, frequency = servo.gain[servo.reliable], servo.frequency[servo.reliable]
    below = np.flatnonzero(gain < gain[: max(3, gain.size // 20)].mean() / np.sqrt(2))
    return float(frequency[below[0]]) if below.size else None


def _part(found: Identification) -> slice:
    return found.window.exciting if isinstance(found.window, TrialWindow) else slice(None)


def _trial(found: Identification) -> dict[str, Any] | None:
    window, time = found.window, found.base.time
    if not isinstance(window, TrialWindow):
        return None
    name = found.recording.trial.name if found.recording.trial else None
    last = min(window.exciting.stop, time.size - 1)
    excited = [float(time[window.exciting.start]), float(time[last])]
    return {"name": name, "excited": excited, "trip": window.trip.name.lower()}


def _slip(found: Identification) -> dict[str, Any] | None:
    moved, span = found.motion, slip_range(found)
    if not isinstance(moved, Motion):
        return None
    ends = {"low": _rounded(span[0]), "high": _rounded(span[1])} if span else {}
    mean = {"mean": _rounded(np.nanmean(moved.slip.ratio[_part(found)]))} if span else {}
    return {
        **ends,
        **mean,
        "defined_share": _rounded(moved.slip.defined),
        "driven": moved.axle.method,
        "reference": moved.reference_name,
        "line_reduction_db": moved.line_reduction and _rounded(moved.line_reduction),
        "rolling_radius_ratio": moved.radius and _rounded(moved.radius.ratio, 6),
    }


def _resonance(found: Identification) -> dict[str, Any]:
    peak = found.resonance
    if not isinstance(peak, Resonance):
        return {"frequency": None, "reason": peak.reason}
    return {
        "frequency": _rounded(peak.frequency),
        "peak": _rounded(peak.peak),
        "low_frequency_gain": _rounded(peak.low_gain),
        "servo_bandwidth": servo_bandwidth(found),
    }


def _clock(fit: ClockFit | Unaligned) -> dict[str, Any]:
    if isinstance(fit, Unaligned):
        return {"aligned": False, "reason": fit.reason}
    return {
        "aligned": True,
        "drift_ppm": _rounded(fit.drift * 1e6),
        "offset": fit.offset,
        "latency_p50": _rounded(fit.latency_p50),
        "latency_p99": _rounded(fit.latency_p99),
        "samples": fit.samples,
    }


def _response(of: FrequencyResponse) -> dict[str, Any]:
    return {
        "input": of.input,
        "output": of.output,
        "method": of.method,
        "frequency": _list(of.frequency),
        "gain": _list(of.gain),
        "phase": _list(of.phase),
        "coherence": _list(of.coherence),
        "deviation": _list(of.deviation),
    }


def _list(values: FloatArray) -> list[float]:
    return [_rounded(value) for value in values]


def _rounded(value: float | np.floating[Any], digits: int = 5) -> float:
    return float(f"{float(value):.{digits}g}")
