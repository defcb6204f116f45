"""The response of slip, freed of the noise of the speed that the slip is measured against.

    quiet = with_quiet_reference(response, u, motion, rate, band)

The force of the road on the vehicle depends on the slip of the driven wheel and on nothing else
that follows the input, so the speed over ground responds to the wheel as a mass does: s R_v = C(s)
(R_w - R_v), with R_w and R_v the responses of the driven wheel's speed and of the reference, C =
stiffness of the slip over v m behind the sensor's own lag. A resonance of the drivetrain is in both
R_w and R_v and not in C: C is smooth where the response itself is not. So it is fitted over the
whole band, as a polynomial in s of an order found by description length, where a line's noise acts
in one window only. What R_v has beyond the fit is noise of the sensor and of the wind, and is
removed.

Where the fit leaves more than noise (both axles driven, a front wheel that rings), nothing is done.
"""

from dataclasses import replace

import numpy as np
from scipy import stats

from slipbench.identification.response.independent_lines import freedom
from slipbench.identification.response.local_polynomial import sweep_response
from slipbench.identification.response.response import ComplexArray, FrequencyResponse
from slipbench.protocol.recording.channel import FloatArray

MOST_TERMS = 5
ROUNDS = 6  # of Gauss and Newton
QUIET = 1e-6  # of the wheel's response: a reference with less noise has none to be freed of
LEAST_PROBABILITY = 0.001  # of the misfit, if the vehicle is a mass behind its wheel


def with_quiet_reference(
    of: FrequencyResponse,
    u: FloatArray,
    slip: FloatArray,
    driven: FloatArray,
    reference: FloatArray,
    rate: float,
    band: tuple[float, float],
) -> FrequencyResponse:
    """Take the noise of the reference off a sweep's response of slip.

    u, slip, driven, reference: (n,), what `of` was estimated from and the speeds (m/s) behind it;
    rate, band: as in `sweep_response`. Gives `of` itself where the reference does not follow.
    """
    wheel, ground = (sweep_response(u, y, rate, band) for y in (driven, reference))
    if not np.all(ground.deviation > QUIET * np.abs(wheel.value)):
        return of
    felt = float(np.mean(driven) / np.mean(reference) ** 2)  # slip lost per speed of the reference
    alone = sweep_response(u, slip + felt * reference, rate, band)
    fit = _followed(wheel, ground)
    if fit is None:
        return of
    value, deviation = fit
    quiet = np.hypot(alone.deviation, felt * deviation)
    noise = (1 - of.coherence) * (quiet / of.deviation) ** 2
    better = quiet < of.deviation
    return replace(
        of,
        value=np.where(better, alone.value - felt * value, of.value),
        deviation=np.where(better, quiet, of.deviation),
        coherence=np.where(better, of.coherence / (of.coherence + noise), of.coherence),
        method=f"{of.method}, corrected for reference-sensor noise",
    )


def _followed(
    wheel: FrequencyResponse, ground: FrequencyResponse
) -> tuple[ComplexArray, FloatArray] | None:
    """Fit R_v: its values and their deviations at all lines; None where R_w does not explain it."""
    apart = slice(wheel.stride, -wheel.stride, wheel.stride)
    s = 2j * np.pi * wheel.frequency / wheel.frequency[-1]
    degrees = freedom(ground.quantile)
    inflation = degrees / (degrees - 2) if degrees > 4 else 2.0
    best, least = None, np.inf
    for terms in range(1, MOST_TERMS + 1):
        deviation = ground.deviation[apart] * np.sqrt(inflation)
        c, covariance, cost, left = _fit(
            s[apart], wheel.value[apart], ground.value[apart], deviation, terms
        )
        length = cost + terms * np.log(2 * s[apart].size)
        if length < least:
            best, least = (c, covariance, stats.chi2.sf(cost, left)), length
    assert best is not None
    c, covariance, probability = best
    if probability < LEAST_PROBABILITY:
        return None
    C, rows = _smooth(s, c)
    slope = rows * (wheel.value * s / (s + C) ** 2)[:, None]
    spread = np.einsum("ij,jk,ik->i", slope, covariance, np.conj(slope)).real
    return wheel.value * C / (s + C), np.sqrt(np.maximum(spread, 0.0))


def _smooth(s: ComplexArray, c: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    rows = s[:, None] ** np.arange(c.size)
    return rows @ c, rows


def _fit(
    s: ComplexArray, wheel: ComplexArray, ground: ComplexArray, deviation: FloatArray, terms: int
) -> tuple[FloatArray, FloatArray, float, int]:
    """Real coefficients of C, (terms,), their covariance, chi-square, degrees of freedom."""
    weight = np.sqrt(2) / deviation
    rows = _smooth(s, np.zeros(terms))[1]
    c = _least(
        rows * ((wheel - ground) * weight / np.abs(s))[:, None], s * ground * weight / np.abs(s)
    )[0]
    for _ in range(ROUNDS):
        C, _ = _smooth(s, c)
        slope = rows * (wheel * s / (s + C) ** 2 * weight)[:, None]
        error = (ground - wheel * C / (s + C)) * weight
        step, covariance = _least(slope, error)
        c = c + step
    C, _ = _smooth(s, c)
    cost = float(np.sum(np.abs((ground - wheel * C / (s + C)) * weight) ** 2))
    left = max(2 * s.size - terms, 1)
    return c, covariance * max(1.0, cost / left), cost, left


def _least(system: ComplexArray, right: ComplexArray) -> tuple[FloatArray, FloatArray]:
    """Real solution of a complex least-squares problem, and its covariance."""
    A = np.concatenate((system.real, system.imag))
    covariance: FloatArray = np.asarray(np.linalg.pinv(A.T @ A), dtype=np.float64)
    return covariance @ (A.T @ np.concatenate((right.real, right.imag))), covariance
