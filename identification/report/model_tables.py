"""A model in words and numbers: for the page, and for a program."""

from typing import Any

import numpy as np

from slipbench.identification.models.delay_profile import DelayProfile
from slipbench.identification.models.rational_ml import ACROSS, Mode, RationalFit
from slipbench.identification.models.recommended import Recommended
from slipbench.identification.report.words import gain_unit, name
from slipbench.identification.response.response import ComplexArray

Rows = list[tuple[str, str]]
FASTEST = 3.0  # times the top of the band; what is faster is not told one by one


def told(of: Recommended) -> Rows:
    """Say what a model is, each figure with its 95 % interval."""
    fit = of.fit
    factor, unit = gain_unit(of.response.input, of.response.output)
    low = fit.lines.frequency[:1]
    gain, band = float(np.abs(fit.response(low))[0]), float(fit.band(low)[0])
    rows = [
        ("Order", f"{fit.order}, by description length; {_others(of)}"),
        (
            "Chi-square",
            f"{fit.chi_square_ratio:.2f} times its {fit.freedom} degrees of freedom"
            f" ({'not rejected' if of.adequate else 'rejected'}: probability {fit.adequate:.2g})",
        ),
        ("Pure delay", delay_in_words(of)),
        *[(_kind(mode), mode_in_words(mode)) for mode in _seen(fit)],
        *_zeros(fit.model.zeros),
        (f"Gain at {low[0]:.2g} Hz", f"{factor * gain:.3g} ± {factor * band:.2g} {unit}"),
        (
            "Drift below the band",
            f"{fit.drift[0]:+.3f} ± {ACROSS * fit.drift[1]:.3f} rad/s, not part of the model",
        ),
    ]
    return [*rows, ("To know", " ".join(of.words))]


def title(of: Recommended) -> str:
    """Name a model by its input and output."""
    return f"From {name(of.response.input)} to {name(of.response.output)}"


def delay_in_words(of: Recommended) -> str:
    """Give the delay with its interval, or the reason why it has none."""
    found = of.delay
    if not isinstance(found, DelayProfile):
        return f"not told: {found.reason}"
    return (
        f"{1e3 * found.delay:.1f} ms, 95 % interval {1e3 * found.low:.1f} to "
        f"{1e3 * found.high:.1f} ms"
    )


def mode_in_words(mode: Mode) -> str:
    """Give frequency and damping with their 95 % intervals; what is not known is not given."""
    if ACROSS * mode.frequency_deviation > mode.frequency:
        return f"about {mode.frequency:.2g} Hz, which the lines do not tell"
    frequency = f"{mode.frequency:.2f} ± {ACROSS * mode.frequency_deviation:.2f} Hz"
    if mode.single:
        return frequency
    return f"{frequency}, damping {mode.damping:.3f} ± {ACROSS * mode.damping_deviation:.3f}"


def figures(of: Recommended) -> dict[str, Any]:
    """Collect a model for a program: SI, poles and zeros as pairs of real and imaginary part."""
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
    return (
        f"within two nats by AIC: {'; '.join(near)}" if near else "no other within two nats by AIC"
    )


def _kind(mode: Mode) -> str:
    return "Real pole" if mode.single else "Pair of poles"


def _seen(fit: RationalFit) -> list[Mode]:
    top = FASTEST * fit.lines.frequency[-1]
    return sorted((m for m in fit.modes if m.frequency < top), key=lambda m: m.frequency)


def _zeros(zeros: ComplexArray) -> Rows:
    upper = [z for z in zeros if z.imag >= 0]
    return [
        (
            "Zero" if z.imag == 0 else "Pair of zeros",
            f"{abs(z) / (2 * np.pi):.2f} Hz, in the {'right' if z.real > 0 else 'left'} half plane",
        )
        for z in upper
    ]


def _pairs(value: ComplexArray) -> list[list[float]]:
    return [[float(v.real), float(v.imag)] for v in value]
