"""Headline of a report: the main result of a recording in a sentence."""

from collections.abc import Mapping

import numpy as np

from slipbench.identification.report import slip_control
from slipbench.identification.report.words import decibel, name, response_unit
from slipbench.identification.response.identify import Identification, slip_range
from slipbench.identification.response.resonance import Resonance
from slipbench.identification.response.response import (
    RELIABLE_COHERENCE,
    FrequencyResponse,
    least_coherence,
    reliable_band,
)
from slipbench.identification.signals.motion import Motion
from slipbench.identification.signals.trial_window import NoExcitation, TrialWindow, trip_in_words
from slipbench.protocol.recording.recording import Recording

MOST = 0.97  # share of the excited band; a coherent band as wide counts as all of it


def headline(found: Identification) -> str:
    """Main result of a recording in one to three sentences."""
    if found.following is not None:
        parts = [slip_control.sentence(found.following)]
    else:
        parts = [_response(found.main, found)] if found.main else [_without(found)]
    if isinstance(found.window, TrialWindow) and found.window.trip:
        parts.append(
            f"The trial tripped at {found.window.trip_time:.2f} s: "
            f"{trip_in_words(found.window.trip)}."
        )
    if why := _not_valid(found.recording):
        parts.append(f"The trial is marked invalid: {why}.")
    return " ".join(parts)


def _not_valid(recording: Recording) -> str:
    """Reason why the bench marked the trial invalid; empty for a valid or no trial."""
    outcome = recording.description.get("outcome")
    why = outcome.get("invalid") if isinstance(outcome, Mapping) else None
    return why if isinstance(why, str) else ""


def _response(main: FrequencyResponse, found: Identification) -> str:
    factor, unit = response_unit(main)
    actuator = "spark" if main.input.startswith("spark") else "throttle"
    path = f"of {name(main.output)} to {name(main.input) if found.pair else actuator}"
    quality = coherence(main)
    if isinstance(found.resonance, Resonance):
        peak = found.resonance
        return (
            f"The response {path} has a resonance at "
            f"{peak.frequency:.1f}\u00a0Hz, {decibel(peak.peak):.1f}\u00a0dB above its DC gain of "
            f"{peak.low_gain * factor:.2g} {unit}; {quality}."
        )
    return (
        f"The response {path} was measured; {quality}. No resonance is given: "
        f"{found.resonance.reason}."
    )


def coherence(main: FrequencyResponse) -> str:
    """Coherence between input and slip, and in which band."""
    low, high = main.frequency[0], main.frequency[-1]
    band = reliable_band(main)
    if band is None:
        return f"coherence is under {RELIABLE_COHERENCE:g} from {low:.2g} to {high:.3g}\u00a0Hz"
    least = np.floor(100 * least_coherence(main)) / 100
    said = f"coherence is at least {least:.2f} from {band[0]:.2g} to {band[1]:.3g}\u00a0Hz"
    whole = band[1] - band[0] > MOST * (high - low)
    return said if whole else f"{said} (excited: {low:.2g} to {high:.3g}\u00a0Hz)"


def _without(found: Identification) -> str:
    if found.pair is not None and (why := why_not(found)):
        return (
            f"The response of {name(found.pair[1])} to {name(found.pair[0])} is not given: {why}."
        )
    sentence = _slip(found)
    if isinstance(found.window, NoExcitation):
        return f"{sentence} No frequency response is given: {found.window.reason}."
    return f"{sentence} No frequency response is given; see the analyses left out."


def why_not(found: Identification) -> str:
    """Reason why the selected response is not given; empty where nothing says one."""
    analysis = "response from {} to {}".format(*(found.pair or ("", "")))
    return next((one.reason for one in found.left_out if one.analysis == analysis), "")


def _slip(found: Identification) -> str:
    moved = found.motion
    if not isinstance(moved, Motion):
        return f"Slip cannot be computed from this recording: {moved.reason}."
    span, reach = slip_range(found), moved.reference[np.isfinite(moved.reference)]
    if span is None:
        top = np.nanmax(moved.slip.speed) if np.isfinite(moved.slip.speed).any() else 0.0
        return f"{moved.slip.statement} It reached {top * 3.6:.0f} km/h."
    return (
        f"{name('slip').capitalize()} of the {moved.axle.axle} axle was "
        f"{span[0] * 100:.1f} to {span[1] * 100:.1f} % (99 % of the defined samples) "
        f"at speeds up to {reach.max() * 3.6:.0f} km/h."
    )
