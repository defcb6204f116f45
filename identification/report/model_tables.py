"""A fitted model as table rows and as a tree for identification.json."""

from typing import Any

import numpy as np

from slipbench.identification.models.delay_profile import DelayProfile
from slipbench.identification.models.rational_ml import ACROSS, Mode, RationalFit
from slipbench.identification.models.recommended import Recommended
from slipbench.identification.report.words import gain_unit, name
from slipbench.identification.response.response import ComplexArray

Rows = list[tuple[str, str]]
FASTEST = 3.0  # times the top of the band; faster poles are not listed


def rows(of: Recommended) -> Rows:
    """Rows of the model: order, residual test, dead time, poles, zeros; 95 % intervals."""
    fit = of.fit
    factor, unit = gain_unit(*of.response.si_units)
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
        *[(_kind(mode), mode_in_words(mode)) for mode in _listed(fit)],
        *_zeros(fit.model.zeros),
        (f"Gain at {low[0]:.2g} Hz", f"{factor * gain:.3g} ± {factor * band:.2g} {unit}"),
        (
            "Drift below the band",
            f"{fit.drift[0]:+.3f} ± {ACROSS * fit.drift[1]:.3f} rad/s, not part of the model",
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
    return (
        f"{1e3 * found.delay:.1f} ms, 95 % interval {1e3 * found.low:.1f} to "
        f"{1e3 * found.high:.1f} ms"
    )


def mode_in_words(mode: Mode) -> str:
    """Frequency and damping ratio as text with 95 % intervals."""
    if ACROSS * mode.frequency_deviation > mode.frequency:
        return f"about {mode.frequency:.2g} Hz, not identifiable from this recording"
    frequency = f"{mode.frequency:.2f} ± {ACROSS * mode.frequency_deviation:.2f} Hz"
    if mode.single:
        return frequency
    return f"{frequency}, damping ratio {mode.damping:.3f} ± {ACROSS * mode.damping_deviation:.3f}"


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


def _kind(mode: Mode) -> str:
    return "Real pole" if mode.single else "Pole pair"


def _listed(fit: RationalFit) -> list[Mode]:
    top = FASTEST * fit.lines.frequency[-1]
    return sorted((m for m in fit.modes if m.frequency < top), key=lambda m: m.frequency)


def _zeros(zeros: ComplexArray) -> Rows:
    upper = [z for z in zeros if z.imag >= 0]
    return [
        (
            "Real zero" if z.imag == 0 else "Zero pair",
            f"{abs(z) / (2 * np.pi):.2f} Hz, in the {'right' if z.real > 0 else 'left'} half plane",
        )
        for z in upper
    ]


def _pairs(value: ComplexArray) -> list[list[float]]:
    return [[float(v.real), float(v.imag)] for v in value]
