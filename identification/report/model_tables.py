"""A fitted model as table rows and as a tree for identification.json."""

from typing import Any

import numpy as np

from slipbench.identification.models.delay_profile import DelayProfile
from slipbench.identification.models.rational_ml import ACROSS, Mode, RationalFit
from slipbench.identification.models.recommended import Recommended
from slipbench.identification.models.roots import oscillating, real_poles
from slipbench.identification.report.words import name, response_unit, time_unit, with_interval
from slipbench.identification.response.response import ComplexArray

Rows = list[tuple[str, str]]
FASTEST = 3.0  # times the top of the band; faster poles are not listed


def rows(of: Recommended) -> Rows:
    """Rows of the model: order, residual test, dead time, poles, zeros; 95 % intervals."""
    fit = of.fit
    factor, unit = response_unit(of.response)
    low = fit.lines.frequency[:1]
    gain, band = float(np.abs(fit.response(low))[0]), float(fit.band(low)[0])
    made = [
        ("Order", f"{fit.order}, selected by MDL; {_others(of)}"),
        (
            "Residual test",
            f"{'passed' if of.adequate else 'failed'} (p = {fit.adequate:.2g}): chi-square "
            f"{fit.chi_square_ratio:.2f} per degree of freedom, {fit.freedom} degrees of freedom",
        ),
        ("Dead time", delay_in_words(of)),
        *_poles(fit),
        *_zeros(fit.model.zeros),
        (f"Gain at {low[0]:.2g} Hz", f"{factor * gain:.3g} ± {factor * band:.2g} {unit}"),
        (
            "Drift below the band",
            f"{with_interval(fit.drift[0], ACROSS * fit.drift[1])} rad/s, not part of the model",
        ),
    ]
    return [*made, ("Notes", " ".join(of.words))]


def title(of: Recommended) -> str:
    """Heading of a model: its input and output."""
    return f"{name(of.response.input)} to {name(of.response.output)}".capitalize()


def delay_in_words(of: Recommended) -> str:
    """Dead time with its 95 % interval as text, or the reason why there is none."""
    found = of.delay
    if not isinstance(found, DelayProfile):
        return f"not identified: {found.reason}"
    factor, each = time_unit(found.delay)
    delay, low, high = (f"{factor * t:.1f}" for t in (found.delay, found.low, found.high))
    return f"{delay} {each}, 95 % interval {low} to {high} {each}"


def pole_in_words(frequency: float, half_width: float) -> str:
    """Frequency of a pole, Hz, as text with the half width of its 95 % interval."""
    if half_width > frequency:
        return f"about {frequency:.2g} Hz, not identifiable from this recording"
    return f"{with_interval(frequency, half_width)} Hz"


def mode_in_words(mode: Mode) -> str:
    """Frequency and damping ratio of a pair as text with 95 % intervals."""
    half = ACROSS * mode.frequency_deviation
    frequency = pole_in_words(mode.frequency, half)
    if half > mode.frequency:
        return frequency
    damping = with_interval(mode.damping, ACROSS * mode.damping_deviation)
    return f"{frequency}, damping ratio {damping}"


def figures(of: Recommended) -> dict[str, Any]:
    """Model as a tree: SI units, poles and zeros as pairs of real and imaginary part."""
    fit, model = of.fit, of.fit.model
    delay = of.delay
    interval = [delay.low, delay.high] if isinstance(delay, DelayProfile) else None
    return {
        "input": of.response.input,
        "output": of.response.output,
        "poles": _pairs(model.poles),
        "zeros": _pairs(model.zeros),
        "gain": model.gain,
        "delay": model.delay,
        "delay_interval": interval,
        "chi_square_ratio": fit.chi_square_ratio,
        "freedom": fit.freedom,
        "probability": fit.adequate,
        "adequate": of.adequate,
        "drift": list(fit.drift),
        "modes": [
            {
                "frequency": m.frequency,
                "damping": m.damping,
                "frequency_deviation": m.frequency_deviation,
                "damping_deviation": m.damping_deviation,
            }
            for m in fit.modes
        ],
        "orders": [
            {
                "poles": row.order.poles,
                "zeros": row.order.zeros,
                "nats": row.nats,
                "chi_square_ratio": row.fit.chi_square_ratio,
            }
            for row in of.choice.rows
        ],
        "words": list(of.words),
    }


def _others(of: Recommended) -> str:
    near = [str(row.order) for row in of.choice.within() if row.order != of.fit.order]
    return f"also plausible (AIC difference below 4): {'; '.join(near) or 'no other order'}"


def _poles(fit: RationalFit) -> Rows:
    """Oscillating pairs and real poles up to `FASTEST`, the slowest first.

    A pair whose damping ratio is above 1 is two real poles, each with its own interval.
    """
    listed = [(m.frequency, "Pole pair", mode_in_words(m)) for m in oscillating(fit)]
    listed += [(f, "Real pole", pole_in_words(f, half)) for f, half in real_poles(fit)]
    top = FASTEST * fit.lines.frequency[-1]
    rows = [(kind, said) for f, kind, said in sorted(listed) if f < top]
    if len(rows) == len(listed):
        return rows
    return [*rows, ("Faster poles", f"above {top:.2g} Hz, not identifiable in this band")]


def _zeros(zeros: ComplexArray) -> Rows:
    upper = [z for z in zeros if z.imag >= 0]
    return [
        (
            "Real zero" if z.imag == 0 else "Zero pair",
            f"{abs(z) / (2 * np.pi):.3g} Hz, in the {'right' if z.real > 0 else 'left'} half plane",
        )
        for z in upper
    ]


def _pairs(value: ComplexArray) -> list[list[float]]:
    return [[float(v.real), float(v.imag)] for v in value]
