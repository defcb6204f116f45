"""Wheel orders in a spectrum: frequency, amplitude and source.

Order m of a wheel repeats m times per revolution. It is computed over the wheel's angle, from the
running count of its teeth, so that a change of speed does not smear it.

    claims = order_claims(found)                # found: what `identify` gives
    amplitude = order_amplitudes(speed, angle, (1, 2, 3))
"""

from typing import TYPE_CHECKING

import numpy as np
from scipy import signal

from slipbench.controllers.causal_filters import SMOOTH
from slipbench.identification.signals.filters import bridged, low_pass
from slipbench.identification.signals.tooth_pitch import ToothPitch, order_of_gaps
from slipbench.protocol.recording.channel import FloatArray
from slipbench.studies.paper.claims import Claim

if TYPE_CHECKING:
    from slipbench.identification.response.identify import Identification

DISPLACED, CIRCLE = 3e-3, 0.1  # m, the tooth of the paper and the radius that it stands on
SPEED = 70 / 3.6  # m/s, under which the paper's first order is below 10 Hz
PER_TURN = 32  # points of the wheel's angle at which a turn is read
SOURCE = "figure 2"


def tooth_angle(time: FloatArray, count: FloatArray, teeth: int, grid: FloatArray) -> FloatArray:
    """Angle of a wheel on a time base, rad, from its teeth; NaN outside. time, count: (n,)."""
    turns = np.interp(grid, time, count, left=np.nan, right=np.nan) / teeth
    return np.asarray(2 * np.pi * turns)


def order_amplitudes(value: FloatArray, angle: FloatArray, orders: tuple[int, ...]) -> FloatArray:
    """Amplitudes of wheel orders in a signal without trend, over all turns together.

    value, angle: (n,), unit of the signal and rad; unknown samples are left out. Returns (k,).
    """
    known = np.isfinite(value) & np.isfinite(angle)
    x, psi = value[known], angle[known]
    if x.size < 16:
        return np.full(len(orders), np.nan)
    window = signal.windows.hann(x.size)
    waves = np.exp(-1j * np.outer(orders, psi))
    return np.asarray(2 * np.abs(waves @ (window * (x - np.mean(x)))) / window.sum())


def displaced_tooth(displacement: float, circle: float, teeth: int) -> FloatArray:
    """Gaps of a disc with one tooth displaced along its circle. m, m. Returns (teeth,), 1."""
    gaps = np.zeros(teeth)
    share = displacement / circle * teeth / (2 * np.pi)
    gaps[-1], gaps[0] = share, -share
    return gaps


def order_claims(
    found: "Identification", displacement: float = DISPLACED, circle: float = CIRCLE
) -> tuple[Claim, ...]:
    """Claims on the paper's figure 2 from a recording; empty without tooth times."""
    from slipbench.identification.signals.motion import Motion

    moved = found.motion
    if not isinstance(moved, Motion) or moved.axle.teeth_per_turn is None:
        return ()
    teeth = moved.axle.teeth_per_turn
    angle = driven_angle(found)
    wheel = relative(moved.raw, found.base.rate)
    line = float(order_amplitudes(wheel, angle, (1,))[0])
    predicted = order_of_gaps(displaced_tooth(displacement, circle, teeth), 1)
    engine = found.base.get("engine_speed")
    other = np.nan
    if engine is not None:
        other = float(order_amplitudes(relative(engine, found.base.rate), angle, (1,))[0])
    turning = line_frequency(moved.raw, angle, found.base.rate) / float(np.nanmean(moved.reference))
    text = f"{100 * line:.3f} % of the speed were read, {100 * predicted:.3f} % are predicted"
    return (
        _claim(
            "first_order_at_70_kmh",
            "below 70 km/h the first wheel order is below 10 Hz",
            turning * SPEED,
            (0.0, 10.0),
            "Hz",
            "the line's frequency over the true speed",
        ),
        _claim(
            "displaced_tooth_makes_the_line",
            "one tooth displaced by 3 mm at a radius of 10 cm reproduces the order",
            line / predicted,
            (0.9, 1.1),
            "1",
            f"{found.recording.folder.name}: {text}",
        ),
        _claim(
            "line_not_in_engine",
            "the order appears in the wheel speed, not in the engine speed",
            other / line,
            (0.0, 0.1),
            "1",
            "first order over the mean, engine's over wheel's",
        ),
        _displacement(moved.pitch, displacement, circle),
    )


def _claim(
    name: str, statement: str, value: float, band: tuple[float, float], unit: str, note: str
) -> Claim:
    return Claim(name, statement, value, *band, unit, SOURCE, note)


def driven_angle(found: "Identification") -> FloatArray:
    """Angle of the driven wheel on the recording's time base, rad."""
    from slipbench.identification.signals.motion import Motion

    assert isinstance(found.motion, Motion)
    role, teeth = f"{found.motion.axle.axle}_teeth", found.motion.axle.teeth_per_turn
    assert teeth is not None
    count = found.recording.channels[role].value
    return tooth_angle(found.data.time[role], count, teeth, found.base.time)


def relative(value: FloatArray, rate: float) -> FloatArray:
    """Relative deviation of a signal from its mean below 1 Hz, no unit, shape (n,)."""
    slow = low_pass(value, rate, SMOOTH)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(np.abs(slow) > 0, value / slow - 1, np.nan)


def line_frequency(value: FloatArray, angle: FloatArray, rate: float) -> float:
    """Mean frequency (Hz) of the highest line within 30 % of once per turn."""
    known = np.flatnonzero(np.isfinite(value) & np.isfinite(angle))
    span = slice(known[0], known[-1] + 1)
    turns = bridged(angle)[span] / (2 * np.pi)
    even = np.arange(turns[0], turns[-1], 1 / PER_TURN)
    fast = np.interp(even, turns, (value - low_pass(value, rate, SMOOTH))[span])
    height = np.abs(np.fft.rfft(signal.windows.hann(even.size) * np.nan_to_num(fast)))
    order = np.fft.rfftfreq(even.size, 1 / PER_TURN)
    near = (order > 0.7) & (order < 1.3)
    turning = (turns[-1] - turns[0]) / (known[-1] - known[0]) * rate
    return float(order[near][np.argmax(height[near])] * turning)


def _displacement(pitch: object, displacement: float, circle: float) -> Claim:
    """Claim: the learnt disc has one displaced tooth, by the true distance."""
    value, note = np.nan, "the gaps between teeth were not learnt"
    if isinstance(pitch, ToothPitch):
        at = pitch.positions - np.median(pitch.positions)
        out = int(np.argmax(np.abs(at)))
        value, note = 1e3 * at[out] * circle, f"tooth {out}, by {np.degrees(at[out]):.3f}°"
    low, high = sorted(1e3 * displacement * share for share in (0.95, 1.05))
    says = "the estimated tooth pitch shows one tooth displaced by 3 mm at a radius of 10 cm"
    return _claim("displaced_tooth_learnt", says, value, (low, high), "mm", note)
