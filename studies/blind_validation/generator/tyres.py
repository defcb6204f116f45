"""Four formulas for the longitudinal force of a tyre, all with slope C at zero and peak D.

s: slip; C: N per slip; D: N. Pacejka's magic formula and the brush model: Pacejka, "Tire and
Vehicle Dynamics", 3rd ed. (2012), chapters 3 and 4. Dugoff, Fancher and Segel, SAE 700377 (1970).
Burckhardt, "Fahrwerktechnik: Radschlupf-Regelsysteme" (1993), with a slow fall beyond the peak.
"""

import math

from numba import njit

MAGIC, BRUSH, DUGOFF, BURCKHARDT = range(4)
NAMES = ("magic formula", "brush", "Dugoff", "Burckhardt")
FALL = 0.35  # of Burckhardt's curve, per slip and peak


@njit(cache=True, error_model="numpy")
def force(formula: int, s: float, C: float, D: float, shape: float) -> float:
    """Longitudinal force of the tyre, N."""
    if formula == BRUSH:
        return brush(s, C, D)
    if formula == DUGOFF:
        return dugoff(s, C, D)
    if formula == BURCKHARDT:
        return burckhardt(s, C, D)
    return D * math.sin(shape * math.atan(C / (shape * D) * s))


@njit(cache=True, error_model="numpy")
def brush(s: float, C: float, D: float) -> float:
    """Brush model with parabolic pressure: sliding begins at the rear of the contact patch."""
    left = max(1.0 - C / (3.0 * D) * abs(s), 0.0)
    return math.copysign(D * (1.0 - left**3), s)


@njit(cache=True, error_model="numpy")
def dugoff(s: float, C: float, D: float) -> float:
    """Dugoff's model: linear up to half the peak, then a hyperbola towards it."""
    linear = C * abs(s)
    reached = linear if linear < 0.5 * D else D * (1.0 - 0.25 * D / linear)
    return math.copysign(reached, s)


@njit(cache=True, error_model="numpy")
def burckhardt(s: float, C: float, D: float) -> float:
    """Burckhardt's model: a saturating exponential less a linear fall."""
    high, fall = 1.05 * D, FALL * D
    rise = (C + fall) / high
    return math.copysign(high * (1.0 - math.exp(-rise * abs(s))) - fall * abs(s), s)
