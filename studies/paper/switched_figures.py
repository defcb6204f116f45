"""Figures 4, 8, 9 and 11 of the paper: trials, opening and closing, throttle and spark.

figure = trials_figure(identify(read(sweep)), identify(read(steps)))     # figure 4 and its twin
figure = steps_figure(study)                                             # figure 8
figure = held_out_figure(study)                                          # figure 9
figure = actuators_figure(compare_actuators(throttle.main, spark.main))  # figure 11
"""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from slipbench.identification.models.actuator_comparison import Actuator, Comparison
from slipbench.identification.models.model_comparison import left, without_trend
from slipbench.identification.models.scheduled import NAMES, ScheduledFit
from slipbench.identification.models.switched import simulate
from slipbench.identification.models.uncertainty_set import UncertaintySet
from slipbench.identification.report import drawing as d
from slipbench.identification.report.words import shown, unit
from slipbench.identification.response.identify import Identification
from slipbench.identification.response.responses import INPUTS, excited_actuator
from slipbench.identification.signals.filters import low_pass
from slipbench.identification.signals.motion import NoMotion
from slipbench.identification.signals.named import unit_of
from slipbench.identification.signals.trial_window import NoExcitation
from slipbench.protocol.recording.channel import FloatArray
from slipbench.studies.paper.switched_study import SwitchedStudy

CUTOFF = 10.0  # Hz, w_c / 2 pi
PLACES = (0.35, 0.5, 0.9)  # of w_c: where a sweep is looked at, as in figure 7
CLOSE = 0.5  # s to each side of such a place
SMOOTH = 40.0  # Hz
STEPS_SHOWN = 4.0  # s of a square wave
MEASURED = {"color": d.INK, "lw": 0.9}


def trials_figure(sweep: Identification, steps: Identification) -> Figure:
    """Figure of requested and actual actuator above slip: sweep on the left, steps on the right."""
    with d.style():
        figure = Figure(figsize=(d.WIDTH, 4.6))
        FigureCanvasAgg(figure)
        grid = figure.subplots(
            2,
            2,
            sharex="col",
            sharey="row",
            gridspec_kw={"left": 0.09, "right": 0.98, "top": 0.9, "bottom": 0.12, "wspace": 0.06},
        )
        for column, (found, title) in enumerate(((sweep, "sweep"), (steps, "steps"))):
            _trial(grid[0, column], grid[1, column], found, STEPS_SHOWN if column else None)
            grid[0, column].set_title(title)
        d.legend(grid[0, 1], 2)
        grid[1, 0].set_ylabel("slip / %")
    return figure


def _trial(upper: Axes, lower: Axes, found: Identification, lasts: float | None) -> None:
    """Draw one trial, or its first segment; channels that were not recorded are omitted."""
    if isinstance(found.window, NoExcitation) or isinstance(found.motion, NoMotion):
        upper.text(0.5, 0.5, "no excitation or no slip", transform=upper.transAxes, ha="center")
        return
    part = found.window.exciting
    if lasts is not None:
        part = slice(part.start, min(part.stop, part.start + round(lasts * found.base.rate)))
    time = found.base.time[part] - found.base.time[part.start]
    requested, actual = INPUTS[excited_actuator(found.recording.trial, found.base, found.window)]
    looks = ((requested, "requested", d.MUTED), (actual, "actual", d.BLUE))
    for role, label, colour in looks:
        signal = found.base.get(role)
        if signal is not None:
            y = shown(signal[part] - _map(found, role, part), unit_of(role))
            d.line(upper, time, y, color=colour, label=label, lw=1)
    d.line(lower, time, 100 * found.motion.slip.ratio[part], color=d.ORANGE, lw=0.9)
    if upper.get_subplotspec().is_first_col():  # type: ignore[union-attr]
        upper.set_ylabel(f"{requested.split('_')[0]} / {unit(unit_of(requested))}")
    lower.set_xlabel("time / s")


def _map(found: Identification, role: str, part: slice) -> float:
    """Spark advance without the commanded offset; 0 for any other channel."""
    signal = found.base.get(role)
    if signal is None or not role.startswith("spark"):
        return 0.0
    low, high = np.nanpercentile(signal[part], (1, 99))
    return float(low + high) / 2


