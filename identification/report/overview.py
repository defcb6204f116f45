"""Time series of a recording: commands, measured inputs, slip and speeds."""

from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from slipbench.identification.report import drawing as d
from slipbench.identification.report.words import name, shown
from slipbench.identification.response.identify import Identification
from slipbench.identification.signals.motion import Motion
from slipbench.identification.signals.named import unit_of
from slipbench.identification.signals.trial_window import TrialWindow
from slipbench.protocol.recording.channel import FloatArray

TIME = "time / s"


def overview(found: Identification) -> Figure | None:
    """Figure of commands, measured inputs, slip and speeds over time; None without any of them."""
    rows = _rows(found)
    if not rows:
        return None
    figure, axes = d.panels(len(rows), 1.2 + 1.75 * len(rows))
    for panel, row in zip(axes, rows, strict=True):
        row(panel)
        _mark_trial(panel, found)
        d.legend(panel)
    axes[-1].set_xlabel(TIME)
    axes[-1].set_xlim(*_extent(found))
    return figure


def _rows(found: Identification) -> list[Callable[[Axes], None]]:
    rows: list[Callable[[Axes], None]] = []
    get = found.base.get
    for roles, label in (
        (("throttle_command", "throttle_position"), "throttle / %"),
        (("spark_command",), "spark offset / °"),
    ):
        if any(get(role) is not None and np.ptp(_finite(get(role))) > 1e-6 for role in roles):
            rows.append(lambda axes, roles=roles, label=label: _draw(axes, found, roles, label))  # type: ignore[misc]
    if isinstance(found.motion, Motion):
        moved = found.motion
        rows.append(lambda axes: _slip(axes, found, moved))
        rows.append(lambda axes: _speeds(axes, found, moved))
    if get("engine_speed") is not None:
        rows.append(lambda axes: _draw(axes, found, ("engine_speed",), "engine speed / rpm"))
    return rows


def _draw(axes: Axes, found: Identification, roles: tuple[str, ...], label: str) -> None:
    looks = ((d.BLUE, 0.9, 3), (d.ORANGE, 1.5, 2))  # the command is drawn over the measurement
    for role, (colour, width, over) in zip(roles, looks, strict=False):
        value = found.base.get(role)
        if value is not None:
            y = shown(value, unit_of(role, found.base))
            d.line(axes, found.base.time, y, color=colour, lw=width, zorder=over, label=name(role))
    axes.set_ylabel(label)


def _slip(axes: Axes, found: Identification, moved: Motion) -> None:
    ratio = moved.slip.kind == "slip"
    value = moved.slip.ratio * 100 if ratio else shown(moved.slip.speed, "m/s")
    label = f"slip of the {moved.axle.axle} axle" if ratio else "slip speed"
    d.line(axes, found.base.time, value, color=d.VIOLET, label=label, lw=1.0)
    axes.axhline(0, color=d.MUTED, lw=0.8)
    axes.set_ylabel("slip / %" if ratio else "slip speed / km/h")
    known = value[np.isfinite(value)]
    if known.size:
        low, high = np.percentile(known, (0.1, 99.9))
        room = 0.12 * max(high - low, 1e-3)
        axes.set_ylim(min(low, 0.0) - room, max(high, 0.0) + room)


def _speeds(axes: Axes, found: Identification, moved: Motion) -> None:
    for value, colour, label in (
        (moved.driven, d.BLUE, f"{moved.axle.axle} wheel (driven)"),
        (moved.reference, d.ORANGE, "reference speed"),
    ):
        d.line(axes, found.base.time, shown(value, "m/s"), color=colour, label=label, lw=1.1)
    axes.set_ylabel("speed / km/h")


def _mark_trial(axes: Axes, found: Identification) -> None:
    window, time = found.window, found.base.time
    if not isinstance(window, TrialWindow):
        return
    active = np.zeros(time.size, dtype=np.bool_)
    active[window.exciting] = True
    d.shade(axes, time, active)
    if window.trip:
        axes.axvline(window.trip_time, color=d.RED, lw=1.4)


def _extent(found: Identification) -> tuple[float, float]:
    """Time span of the excitation with 3 s to each side, or of the whole recording; s."""
    time, window = found.base.time, found.window
    if not isinstance(window, TrialWindow):
        return float(time[0]), float(time[-1])
    last = min(window.exciting.stop, time.size - 1)
    start, end = float(time[window.exciting.start]), float(time[last])
    return max(start - 3.0, 0.0), min(end + 3.0, float(time[-1]))


def _finite(value: FloatArray | None) -> FloatArray:
    known = value[np.isfinite(value)] if value is not None else np.zeros(1)
    return known if known.size else np.zeros(1)
