"""The shape of a free curve, in words."""

import numpy as np

from slipbench.identification.mismatch.curves.curve import Curve
from slipbench.identification.mismatch.simulation.regressor import (
    HYSTERESIS,
    PAST,
    SCALE,
    TURN,
    step_response,
)
from slipbench.plant.signals import Floats

ONE_SIDED = 0.15
"""Even part over odd one beyond which the signs differ; a slope twice the other has 0.17."""

EVEN = 0.3
"""Share of a gain within which it counts as the same throughout."""


def shape_in_words(curve: Curve, unit: str = "") -> str:
    """Shape of a curve in words: its deviation from a straight line, where that is large.

    unit: of the quantity along which it acts.
    """
    z, f = curve.knots, curve.values
    if curve.kind == PAST:
        return _memory(z, f)
    if curve.kind == HYSTERESIS:
        return _hysteresis(z, f, unit)
    if curve.kind == TURN:
        return _around(f)
    if curve.kind == SCALE:
        return _gain(z, f, unit)
    if z[0] < 0.0 < z[-1] and min(-z[0], z[-1]) > 0.2 * max(-z[0], z[-1]):
        return _about_zero(curve, unit)
    return _slope_or_bump(z, f, unit)


def _slope_or_bump(z: Floats, f: Floats, unit: str) -> str:
    if not _curvature(z, f):
        return "linear"
    line = np.polynomial.Polynomial.fit(z, f, 1)
    return _bump(z, f - line(z), unit)


def _gain(z: Floats, f: Floats, unit: str) -> str:
    """Say how what it scales counts for more or less; a sign of z is nothing to a gain."""
    if np.ptp(f) < EVEN * np.max(np.abs(f)):
        return "a constant gain"
    return _slope_or_bump(z, f, unit)


def _memory(times: Floats, values: Floats) -> str:
    """Say within which time most of the answer to a step comes about."""
    time = np.geomspace(0.3 * times[times > 0.0].min(), times.max(), 200)
    moved = np.abs(step_response(times, values, time) - values[times == 0.0].sum())
    settled = float(time[np.argmax(moved >= (1.0 - np.exp(-1.0)) * moved.max())])
    return f"a dynamic response: 63 % of it within {settled:.2g} s"


def _around(values: Floats) -> str:
    """Say how often it goes up and down in a turn."""
    order = _order(values)
    return f"repeats every turn, largest at order {order}: {order} {'humps' if order > 1 else 'hump'} a turn"


def _hysteresis(widths: Floats, values: Floats, unit: str) -> str:
    """Say over which way it comes back most."""
    stops = widths > 0.0
    height = np.abs(values * widths)[stops]
    width = float(widths[stops][int(np.argmax(height))])
    way = _told(2.0 * width, unit)
    return f"a hysteresis, as of backlash or dry friction: width after a reversal {way}"


def _about_zero(curve: Curve, unit: str) -> str:
    z, f = curve.knots, curve.values
    reach = min(-z[0], z[-1])
    x = np.linspace(-reach, reach, 41)
    y = curve(x) - curve(np.zeros(1))
    odd, even = 0.5 * (y - y[::-1]), 0.5 * (y + y[::-1])
    if np.ptp(even) > 1.5 * np.ptp(odd):
        return "even: the same for both signs"
    inner = (np.interp(0.25 * reach, x, odd)) / 0.25
    outer = (odd[-1] - np.interp(0.75 * reach, x, odd)) / 0.25
    both = "" if np.ptp(even) < ONE_SIDED * np.ptp(odd) else ", different for the two signs"
    if abs(inner) < 0.4 * abs(outer):
        return "a dead zone around zero" + both
    if abs(outer) < 0.25 * abs(inner):
        return "a step at zero, constant beyond, as of dry friction or saturation" + both
    if _curvature(z, f):
        return f"a kink about {_told(_kink(z, f), unit)}" + both
    if both:
        return "a different slope for each sign"
    late = "rate" in curve.regressor or "acceleration" in curve.regressor
    return "linear" + (", as of a lag" if late else "")


def _told(value: float, unit: str) -> str:
    return f"{value:.3g} {unit}" if unit not in ("", "1") else f"{value:.3g}"


def _order(f: Floats) -> int:
    return 1 + int(np.argmax(np.abs(np.fft.rfft(f))[1:]))


def _curvature(z: Floats, f: Floats) -> bool:
    """Whether a straight line leaves much of it."""
    line = np.polynomial.Polynomial.fit(z, f, 1)
    return bool(np.ptp(f - line(z)) > 0.3 * np.ptp(f))


def _kink(z: Floats, f: Floats) -> float:
    """Knot at which the slope changes most."""
    return float(z[1 + int(np.argmax(np.abs(np.diff(np.diff(f) / np.diff(z)))))])


def _bump(z: Floats, bent: Floats, unit: str) -> str:
    top = int(np.argmax(np.abs(bent - np.median(bent))))
    if 0 < top < z.size - 1:
        return f"a local bump or dip about {_told(float(z[top]), unit)}"
    return "nonlinear, largest at the end of its range"