def steps_figure(study: SwitchedStudy) -> Figure:
    """Figure of the mean opening and closing step, the latter inverted, and both models."""
    steps = study.steps
    with d.style():
        figure, axes = d.panels(2, 5.6, [3, 1.5])
        linear = study.linear.model
        sides = (
            (steps.opening, 1, d.BLUE, "o", "opening"),
            (steps.closing, -1, d.ORANGE, "s", "closing"),
        )
        time = 1e3 * steps.time
        for mode, (side, sign, colour, mark, name) in enumerate(sides):
            u = side.input.mean(axis=0)
            modes = np.full(u.size, mode)
            simulated = simulate(study.switched.model, u, modes, steps.rate)
            mean = side.mean - _slow(side.mean - simulated, steps.time)
            look = {"ms": 3, "ls": "none", "color": colour, "alpha": 0.6, "mew": 0}
            axes[0].plot(time[::6], 100 * sign * mean[::6], mark, label=name, **look)  # type: ignore[arg-type]
            axes[0].plot(
                time, 100 * sign * simulated, color=colour, label=f"{name}, switched model"
            )
            same = simulate(linear, u, modes, steps.rate)
            axes[1].plot(time, 100 * sign * (simulated - same), color=colour)
            axes[1].plot(time[::6], 100 * sign * (mean - same)[::6], mark, **look)  # type: ignore[arg-type]
        axes[0].set_ylabel("slip / %")
        axes[1].set(ylabel="linear residual / %", xlabel="time since the command / ms")
        d.legend(axes[0], 4)
    return figure


def _slow(y: FloatArray, time: FloatArray) -> FloatArray:
    """Constant and slope after the step: drift of the speed, which the models do not describe."""
    rows = np.stack((np.ones_like(time), np.maximum(time, 0.0)), axis=1)
    return np.asarray(rows @ np.linalg.lstsq(rows, y, rcond=None)[0])


def held_out_figure(study: SwitchedStudy, cutoff: float = CUTOFF) -> Figure:
    """Figure of a held-out sweep about some frequencies, and the residual of the linear model.

    Above: measured, linear, switched. Below, low-passed at 40 Hz: measured and switched minus
    linear, so the residual and the part of it that the switched model predicts. cutoff: Hz.
    """
    run = study.held_out[0]
    y = without_trend(run.y, run.part)
    linear, switched = (y - left(run, one.predict(run)) for one in study.rivals[:2])
    time = np.arange(y.size) / run.rate
    missed = low_pass(y - linear, run.rate, SMOOTH)
    with d.style():
        figure = Figure(figsize=(d.WIDTH, 4.8))
        FigureCanvasAgg(figure)
        grid = figure.subplots(
            2,
            len(PLACES),
            sharex="col",
            sharey="row",
            height_ratios=[2, 1],
            gridspec_kw={"left": 0.09, "right": 0.98, "top": 0.85, "bottom": 0.12, "wspace": 0.08},
        )
        for column, place in enumerate(PLACES):
            at = _when(run.u[run.part], run.rate, place * cutoff)
            near = np.abs(time - at) < min(CLOSE, 1.5 / (place * cutoff))
            upper, lower = grid[:, column]
            upper.plot(time[near], 100 * y[near], label="measured", **MEASURED)
            upper.plot(time[near], 100 * linear[near], color=d.ORANGE, label="linear")
            upper.plot(time[near], 100 * switched[near], color=d.BLUE, label="switched")
            lower.plot(time[near], 100 * missed[near], **MEASURED)
            lower.plot(time[near], 100 * (switched - linear)[near], color=d.BLUE)
            lower.axhline(0, color=d.ORANGE, lw=1)
            upper.set_title(f"{place:g} w_c")
            lower.set_xlabel("time / s")
        grid[0, 0].set_ylabel("slip / %")
        grid[1, 0].set_ylabel("linear residual / %")
        grid[0, -1].legend(loc="lower right", bbox_to_anchor=(1.0, 1.1), ncols=3)
    return figure


def _when(u: FloatArray, rate: float, frequency: float) -> float:
    """Time at which a sweep passes a frequency, from the count of its zero crossings, s."""
    crossings = np.flatnonzero(np.diff(np.signbit(u))) / rate
    half = np.diff(crossings)
    middle = (crossings[1:] + crossings[:-1]) / 2
    return float(middle[np.argmin(np.abs(0.5 / half - frequency))])


