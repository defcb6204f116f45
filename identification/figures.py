"""The figures of a report, each a function of what was identified; None where it has nothing."""

from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from identification import drawing as d
from identification.identify import Identification
from identification.motion import Motion
from identification.responses import INPUTS
from identification.trial_window import TrialWindow
from identification.words import name, shown, unit
from protocol.channel import FloatArray
from protocol.trial_file import Sweep

TIME = "time / s"


def overview(found: Identification) -> Figure | None:
    """Draw what was asked, what was done and what the wheels answered, over the whole recording."""
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


def close_ups(found: Identification) -> Figure | None:
    """Draw throttle or spark and slip at three moments of a sweep: slow, in the middle, fast."""
    trial, window, moved = found.recording.trial, found.window, found.motion
    if not (trial and isinstance(window, TrialWindow) and isinstance(moved, Motion)):
        return None
    role = INPUTS[trial.excitation.actuator][0]
    given = found.base.get(role)
    if not isinstance(trial.excitation, Sweep) or given is None or found.main is None:
        return None
    figure, axes = d.side_by_side(3, 2.9)
    for panel, share in zip(axes, (0.06, 0.5, 0.94), strict=True):
        frequency = _swept_frequency(trial.excitation, share)
        _close_up(panel, found, moved.slip.ratio, given, role, share, frequency)
    axes[0].set_ylabel(f"{name(role)} / {unit(_si(role))}", color=d.BLUE)
    return figure


def slip_statistics(found: Identification) -> Figure | None:
    """Draw how often which slip occurred, and slip against speed."""
    if not isinstance(found.motion, Motion) or found.motion.slip.kind != "slip":
        return None
    ratio, speed = found.motion.slip.ratio, found.motion.reference
    known = np.isfinite(ratio)
    low, high = np.percentile(ratio[known] * 100, (0.2, 99.8))
    figure, (left, right) = d.side_by_side(2, 3.0)
    left.hist(np.clip(ratio[known] * 100, low, high), bins=80, color=d.BLUE)
    left.set(xlabel="slip / %", ylabel="samples", title="How often")
    right.hexbin(
        shown(speed[known], "m/s"), np.clip(ratio[known] * 100, low, high), gridsize=55,
        bins="log", cmap="Blues", mincnt=1, linewidths=0.1, rasterized=True,
    )  # fmt: skip
    right.set(xlabel="speed / km/h", ylabel="slip / %", title="Against speed")
    return figure


def spectra(found: Identification) -> Figure | None:
    """Draw the amplitude spectra of wheel, engine and suspension with the wheel's orders marked."""
    if not found.spectra:
        return None
    figure, axes = d.panels(len(found.spectra), 1.0 + 1.8 * len(found.spectra))
    for panel, item in zip(axes, found.spectra, strict=True):
        amplitude = np.maximum(shown(item.amplitude, item.unit), 1e-12)
        inside = item.frequency > 0.3
        panel.semilogy(item.frequency[inside], amplitude[inside], color=d.BLUE, lw=1.1)
        panel.set_title(name(item.role))
        panel.set_ylabel(f"amplitude / {unit(item.unit)}")
        panel.set_ylim(bottom=float(np.percentile(amplitude[inside], 2)) / 2)
        _mark_orders(panel, item.orders, item.width)
    axes[-1].set_xlabel("frequency / Hz")
    top = min(found.base.rate / 2, 200.0)
    axes[-1].set_xlim(0, min(top, item.orders[7] * 1.03) if item.orders.size > 7 else top)
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
    for role, colour in zip(roles, (d.BLUE, d.ORANGE, d.GREEN), strict=False):
        value = found.base.get(role)
        if value is not None:
            d.line(axes, found.base.time, shown(value, _si(role)), color=colour, label=name(role))
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
        (moved.driven, d.BLUE, f"{moved.axle.axle} wheel, driven"),
        (moved.reference, d.ORANGE, "reference"),
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
    """Show the trial with 3 s to each side, or everything."""
    time, window = found.base.time, found.window
    if not isinstance(window, TrialWindow):
        return float(time[0]), float(time[-1])
    last = min(window.exciting.stop, time.size - 1)
    start, end = float(time[window.exciting.start]), float(time[last])
    return max(start - 3.0, 0.0), min(end + 3.0, float(time[-1]))


def _close_up(
    axes: Axes,
    found: Identification,
    slip: FloatArray,
    given: FloatArray,
    role: str,
    share: float,
    frequency: float,
) -> None:
    assert isinstance(found.window, TrialWindow)
    part, time = found.window.exciting, found.base.time
    middle = part.start + round(share * (part.stop - part.start))
    half = round(min(1.5 / frequency, 2.0) * found.base.rate)
    near = slice(max(middle - half, 0), min(middle + half, time.size - 1))
    axes.plot(time[near], shown(given[near], _si(role)), color=d.BLUE)
    twin = axes.twinx()
    twin.plot(time[near], slip[near] * 100, color=d.VIOLET)
    twin.spines["right"].set_visible(True)
    twin.grid(visible=False)
    twin.tick_params(axis="y", colors=d.VIOLET)
    axes.tick_params(axis="y", colors=d.BLUE)
    axes.set(xlabel=TIME, title=f"about {frequency:.1f} Hz")
    if share > 0.9:
        twin.set_ylabel("slip / %", color=d.VIOLET)


def _swept_frequency(spec: Sweep, share: float) -> float:
    if spec.waveform == "linear_sweep":
        return spec.start + share * (spec.stop - spec.start)
    return float(spec.start * (spec.stop / spec.start) ** share)


def _mark_orders(axes: Axes, orders: FloatArray, width: float) -> None:
    for index, frequency in enumerate(orders[:8], start=1):
        half = max(width * index / 2, 0.1)
        axes.axvspan(frequency - half, frequency + half, color=d.ORANGE, alpha=0.18, lw=0)
        axes.text(
            frequency, 0.97, f"{index}X", transform=axes.get_xaxis_transform(), va="top",
            ha="center", fontsize=8.5, color=d.ORANGE, fontweight="bold",
        )  # fmt: skip


def _si(role: str) -> str:
    return "rad" if role.startswith("spark") else "rad/s" if role == "engine_speed" else "1"


def _finite(value: FloatArray | None) -> FloatArray:
    known = value[np.isfinite(value)] if value is not None else np.zeros(1)
    return known if known.size else np.zeros(1)
