"""Throttle or spark: what each can do for a slip controller, from two measured first harmonics.

Both are put on one footing as in figure 11 of Corno and Savaresi 2009: gain 1 at low frequency,
dead time removed. The delays come from the recordings (`delay_profile`) unless they are given.

    found = compare_actuators(throttle.main, spark.main)     # Comparison or NoComparison
    found.lead, found.lead_band                # degrees at w_c by which the spark is ahead
    found.spark.bandwidth / found.cutoff
    answer(found)                              # the paper's question, in a sentence

Usable bandwidth: the frequency at which the response lags by 120 degrees, so that a loop that is
closed there by proportional action has a phase margin of 60 degrees
(docs/decisions/identification-usable-bandwidth.md). Other margins: `Actuator.lags_by`.
"""

from dataclasses import dataclass

import numpy as np

from slipbench.identification.models.delay_profile import NoDelay, delay_profile
from slipbench.identification.models.model_order import OrderChoice, all_pole, choose_order
from slipbench.identification.models.rational_ml import RationalFit, refit
from slipbench.identification.response.independent_lines import NoRational, independent_lines
from slipbench.identification.response.response import FrequencyResponse, reliable_band
from slipbench.protocol.recording.channel import FloatArray

CUTOFF = 10.0  # Hz, w_c / 2 pi: the servo's stated bandwidth
LOW = 0.1  # of the cutoff: above the drift of the speed, below the resonance
MARGIN = 60.0  # degrees of phase margin that make a bandwidth usable
POINTS = 2000


@dataclass(frozen=True)
class DeadTime:
    """A delay and the ends of its 95 % interval, s."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Actuator:
    """One input's first harmonic on slip.

    response   as measured; fit: of a rational function behind the delay
    low_gain   slip per input at 0.1 w_c
    """

    response: FrequencyResponse
    fit: RationalFit
    delay: DeadTime
    low_gain: float

    def gain(self, frequency: FloatArray) -> FloatArray:
        """Gain of the fit, 1 at low frequency. frequency: Hz."""
        return np.asarray(np.abs(self.fit.model.response(frequency)) / self.low_gain)

    def phase(self, frequency: FloatArray, delayed: bool = False) -> FloatArray:
        """Phase of the fit in degrees, unwrapped from zero frequency. frequency: Hz."""
        top = float(np.max(frequency))
        grid = np.linspace(top / POINTS, top, POINTS)
        model = self.fit.model if delayed else self.fit.model.without_delay
        value = model.response(grid) / np.sign(self.fit.model.response(grid[:1]).real)
        return np.interp(frequency, grid, np.degrees(np.unwrap(np.angle(value))))

    def phase_band(self, frequency: float) -> float:
        """Half width of the 95 % band of the phase without delay, degrees."""
        own = np.degrees(self.fit.phase_band(np.array([frequency]))[0])
        late = 360 * frequency * (self.delay.high - self.delay.low) / 2
        return float(np.hypot(own, late))

    def lags_by(self, degrees: float, delayed: bool = False) -> float:
        """First frequency at which the phase has fallen by so much, Hz; NaN where it does not."""
        grid = np.linspace(0, self.highest, POINTS)[1:]
        below = np.flatnonzero(self.phase(grid, delayed) <= -degrees)
        return float(grid[below[0]]) if below.size else float("nan")

    @property
    def highest(self) -> float:
        """Upper end of the reliable band, Hz; no frequency above it is given."""
        band = reliable_band(self.response)
        return band[1] if band else 0.0

    @property
    def bandwidth(self) -> float:
        """Usable bandwidth, Hz; NaN where the reliable band ends before."""
        return self.lags_by(180 - MARGIN)

    @property
    def bandwidth_band(self) -> float:
        """Half width of its 95 % interval, Hz: the phase's band over its slope."""
        f = self.bandwidth
        if np.isnan(f):
            return float("nan")
        near = self.phase(np.array([0.98 * f, 1.02 * f]))
        return self.phase_band(f) * 0.04 * f / abs(float(near[1] - near[0]))


@dataclass(frozen=True)
class Comparison:
    """Both actuators; cutoff: Hz. lead, lead_band: degrees at the cutoff, spark before throttle."""

    throttle: Actuator
    spark: Actuator
    cutoff: float
    lead: float
    lead_band: float


@dataclass(frozen=True)
class NoComparison:
    """Why the two cannot be compared."""

    reason: str


def compare_actuators(
    throttle: FrequencyResponse,
    spark: FrequencyResponse,
    cutoff: float = CUTOFF,
    delays: tuple[DeadTime | None, DeadTime | None] = (None, None),
) -> Comparison | NoComparison:
    """Compare throttle and spark. cutoff: Hz; delays: of both where they are known."""
    found = []
    for response, delay in zip((throttle, spark), delays, strict=True):
        one = actuator(response, cutoff, delay)
        if isinstance(one, NoComparison):
            return one
        found.append(one)
    at = np.array([cutoff])
    lead = float(found[1].phase(at)[0] - found[0].phase(at)[0])
    return Comparison(
        found[0],
        found[1],
        cutoff,
        lead,
        float(np.hypot(found[0].phase_band(cutoff), found[1].phase_band(cutoff))),
    )


def actuator(
    response: FrequencyResponse, cutoff: float, delay: DeadTime | None = None
) -> Actuator | NoComparison:
    """Fit one input's first harmonic with its dead time set apart."""
    lines = independent_lines(response)
    if isinstance(lines, NoRational):
        return NoComparison(lines.reason)
    band = reliable_band(response)
    if band is None or band[0] > LOW * cutoff or band[1] < cutoff:
        reliable = f"{band[0]:.1f} to {band[1]:.1f} Hz" if band else "nothing"
        return NoComparison(
            f"from {response.input} {reliable} is reliable, "
            f"{LOW * cutoff:g} to {cutoff:g} Hz are needed"
        )
    choice = choose_order(lines, all_pole())
    known = delay or _profiled(choice)
    if isinstance(known, NoDelay):
        return NoComparison(f"delay from {response.input}: {known.reason}")
    fit = refit(choice.best.fit, known.value)
    low = float(np.abs(fit.model.response(np.array([LOW * cutoff])))[0])
    return Actuator(response, fit, known, low)


def _profiled(choice: OrderChoice[RationalFit]) -> DeadTime | NoDelay:
    profile = delay_profile(choice)
    if isinstance(profile, NoDelay):
        return profile
    return DeadTime(profile.delay, profile.low, profile.high)


def answer(found: Comparison) -> str:
    """Comparison of throttle and spark in two sentences, with the figures."""
    t, s, c = found.throttle, found.spark, found.cutoff
    return (
        "The spark suits fast control, the throttle large changes: "
        f"at w_c ({c:g} Hz) the spark leads the throttle by {found.lead:.0f} ± "
        f"{found.lead_band:.0f} degrees, dead times of {1e3 * s.delay.value:.1f} and "
        f"{1e3 * t.delay.value:.1f} ms excluded. The usable bandwidth (phase margin {MARGIN:.0f} "
        f"degrees) is {_share(s, c)} w_c for the spark, {_share(t, c)} w_c for the throttle; but "
        f"one degree of spark moves slip by only {100 * np.radians(abs(s.low_gain)):.3f} %, "
        f"one percent of throttle by {abs(t.low_gain):.3f} %."
    )


def _share(one: Actuator, cutoff: float) -> str:
    if np.isnan(one.bandwidth):
        return f"more than {one.highest / cutoff:.2f}"
    return f"{one.bandwidth / cutoff:.2f} ± {one.bandwidth_band / cutoff:.2f}"
