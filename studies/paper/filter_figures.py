"""Figure 3: the rear wheel's speed before and after the filters, and their phase lag.

found = line_reductions(identified)
with drawing.style():
    drawing.png(filter_figures.filtering(identified, found), path)
    drawing.png(filter_figures.phases(found, speed=53.0, radius=0.32, teeth=16), path)
"""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from slipbench.controllers.causal_filters import LowPass, Notch
from slipbench.identification.report import drawing as d
from slipbench.identification.response.identify import Identification
from slipbench.identification.signals.filters import low_pass
from slipbench.identification.signals.motion import CUTOFF, Motion
from slipbench.identification.signals.teeth import tooth_interval
from slipbench.identification.signals.trial_window import TrialWindow
from slipbench.protocol.recording.channel import FloatArray
from slipbench.studies.paper.line_reduction import LEARNING, LEARNT, OFFLINE, ONLINE, LineReductions

LOOKS = {OFFLINE: d.ORANGE, ONLINE: d.RED, LEARNT: d.BLUE, LEARNING: d.GREEN}
TURNS = 12  # of the wheel that are shown


def filtering(found: Identification, lines: LineReductions) -> Figure:
    """Figure of a segment of the wheel speed: raw, filtered as in the paper, with corrected teeth."""
    figure, (left, right) = d.side_by_side(2, 3.6)
    _segment(left, found, lines)
    _reductions(right, lines)
    return figure


def _segment(axes: Axes, found: Identification, lines: LineReductions) -> None:
    assert isinstance(found.motion, Motion)
    rate, middle = found.base.rate, _middle(found)
    part = slice(middle, middle + round(TURNS / lines.frequency * rate))
    time = found.base.time[part]
    smooth = low_pass(lines.cleaned[OFFLINE], rate, CUTOFF)
    axes.plot(time, 3.6 * found.motion.raw[part], color="#aab3bd", lw=1.0, label="raw")
    axes.plot(time, 3.6 * smooth[part], color=d.ORANGE, label="low-pass and notch filter")
    true = lines.cleaned[LEARNT][part]
    axes.plot(time, 3.6 * true, color=d.BLUE, label="corrected teeth, no filter")
    axes.set(xlabel="time / s", ylabel="rear wheel / km/h", xlim=(time[0], time[-1]))
    axes.legend(
        loc="lower right",
        bbox_to_anchor=(1.0, 1.0),
        ncols=3,
        handlelength=1.0,
        columnspacing=0.8,
        borderaxespad=0.1,
        fontsize=8,
    )


def _middle(found: Identification) -> int:
    window = found.window
    if isinstance(window, TrialWindow):
        return int(window.exciting.start + window.exciting.stop) // 2
    return int(found.base.time.shape[0]) // 2


def _reductions(axes: Axes, lines: LineReductions) -> None:
    width = 0.8 / len(lines.remaining)
    for index, way in enumerate(lines.remaining):
        at = np.array(lines.orders) + (index - (len(lines.remaining) - 1) / 2) * width
        height = np.maximum(lines.decibels(way), 0.3)
        axes.bar(at, height, width, color=LOOKS.get(way, d.MUTED), label=way)
    axes.set(xlabel="wheel order", ylabel="reduction / dB", xticks=lines.orders)
    axes.grid(visible=False, axis="x")
    axes.set_ylim(top=1.35 * axes.get_ylim()[1])
    axes.legend(loc="upper center", ncols=2, columnspacing=1.0, handlelength=1.2)


def phases(
    lines: LineReductions, speed: float, radius: float, teeth: int, cutoff: float = CUTOFF
) -> Figure:
    """Figure of gain and phase of the online filters over frequency. speed: m/s; radius: m."""
    frequency = np.linspace(0.2, min(1.5 * cutoff, 0.45 * lines.rate), 1500)
    late = tooth_interval(speed, radius, teeth)
    figure, (top, bottom) = d.panels(2, 4.6)
    made = {
        f"low pass, {cutoff:g} Hz": (LowPass(lines.rate, cutoff).response(frequency), d.VIOLET),
        f"notch at {lines.frequency:.1f} Hz": (
            Notch(lines.rate, (1,)).response(frequency, lines.frequency),
            d.RED,
        ),
        f"notches of {len(lines.notched)} orders": (
            Notch(lines.rate, lines.notched).response(frequency, lines.frequency),
            d.ORANGE,
        ),
        f"{teeth} teeth at {3.6 * speed:.0f} km/h": (
            np.sinc(frequency * late) ** 2 * np.exp(-2j * np.pi * frequency * late),
            d.MUTED,
        ),
        "true teeth: nothing": (np.ones_like(frequency, np.complex128), d.BLUE),
    }
    for label, (value, colour) in made.items():
        phase = _degrees(value)
        phase[np.abs(np.diff(phase, prepend=phase[0])) > 180] = np.nan  # a turn is not a line
        top.plot(frequency, 20 * np.log10(np.maximum(np.abs(value), 1e-4)), color=colour)
        bottom.plot(frequency, phase, color=colour, label=label)
    top.set(ylabel="gain / dB", ylim=(-30, 3), title="Gain and phase of the online filters")
    bottom.set(
        xlabel="frequency / Hz", ylabel="phase / °", ylim=(-180, 95), xlim=(0, frequency[-1])
    )
    bottom.legend(loc="lower left", ncols=2)
    return figure


def phase_costs(
    lines: LineReductions, frequencies: tuple[float, ...] = (2.0, 5.0, 8.0, 10.0, 15.0)
) -> dict[str, FloatArray]:
    """Phase lag (degrees, positive is late) of every online filter at some frequencies (Hz)."""
    f = np.array(frequencies)
    wheel = lines.frequency
    made = {
        "low pass": LowPass(lines.rate, CUTOFF).response(f),
        "notch of the first order": Notch(lines.rate, (1,)).response(f, wheel),
        "notches": Notch(lines.rate, lines.notched).response(f, wheel),
        "tooth pitch compensated": np.ones_like(f, np.complex128),
    }
    return {name: -_degrees(value) for name, value in made.items()}


def _degrees(value: np.ndarray[tuple[int, ...], np.dtype[np.complex128]]) -> FloatArray:
    return np.asarray(np.degrees(np.angle(value)))
