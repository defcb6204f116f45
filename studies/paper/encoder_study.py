"""Error and delay of the speed from a toothed-wheel encoder, over speed (the paper's figure 1).

The fixed-position formula is w = 2 pi / (N TT). Its relative error is the timer's resolution over
TT. Its delay is TT: half an interval for the mean over it, half for the hold. More teeth reduce the
delay and increase the error.

    curves = [encoder_curve(np.linspace(1, 80, 200), 0.32, teeth) for teeth in (16, 32, 48)]
    claims = encoder_claims(radius=0.32)
    figure = encoder_figures.encoder(radius=0.32)
"""

from dataclasses import dataclass

import numpy as np

from slipbench.controllers.pitch_learner import TIMER
from slipbench.identification.signals.teeth import delay, error_bound, speed_from_teeth
from slipbench.plant.blocks import Encoder
from slipbench.plant.encoder import begin, passing_teeth, toothed_disc
from slipbench.protocol.recording.channel import FloatArray
from slipbench.studies.paper.claims import Claim

TEETH = (16, 32, 48)
SLOW = 40 / 3.6  # m/s, under which the paper's 16 teeth are too late
LATE = 0.010  # s
RATE = 20_000.0  # Hz, at which the simulated wheel is read
LASTS = 20.0  # s


@dataclass(frozen=True)
class EncoderCurve:
    """speed (n,) m/s; error (n,) largest relative error by the timer; delay (n,) s."""

    teeth: int
    speed: FloatArray
    error: FloatArray
    delay: FloatArray


@dataclass(frozen=True)
class ShownWave:
    """Response of an encoder to a sine in the wheel's speed.

    gain   measured amplitude over true amplitude
    lag    rad, phase lag of the measured sine
    error  largest relative error of the speed of an interval due to the timer
    """

    frequency: float
    gain: float
    lag: float
    error: float

    @property
    def delay(self) -> float:
        """Delay of the sine, s."""
        return self.lag / (2 * np.pi * self.frequency)


def encoder_curve(
    speed: FloatArray, radius: float, teeth: int, timer: float = TIMER
) -> EncoderCurve:
    """Error bound and delay at peripheral speeds. speed: m/s, (n,); radius, timer: m, s."""
    return EncoderCurve(
        teeth, speed, error_bound(speed, radius, teeth, timer), delay(speed, radius, teeth)
    )


def slowest(late: float, radius: float, teeth: int) -> float:
    """Speed (m/s) at which the delay of an encoder is `late` s; it is longer at lower speeds."""
    return 2 * np.pi * radius / (teeth * late)


def shown_wave(
    speed: float, radius: float, teeth: int, frequency: float = 10.0, share: float = 0.01
) -> ShownWave:
    """Measured response of an encoder on a wheel whose speed is a mean and a sine.

    speed: m/s; radius: m; frequency: Hz; share: amplitude over mean. Measured, not computed.
    """
    t = np.arange(1, round(LASTS * RATE) + 1) / RATE
    mean, w = speed / radius, 2 * np.pi * frequency
    turning = mean * (1 + share * np.sin(w * t))
    angle = mean * (t + share * (1 - np.cos(w * t)) / w)
    disc = toothed_disc(Encoder(teeth=teeth, resolution=TIMER))
    _, passed = passing_teeth(disc, begin(0.0, 0.0, mean), t, angle, turning)
    time = np.asarray(passed.ticks * TIMER, np.float64)
    shown = speed_from_teeth(time, passed.numbers.astype(np.float64), teeth).value
    last = np.searchsorted(time[1:], t, side="right") - 1
    known = last >= 0
    return _compared(
        t[known], shown[last[known]], mean, frequency, share, _worst(time, shown, t, angle)
    )


def _worst(time: FloatArray, shown: FloatArray, t: FloatArray, angle: FloatArray) -> float:
    """Largest relative error of an interval's mean speed."""
    true = np.diff(np.interp(time, t, angle)) / np.diff(time)
    return float(np.max(np.abs(shown[1:-1] / true[1:-1] - 1)))


def _compared(
    t: FloatArray, shown: FloatArray, mean: float, frequency: float, share: float, error: float
) -> ShownWave:
    """Gain and lag of a sine fitted by least squares, against the true one."""
    w = 2 * np.pi * frequency
    basis = np.column_stack((np.ones_like(t), np.sin(w * t), np.cos(w * t)))
    _, sine, cosine = np.linalg.lstsq(basis, shown, rcond=None)[0]
    wave = complex(sine, cosine) / (mean * share)
    return ShownWave(frequency, abs(wave), float(-np.angle(wave)), error)


def encoder_claims(radius: float, teeth: int = 16) -> tuple[Claim, ...]:
    """Claims of the paper's figure 1, computed from the formula and measured on a turning wheel."""
    formula = float(delay(np.array([SLOW]), radius, teeth)[0])
    read = shown_wave(SLOW, radius, teeth)
    note = f"{teeth} teeth, radius {radius:g} m"
    measured = f"{note}; a simulated wheel's teeth, timed to 1 µs, speed held between teeth"
    late = "below 40 km/h the encoder delay exceeds 10 ms"
    phase = "this is a phase lag of more than 36 degrees at 10 Hz"
    lag = float(np.degrees(read.lag))
    return (
        _claim("encoder_delay_at_40_kmh", late, 1e3 * formula, 1e3 * LATE, "ms", note),
        _claim(
            "encoder_delay_measured",
            f"{late}, measured on its teeth",
            1e3 * read.delay,
            1e3 * LATE,
            "ms",
            measured,
        ),
        _claim("encoder_phase_at_10_hz", phase, lag, 360 * 10 * LATE, "°", measured),
    )


def _claim(name: str, statement: str, value: float, low: float, unit: str, note: str) -> Claim:
    return Claim(name, statement, value, low, np.inf, unit, "figure 1", note)
