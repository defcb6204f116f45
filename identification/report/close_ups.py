"""Details of a sweep: input and slip at three of its frequencies."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from slipbench.identification.report import drawing as d
from slipbench.identification.report.words import name, shown, unit
from slipbench.identification.response.identify import Identification
from slipbench.identification.response.responses import INPUTS, excited_actuator
from slipbench.identification.signals.motion import Motion
from slipbench.identification.signals.named import unit_of
from slipbench.identification.signals.trial_window import TrialWindow
from slipbench.protocol.recording.channel import FloatArray
from slipbench.protocol.trial_file import Sweep


def close_ups(found: Identification) -> Figure | None:
    """Figure of input and slip near the start, the middle and the end of a sweep; None without."""
    trial, window, moved = found.recording.trial, found.window, found.motion
    if not (trial and isinstance(window, TrialWindow) and isinstance(moved, Motion)):
        return None
    role = INPUTS[excited_actuator(trial, found.base, window)][0]
    applied = found.base.get(role)
    if not isinstance(trial.excitation, Sweep) or applied is None or found.main is None:
        return None
    figure, axes = d.side_by_side(3, 2.9)
    for panel, share in zip(axes, (0.06, 0.5, 0.94), strict=True):
        frequency = _swept_frequency(trial.excitation, share)
        _close_up(panel, found, moved.slip.ratio, applied, role, share, frequency)
    axes[0].set_ylabel(f"{name(role)} / {unit(unit_of(role, found.base))}", color=d.BLUE)
    return figure


def _close_up(
    axes: Axes,
    found: Identification,
    slip: FloatArray,
    applied: FloatArray,
    role: str,
    share: float,
    frequency: float,
) -> None:
    assert isinstance(found.window, TrialWindow)
    part, time = found.window.exciting, found.base.time
    middle = part.start + round(share * (part.stop - part.start))
    half = round(min(1.5 / frequency, 2.0) * found.base.rate)
    near = slice(max(middle - half, 0), min(middle + half, time.size - 1))
    axes.plot(time[near], shown(applied[near], unit_of(role, found.base)), color=d.BLUE)
    twin = axes.twinx()
    twin.plot(time[near], slip[near] * 100, color=d.VIOLET)
    twin.spines["right"].set_visible(True)
    twin.grid(visible=False)
    twin.tick_params(axis="y", colors=d.VIOLET)
    axes.tick_params(axis="y", colors=d.BLUE)
    axes.set(xlabel="time / s", title=f"about {frequency:.1f} Hz")
    if share > 0.9:
        twin.set_ylabel("slip / %", color=d.VIOLET)


def _swept_frequency(spec: Sweep, share: float) -> float:
    if spec.waveform == "linear_sweep":
        return spec.start + share * (spec.stop - spec.start)
    return float(spec.start * (spec.stop / spec.start) ** share)