def actuators_figure(found: Comparison) -> Figure:
    """Figure of both first harmonics over f / f_c, gain 1 at low frequency, dead times removed."""
    with d.style():
        figure, axes = d.panels(2, 5.6, [1, 1])
        for one, colour, mark, name in (
            (found.throttle, d.BLUE, "o", "throttle"),
            (found.spark, d.ORANGE, "s", "spark"),
        ):
            _actuator(axes, one, found.cutoff, colour, mark, name)
        axes[1].axhline(-120, color=d.MUTED, lw=0.9, ls="--")
        axes[0].set(ylabel="gain / dB", title="First harmonics, delay-free and normalised")
        axes[1].set(ylabel="phase / °", yticks=(-270, -180, -120, -90, 0))
        axes[1].set_xlabel(f"f / f_c (f_c = {found.cutoff:g} Hz)")
        d.plain_frequency(axes[1])
        d.legend(axes[0], 4)
    return figure


def _actuator(
    axes: list[Axes], one: Actuator, cutoff: float, colour: str, mark: str, name: str
) -> None:
    lines = one.response.reliable
    f, value = one.response.frequency[lines], one.response.value[lines]
    fit = one.phase(f)
    free = np.degrees(np.angle(value * np.exp(2j * np.pi * f * one.delay.value)))
    free = free + 360 * np.round((fit - free) / 360)
    look = {"ms": 3, "ls": "none", "color": colour, "alpha": 0.55, "mew": 0}
    gain = np.abs(value) / one.low_gain
    axes[0].semilogx(f / cutoff, 20 * np.log10(gain), mark, label=name, **look)
    axes[0].plot(f / cutoff, 20 * np.log10(one.gain(f)), color=colour, label=f"{name}, fit")
    axes[1].plot(f / cutoff, free, mark, **look)  # type: ignore[arg-type]
    axes[1].plot(f / cutoff, fit, color=colour)
    if np.isfinite(one.bandwidth):
        axes[1].axvline(one.bandwidth / cutoff, color=colour, lw=0.9, ls=":")


def schedule_figure(fit: ScheduledFit) -> Figure:
    """Figure of gain, driveline frequency and damping over speed with 95 % intervals."""
    with d.style():
        figure, axes = d.side_by_side(3, 3.2)
        speed = np.linspace(fit.low, fit.high, 60)
        for panel, name, factor, label in zip(
            axes,
            (NAMES[0], NAMES[3], NAMES[4]),
            (1.0, 0.5 / np.pi, 1.0),
            ("gain / (% / %)", "resonance / Hz", "damping"),
            strict=True,
        ):
            value, half = factor * np.array([fit.parameter(name, v) for v in speed]).T
            panel.fill_between(speed, value - half, value + half, color=d.BLUE, alpha=0.18, lw=0)
            panel.plot(speed, value, color=d.BLUE)
            panel.set(xlabel="speed / (m/s)", title=label)
    return figure


def uncertainty_figure(found: UncertaintySet, cutoff: float = CUTOFF) -> Figure:
    """Figure of members and nominal model above error bound and weight. cutoff: Hz."""
    with d.style():
        figure, axes = d.panels(2, 5.4, [1.4, 1])
        x = found.frequency / cutoff
        for value in found.members.values():
            axes[0].semilogx(x, 20 * np.log10(np.abs(value)), color=d.MUTED, lw=0.8)
        nominal = np.abs(found.nominal.response(found.frequency))
        axes[0].plot(x, 20 * np.log10(nominal), color=d.BLUE, label="nominal")
        axes[1].plot(x, found.bound, color=d.MUTED, label="largest error with 95 % interval")
        weight = np.abs(found.weight.response(found.frequency))
        axes[1].plot(x, weight, color=d.RED, label="weight")
        axes[0].set(ylabel="gain / dB", title="Members and nominal model")
        axes[1].set(
            ylabel="relative error", ylim=(0, None), xlabel=f"f / f_c (f_c = {cutoff:g} Hz)"
        )
        d.plain_frequency(axes[1])
        for panel in axes:
            d.legend(panel, 2)
    return figure
