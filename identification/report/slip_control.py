"""A trial under slip control: how the slip followed its target, in words and as a figure."""

import math

import numpy as np
from matplotlib.figure import Figure

from slipbench.identification.report import drawing as d
from slipbench.identification.response.following import Following
from slipbench.identification.response.identify import Identification
from slipbench.identification.signals.trial_window import TrialWindow

Rows = list[tuple[str, str]]


def sentence(followed: Following) -> str:
    """Say the key result."""
    said = f"Under control the slip followed its target to {_percent(followed.error)} (rms)"
    steps = followed.steps
    if steps is not None:
        return (
            f"{said}; steps overshot by {max(100 * steps.overshoot, 0.0):.0f}\u00a0% and "
            f"{_settled(steps.settling)}."
        )
    if math.isfinite(followed.bandwidth):
        return f"{said}, up to {followed.bandwidth:.1f}\u00a0Hz (-3\u00a0dB)."
    return f"{said}."


def rows(followed: Following | None) -> Rows:
    """Lay the figures out as rows of words; none where nothing was followed."""
    if followed is None:
        return []
    told = [
        (
            "Target",
            f"{_percent(float(followed.target.min()))} to {_percent(float(followed.target.max()))}",
        ),
        (
            "Slip less target",
            f"{_percent(followed.error)} (rms), mean "
            f"{_percent(float(np.mean(followed.slip - followed.target)))}",
        ),
    ]
    if followed.steps is not None:
        told += [
            (
                "Overshoot",
                f"{100 * followed.steps.overshoot:.0f} % of a step, the worse of the "
                "mean step up and the mean step down",
            ),
            ("Settling", f"{_settled(followed.steps.settling)} (within 10 % of the step)"),
            (
                "Noise",
                f"{100 * followed.steps.noise:.0f} % of a step, single steps against their mean",
            ),
        ]
    if math.isfinite(followed.bandwidth):
        told.append(("Followed to", f"{followed.bandwidth:.1f} Hz (-3 dB)"))
    return told


def figure(found: Identification) -> Figure | None:
    """Draw slip and target over the excitation."""
    followed, window = found.following, found.window
    if followed is None or not isinstance(window, TrialWindow):
        return None
    time = found.base.time[window.exciting]
    made, (axes,) = d.panels(1, 3.0)
    d.line(axes, time, 100 * followed.slip, color=d.BLUE, label="slip")
    d.line(axes, time, 100 * followed.target, color=d.INK, lw=0.8, ls="--", label="target")
    axes.set(xlabel="time / s", ylabel="slip / %")
    d.legend(axes, 2)
    return made


def _settled(time: float) -> str:
    return f"settled in {1e3 * time:.0f}\u00a0ms" if math.isfinite(time) else "never settled"


def _percent(slip: float) -> str:
    return f"{100 * slip:.3f}\u00a0%"
