"""Table rows of the operating point, the excitation and the computation of slip."""

import numpy as np

from slipbench.identification.report.key_figures import servo_bandwidth
from slipbench.identification.report.words import listed, name
from slipbench.identification.response.identify import Identification
from slipbench.identification.signals.motion import Motion
from slipbench.identification.signals.tooth_pitch import ToothPitch
from slipbench.identification.signals.trial_window import NoExcitation, TrialWindow, trip_in_words
from slipbench.protocol.trial_file import Multisine, Square, Sweep, TrialFile

Rows = list[tuple[str, str]]


def operating_point(found: Identification) -> Rows:
    """Rows of the operating point and the excitation."""
    rows: Rows = [("Recording", f"{found.recording.duration:.1f} s")]
    trial, window = found.recording.trial, found.window
    if trial is not None:
        rows += _trial(trial)
    if isinstance(window, NoExcitation):
        return [*rows, ("Excitation", window.reason)]
    start, stop = (found.base.time[min(i, found.base.time.size - 1)] for i in _ends(window))
    rows += _measured_point(found, window)
    if found.selected is not None:
        return [*rows, ("Selected window", "{:g} to {:g} s".format(*found.selected))]
    rows.append(("Excitation window", f"{start:.2f} to {stop:.2f} s"))
    rows.append(("End of trial", _ended(window)))
    return rows


def title(found: Identification) -> str:
    """Heading of the operating point: a selected part of a recording has no trial."""
    return "Operating point and trial" if found.selected is None else "Recording and window"


def _trial(trial: TrialFile) -> Rows:
    spec = trial.excitation
    match spec:
        case Sweep():
            wave = f"{spec.waveform.replace('_', ' ')}, {spec.start:g} to {spec.stop:g} Hz"
        case Square():
            wave = f"square wave, {spec.frequency:g} Hz"
        case Multisine():
            wave = (
                f"odd multisine, {spec.lowest:g} to {spec.highest:g} Hz, period {spec.period:g} s"
            )
    what = f"{spec.actuator}, {wave}, amplitude {spec.amplitude}, {spec.duration:g} s"
    return [
        ("Trial", f"{trial.name}: {trial.description or 'no description'}"),
        ("Excitation", what),
    ]


def _measured_point(found: Identification, window: TrialWindow) -> Rows:
    """Rows of the means over the second before the excitation."""
    before = slice(max(window.exciting.start - round(found.base.rate), 0), window.exciting.start)
    rows: Rows = []
    for role, label, factor, unit in (
        ("engine_speed", "Engine speed", 30 / np.pi, "rpm"),
        ("gear", "Gear", 1.0, ""),
        ("throttle_command", "Throttle", 100.0, "%"),
    ):
        value = found.base.get(role)
        if value is not None and np.isfinite(value[before]).any():
            rows.append((label, f"{np.nanmean(value[before]) * factor:.5g} {unit}".strip()))
    if isinstance(found.motion, Motion) and np.isfinite(found.motion.reference[before]).any():
        rows.append(("Speed", f"{np.nanmean(found.motion.reference[before]) * 3.6:.1f} km/h"))
        slip = found.motion.slip.ratio[before]
        if np.isfinite(slip).any():
            rows.append(("Slip", f"{np.nanmean(slip) * 100:.2f} %"))
    return rows


def _ended(window: TrialWindow) -> str:
    if window.trip:
        return f"tripped at {window.trip_time:.2f} s: {trip_in_words(window.trip)}"
    return "as planned, control returned to the rider"


def _ends(window: TrialWindow) -> tuple[int, int]:
    return window.exciting.start, window.exciting.stop


def processing(found: Identification) -> Rows:
    """Rows of how slip and responses were computed: axle, reference, time base, wheel orders, methods."""
    moved = found.motion
    rows: Rows = []
    if isinstance(moved, Motion):
        rows += _slip(found, moved)
    elif not found.without_slip:
        rows.append(("Slip", moved.reason))
    rows.append(("Time base", f"{found.base.rate:g} Hz"))
    rows += [(f"FRF, {name(r.input)} to {name(r.output)}", r.method) for r in found.responses]
    bandwidth = servo_bandwidth(found)
    return [*rows, ("Servo bandwidth", f"{bandwidth:.1f} Hz (−3 dB)")] if bandwidth else rows


def _slip(found: Identification, moved: Motion) -> Rows:
    rows: Rows = [
        ("Driven axle", f"{moved.axle.axle}: {moved.axle.method}"),
        ("Reference speed", moved.reference_name),
    ]
    if moved.line_reduction is not None:
        rows.append(
            ("Wheel orders", f"{_orders(moved)}; 1X order reduced by {moved.line_reduction:.0f} dB")
        )
    rows += _orders_in_band(found, moved)
    if moved.slip.statement:
        rows.append(("Definition of slip", moved.slip.statement))
    if moved.radius is not None:
        rows.append(("Rolling radius ratio", _radius(moved)))
    return rows


def _orders(moved: Motion) -> str:
    """Method by which the wheel orders were removed; where teeth were not compensated, why."""
    if isinstance(moved.pitch, ToothPitch):
        found = moved.pitch
        worst = 100 * float(np.abs(found.gaps).max())
        error = 100 * found.quantile * float(found.deviation.max())
        return f"tooth-pitch errors compensated (up to {worst:.2g} ± {error:.1g} % of a pitch)"
    why = f" (tooth-pitch errors not compensated: {moved.pitch.reason})" if moved.pitch else ""
    return f"{listed([f'{order}X' for order in moved.orders])} notched out{why}"


def _orders_in_band(found: Identification, moved: Motion) -> Rows:
    """Warning where a notch at a wheel order lies inside the excited band."""
    if (
        found.main is None
        or moved.wheel_frequency is None
        or not isinstance(found.window, TrialWindow)
    ):
        return []
    turning = float(np.nanmean(moved.wheel_frequency[found.window.exciting]))
    low, high = found.main.frequency[0], found.main.frequency[-1]
    inside = [f"{k * turning:.1f} Hz" for k in moved.orders if low <= k * turning <= high]
    if not inside:
        return []
    return [("Warning", f"response not reliable within 1 Hz of {listed(inside)} (notch filter)")]


def _radius(moved: Motion) -> str:
    assert moved.radius is not None
    estimate = moved.radius
    return (
        f"{estimate.ratio:.4f} ± {estimate.deviation:.4f}, driven over reference speed "
        f"({estimate.condition}, {estimate.samples} samples); not applied to slip"
    )
