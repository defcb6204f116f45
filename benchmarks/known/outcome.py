"""One ride against the truth: errors, and whether 95 % intervals hold."""

from dataclasses import dataclass
from functools import partial

import numpy as np
from rides import driveline, estimated, ride, still_speed, truth

from known.cases import Case, motorcycle_of
from slipbench.identification.models.delay_profile import DelayProfile, delay_profile
from slipbench.identification.models.model_order import all_pole, choose_order, doubted
from slipbench.identification.models.rational_ml import ACROSS, RationalFit
from slipbench.identification.response.independent_lines import Lines, independent_lines, without
from slipbench.identification.response.response import FrequencyResponse
from slipbench.plant.motorcycle import Motorcycle
from slipbench.studies.paper.rational_trial import known_path

COHERENT = 0.95
PROFILED = 4  # every so many rides the delay is profiled: it takes longer than the rest
POINTS = 16


@dataclass(frozen=True)
class Outcome:
    """One ride against the truth.

    lines, model   (n, 2) errors of gain (%) and phase (degrees) where coherence exceeds 0.95
    coherent       share of the lines where it does
    driveline      errors of frequency and damping, %
    delay          estimate less truth, and the interval's ends less it, ms; NaN: not identified
    held           whether or how often 95 % intervals hold: lines, model, frequency, damping, delay
    ratio          chi-square over its degrees of freedom
    """

    lines: np.ndarray
    model: np.ndarray
    coherent: float
    driveline: tuple[float, float]
    delay: tuple[float, float, float]
    held: tuple[float, float, float, float, float]
    ratio: float


def outcome(job: tuple[Case, int]) -> Outcome | None:
    """Ride once and compare; None where the recording carries no model."""
    case, seed = job
    motorcycle = motorcycle_of(case, seed)
    one = ride(motorcycle, case.noise, seed, case.lasts)
    faster = one.speed - still_speed(motorcycle, case.lasts)
    response = estimated(one)
    lines = independent_lines(response)
    if not isinstance(lines, Lines):
        return None
    return judged(response, lines, motorcycle, faster, seed % PROFILED == 0)


def judged(
    response: FrequencyResponse, lines: Lines, motorcycle: Motorcycle, faster: float, profiled: bool
) -> Outcome:
    """Compare one response with the truth at its speed. The model is a chain, its order by MDL."""
    at = partial(truth(motorcycle), faster=faster)
    fit = doubted(choose_order(lines, all_pole()))
    inside = (response.frequency >= lines.frequency[0]) & (
        response.frequency <= lines.frequency[-1]
    )
    good = inside & (response.coherence > COHERENT)
    f = response.frequency[good]
    off, held = _driveline(fit, *driveline(motorcycle, faster))
    delay, delay_held = _delay(lines, motorcycle) if profiled else ((np.nan,) * 3, np.nan)
    g, true = lines.frequency, np.abs(at(lines.frequency))
    own = np.isin(response.frequency, g)
    return Outcome(
        _errors(response.value[good] / at(f)),
        _errors(fit.response(f) / at(f)),
        float(np.mean(good[inside])),
        off,
        delay,
        (
            float(np.mean(np.abs(np.abs(lines.value) - true) < response.gain_band[own])),
            float(np.mean(np.abs(np.abs(fit.response(g)) - true) < fit.band(g))),
            *held,
            delay_held,
        ),
        fit.chi_square_ratio,
    )


def _errors(ratio: np.ndarray) -> np.ndarray:
    return np.stack((100 * np.abs(np.abs(ratio) - 1), np.degrees(np.abs(np.angle(ratio)))), axis=1)


def _driveline(
    fit: RationalFit, frequency: float, damping: float
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Errors in % of the least damped mode inside the band, and whether the intervals hold.

    NaN where the true driveline resonates beyond the last line: no recording shows it there.
    """
    top = fit.lines.frequency[-1]
    if not frequency < top:
        return (np.nan, np.nan), (np.nan, np.nan)
    mode = min(fit.modes, key=lambda m: (m.frequency > top, m.damping))
    off = (mode.frequency - frequency, mode.damping - damping)
    held = (
        float(abs(off[0]) < ACROSS * mode.frequency_deviation),
        float(abs(off[1]) < ACROSS * mode.damping_deviation),
    )
    return (100 * abs(off[0]) / frequency, 100 * abs(off[1]) / damping), held


def _delay(lines: Lines, motorcycle) -> tuple[tuple[float, float, float], float]:
    """Error of the delay and its interval, ms, and whether that holds it; NaN: not identified."""
    true = 1e3 * motorcycle.intake.delay
    rest = without(lines, known_path(motorcycle))
    profile = delay_profile(choose_order(rest, all_pole()), points=POINTS)
    if not isinstance(profile, DelayProfile):
        return (np.nan, np.nan, np.nan), np.nan
    errors = tuple(1e3 * d - true for d in (profile.delay, profile.low, profile.high))
    return errors, float(errors[1] <= 0 <= errors[2])
