"""The shape of a free curve, in words."""

import numpy as np

from slipbench.identification.mismatch.curves.curve import Curve
from slipbench.identification.mismatch.simulation.regressor import (
    DETAIL,
    HYSTERESIS,
    PAST,
    SCALE,
    TURN,
    step_response,
)
from slipbench.plant.signals import Floats

ONE_SIDED = 0.15
"""Ratio of even to odd part above which the two signs differ; slopes of ratio 2 have 0.17."""

EVEN = 0.3
"""Relative range of a gain below which it is constant."""

WAVES = 2
"""Waves over the range of a curve from which it is a ripple."""

RIPPLE = 0.5
"""Share of the power that these waves must have."""

POINTS = 512
"""Points at which a curve is sampled to find its waves."""


def shape_in_words(curve: Curve, unit: str = "") -> str:
    """Return the shape of a curve in words: its deviation from a straight line, if that is large.

    unit: of its regressor.
    """
    z, f = curve.knots, curve.values
    if curve.kind == PAST:
        return _memory(z, f)
    if curve.kind == HYSTERESIS:
        return _hysteresis(z, f, unit)
    if curve.kind == TURN:
        return _periodic(f)
    if curve.kind == SCALE:
        return _gain(z, f, unit)
    if curve.kind == DETAIL and (ripple := _ripple(z, f, unit)):
        return ripple
    if z[0] < 0.0 < z[-1] and min(-z[0], z[-1]) > 0.2 * max(-z[0], z[-1]):
        return _about_zero(curve, unit)
    return _slope_or_bump(z, f, unit)


def _slope_or_bump(z: Floats, f: Floats, unit: str) -> str:
    if not _curvature(z, f):
        return "linear"
    line = np.polynomial.Polynomial.fit(z, f, 1)
    return _bump(z, f - line(z), unit)


def _gain(z: Floats, f: Floats, unit: str) -> str:
    """Describe a gain over z; the sign of z is irrelevant."""
    if np.ptp(f) < EVEN * np.max(np.abs(f)):
        return "a constant gain"
    return _slope_or_bump(z, f, unit)


def _memory(times: Floats, values: Floats) -> str:
    """Describe a step response by its 63 % rise time."""
    time = np.geomspace(0.3 * times[times > 0.0].min(), times.max(), 200)
    response = np.abs(step_response(times, values, time) - values[times == 0.0].sum())
    rise_time = float(time[np.argmax(response >= (1.0 - np.exp(-1.0)) * response.max())])
    return f"a dynamic response: 63 % of it within {rise_time:.2g} s"


def _periodic(values: Floats) -> str:
    """Describe a periodic curve by its dominant order."""
    order = _order(values)
    return f"repeats every turn, largest at order {order}: {order} {'humps' if order > 1 else 'hump'} a turn"


def _ripple(z: Floats, f: Floats, unit: str) -> str:
    """Return the wavelength of a ripple in words; empty: there is none."""
    x = np.linspace(z[0], z[-1], POINTS)
    line = np.polynomial.Polynomial.fit(z, f, 1)
    power = np.abs(np.fft.rfft(np.hanning(POINTS) * (np.interp(x, z, f) - line(x)))) ** 2
    waves = int(np.argmax(power))
    if waves < WAVES or np.sum(power[waves - 1 : waves + 2]) < RIPPLE * np.sum(power):
        return ""
    return f"a ripple, one wave in about {_with_unit((z[-1] - z[0]) / waves, unit)}"


def _hysteresis(widths: Floats, values: Floats, unit: str) -> str:
    """Describe a hysteresis by its dominant width."""
    stops = widths > 0.0
    height = np.abs(values * widths)[stops]
    width = float(widths[stops][int(np.argmax(height))])
    width_text = _with_unit(2.0 * width, unit)
    return f"a hysteresis, as of backlash or dry friction: width after a reversal {width_text}"


def _about_zero(curve: Curve, unit: str) -> str:
    z, f = curve.knots, curve.values
    half_range = min(-z[0], z[-1])
    x = np.linspace(-half_range, half_range, 41)
    y = curve(x) - curve(np.zeros(1))
    odd, even = 0.5 * (y - y[::-1]), 0.5 * (y + y[::-1])
    if np.ptp(even) > 1.5 * np.ptp(odd):
        return "even: the same for both signs"
    inner = (np.interp(0.25 * half_range, x, odd)) / 0.25
    outer = (odd[-1] - np.interp(0.75 * half_range, x, odd)) / 0.25
    sign_note = "" if np.ptp(even) < ONE_SIDED * np.ptp(odd) else ", different for the two signs"
    if abs(inner) < 0.4 * abs(outer):
        return "a dead zone around zero" + sign_note
    if abs(outer) < 0.25 * abs(inner):
        return "a step at zero, constant beyond, as of dry friction or saturation" + sign_note
    if _curvature(z, f):
        return f"a kink about {_with_unit(_kink(z, f), unit)}" + sign_note
    if sign_note:
        return "a different slope for each sign"
    lag = "rate" in curve.regressor or "acceleration" in curve.regressor
    return "linear" + (", as of a lag" if lag else "")


def _with_unit(value: float, unit: str) -> str:
    return f"{value:.3g} {unit}" if unit not in ("", "1") else f"{value:.3g}"


def _order(f: Floats) -> int:
    return 1 + int(np.argmax(np.abs(np.fft.rfft(f))[1:]))


def _curvature(z: Floats, f: Floats) -> bool:
    """Return whether the residual of a straight-line fit is large."""
    line = np.polynomial.Polynomial.fit(z, f, 1)
    return bool(np.ptp(f - line(z)) > 0.3 * np.ptp(f))


def _kink(z: Floats, f: Floats) -> float:
    """Return the knot with the largest change of slope."""
    return float(z[1 + int(np.argmax(np.abs(np.diff(np.diff(f) / np.diff(z)))))])


def _bump(z: Floats, deviation: Floats, unit: str) -> str:
    top = int(np.argmax(np.abs(deviation - np.median(deviation))))
    if 0 < top < z.size - 1:
        return f"a local bump or dip about {_with_unit(float(z[top]), unit)}"
    return "nonlinear, largest at the end of its range"
