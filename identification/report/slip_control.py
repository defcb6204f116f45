"""Tracking of the slip setpoint in a trial under slip control: sentence, rows, figure."""

import math

import numpy as np
from matplotlib.figure import Figure

from slipbench.identification.report import drawing as d
from slipbench.identification.response.following import Following
from slipbench.identification.response.identify import Identification
from slipbench.identification.signals.trial_window import TrialWindow

Rows = list[tuple[str, str]]


def sentence(followed: Following) -> str:
    """Key result in a sentence."""
    text = f"Slip control: rms tracking error {_percent(followed.error)}"
    steps = followed.steps
    if steps is not None:
        return (
            f"{text}; step response: overshoot {max(100 * steps.overshoot, 0.0):.0f}\u00a0%, "
            f"{_settled(steps.settling)}."
        )
    if math.isfinite(followed.bandwidth):
        return f"{text}, tracking bandwidth {followed.bandwidth:.1f}\u00a0Hz (-3\u00a0dB)."
    return f"{text}."


def rows(followed: Following | None) -> Rows:
    """Rows of the tracking figures; none for a trial without slip control."""
    if followed is None:
        return []
    made = [
        (
            "Setpoint",
            f"{_percent(float(followed.target.min()))} to {_percent(float(followed.target.max()))}",
        ),
        (
            "Tracking error",
            f"rms {_percent(followed.error)}, mean (slip minus setpoint) "
            f"{_percent(float(np.mean(followed.slip - followed.target)))}",
        ),
    ]
    if followed.steps is not None:
        made += [
            (
                "Overshoot",
                f"{100 * followed.steps.overshoot:.0f} % of the step height, the larger of the "
                "mean upward and the mean downward step",
            ),
            (
                "Settling time",
                f"{_settled(followed.steps.settling)} (within 10 % of the step height)",
            ),
            (
                "Noise",
                f"{100 * followed.steps.noise:.0f} % of the step height, single steps about their mean",
            ),
        ]
    if math.isfinite(followed.bandwidth):
        made.append(("Tracking bandwidth", f"{followed.bandwidth:.1f} Hz (-3 dB)"))
    return made


def figure(found: Identification) -> Figure | None:
    """Figure of slip and setpoint over the excitation; None without slip control."""
    followed, window = found.following, found.window
    if followed is None or not isinstance(window, TrialWindow):
        return None
    time = found.base.time[window.exciting]
    made, (axes,) = d.panels(1, 3.0)
    d.line(axes, time, 100 * followed.slip, color=d.BLUE, label="slip")
    d.line(axes, time, 100 * followed.target, color=d.INK, lw=0.8, ls="--", label="setpoint")
    axes.set(xlabel="time / s", ylabel="slip / %")
    d.legend(axes, 2)
    return made


def _settled(time: float) -> str:
    return f"settled in {1e3 * time:.0f}\u00a0ms" if math.isfinite(time) else "did not settle"


def _percent(slip: float) -> str:
    return f"{100 * slip:.3f}\u00a0%"
