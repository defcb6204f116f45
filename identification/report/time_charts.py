"""Charts over time: what was commanded and measured, slip and speeds."""

from dataclasses import replace

import numpy as np

from slipbench.identification.report import drawing as d
from slipbench.identification.report.chart import Chart, Panel, Trace
from slipbench.identification.report.words import axis, name, shown, unit
from slipbench.identification.response.identify import Identification
from slipbench.identification.signals.motion import Motion
from slipbench.identification.signals.named import stated_unit, unit_of
from slipbench.identification.signals.trial_window import TrialWindow
from slipbench.protocol.recording.channel import FloatArray

THROTTLE, SPARK = ("throttle_position", "throttle_command"), ("spark_command",)
LONGEST = 15  # characters of a name beside a panel
UNDER = {"throttle_position": d.ORANGE}  # the command is drawn over the measurement


def time_chart(found: Identification) -> Chart | None:
    """Inputs, slip and speeds over time; None where the recording has none of them."""
    time, panels = found.base.time, []
    for roles in (*_chosen(found), THROTTLE, SPARK, ("engine_speed",)):
        known = [(role, value) for role in roles if (value := _moving(found, role)) is not None]
        if not known:
            continue
        units = unit_of(known[0][0], found.base), stated_unit(known[0][0], found.base)
        traces = tuple(
            Trace(name(role), time, shown(value, *units), UNDER.get(role, d.BLUE))
            for role, value in known
        )
        first = name(roles[0]).split()[0] if len(roles) > 1 else name(roles[0])
        panels.append(Panel(traces, _label(first, unit(*units)), height=1.6))
    if isinstance(found.motion, Motion):
        panels += _motion_panels(time, found.motion)
    if not panels:
        return None
    window = found.window
    if isinstance(window, TrialWindow):
        ends = time[window.exciting][[0, -1]]
        panels = [replace(one, shade=((float(ends[0]), float(ends[1])),)) for one in panels]
    return Chart((*panels[:-1], replace(panels[-1], x_label="time / s")))


def _chosen(found: Identification) -> tuple[tuple[str, ...], ...]:
    """Selected input and output that no other panel shows."""
    usual = (*THROTTLE, *SPARK, "engine_speed", "slip")
    return tuple((role,) for role in found.pair or () if role not in usual)


def _label(text: str, each: str) -> str:
    """Title of an axis; a long name does not fit beside a panel and stands in its legend alone."""
    return axis(text, each) if len(text) <= LONGEST or each == "1" else each


def _moving(found: Identification, role: str) -> FloatArray | None:
    signal = found.signals().get(role)
    if signal is None:
        return None
    known = signal[0][np.isfinite(signal[0])]
    return signal[0] if known.size and np.ptp(known) > 1e-6 else None


def _motion_panels(time: FloatArray, moved: Motion) -> list[Panel]:
    ratio = moved.slip.kind == "slip"
    value = 100 * moved.slip.ratio if ratio else shown(moved.slip.speed, "m/s")
    label = f"slip of the {moved.axle.axle} axle" if ratio else "slip speed"
    slip = Trace(label, time, value, d.VIOLET)
    speeds = (
        Trace(f"{moved.axle.axle} wheel (driven)", time, shown(moved.driven, "m/s"), d.BLUE),
        Trace("reference speed", time, shown(moved.reference, "m/s"), d.ORANGE),
    )
    return [
        Panel((slip,), "slip / %" if ratio else "slip speed / km/h", height=1.8),
        Panel(speeds, "speed / km/h", height=1.8),
    ]
