"""Claims on the describing functions (the paper's figures 6 and 10).

    claims = describing_function_claims(harmonics(throttle_runs), harmonics(spark_runs))

Distortion is sqrt(|G_2|^2 + |G_3|^2) / |G_1| at the same excitation frequency, without the
contribution of noise. Harmonics count as negligible where its mean is below 0.1, and as relevant
where it exceeds 0.1. A resonance is the highest gain among the lines whose 95 % interval is within
half the gain, and not at the end of those. The input of these claims is the command: with the
measured throttle as input the servo's resonance is missing and the peaks lie lower.
"""

import math
from dataclasses import dataclass

import numpy as np

from slipbench.identification.response.describing_function import DescribingFunction, NoHarmonics
from slipbench.protocol.recording.channel import FloatArray
from slipbench.studies.paper.claims import Claim

CUTOFF = 10.0  # Hz, w_c / 2 pi: the servo's stated bandwidth
NEGLIGIBLE = 0.1
ZONES = (0.25, 0.7)  # of w_c
KNOWN = 0.5  # greatest band beside the gain at which a line is known
FEWEST = 5  # lines for a peak
FEWEST_IN_ZONE = 2
FIGURE = {"throttle": "figure 6", "spark": "figure 10"}
RESONANCES = {
    ("throttle", 1): (0.72, 0.88),
    ("spark", 1): (0.72, 0.88),
    ("throttle", 2): (0.6, 0.8),
    ("throttle", 3): (0.35, 0.55),
}
ORDINAL = ("first", "second", "third")
Found = DescribingFunction | NoHarmonics


@dataclass(frozen=True)
class HarmonicPeak:
    """Highest gain of one harmonic: frequency in Hz; NaN where there is none, with the reason in `note`.

    low, high: Hz, range in which the gain may be as high within the 95 % intervals.
    """

    frequency: float
    low: float
    high: float
    note: str


def describing_function_claims(
    throttle: Found, spark: Found | None = None, cutoff: float = CUTOFF
) -> tuple[Claim, ...]:
    """Claims on zones and resonances. cutoff: Hz."""
    found = [_resonance_claim(throttle, "throttle", k, cutoff) for k in (1, 2, 3)]
    if spark is not None:
        found.insert(1, _resonance_claim(spark, "spark", 1, cutoff))
    return (*_zone_claims(throttle, cutoff), *found)


def distortion(found: DescribingFunction) -> FloatArray:
    """Second and third harmonic relative to the first, (n,), without the power of noise."""
    power = found.gain[1:3] ** 2 - found.deviation[1:3] ** 2
    return np.asarray(np.sqrt(np.maximum(power.sum(axis=0), 0.0)) / found.gain[0])


def peak(found: DescribingFunction, k: int) -> HarmonicPeak:
    """Frequency at which the k-th harmonic has its highest gain."""
    known = found.gain_band[k - 1] <= KNOWN * found.gain[k - 1]
    if np.count_nonzero(known) < FEWEST:
        return _none(f"fewer than {FEWEST} frequencies at which it is known to half its size")
    frequency, gain = found.frequency[known], found.gain[k - 1][known]
    band = found.gain_band[k - 1][known]
    top = int(np.argmax(gain))
    if top in (0, gain.size - 1):
        return _none(f"highest at {frequency[top]:.2f} Hz, an end of where it is known")
    as_high = frequency[gain + band >= gain[top] - band[top]]
    low, high = float(as_high.min()), float(as_high.max())
    note = f"{found.method}; as high within the 95 % bands from {low:.1f} to {high:.1f} Hz"
    return HarmonicPeak(float(frequency[top]), low, high, note)


def _none(note: str) -> HarmonicPeak:
    return HarmonicPeak(math.nan, math.nan, math.nan, note)


def _resonance_claim(found: Found, actuator: str, k: int, cutoff: float) -> Claim:
    at = _none(found.reason) if isinstance(found, NoHarmonics) else peak(found, k)
    name = ORDINAL[k - 1]
    return Claim(
        f"{name}_harmonic_resonance_{actuator}",
        f"The {name} harmonic of slip has a resonance from the {actuator}",
        at.frequency / cutoff,
        *RESONANCES[actuator, k],
        "w_c",
        FIGURE[actuator],
        at.note,
    )


def _zone_claims(found: Found, cutoff: float) -> tuple[Claim, ...]:
    low, high = ZONES
    below, middle, above, note = _zone_levels(found, cutoff)
    return tuple(
        Claim(f"harmonics_throttle_{name}", said, value, *band, "1", FIGURE["throttle"], note)
        for name, said, value, band in (
            (
                "low",
                f"Below {low:g} w_c the harmonics are negligible: mean distortion",
                below,
                (0.0, NEGLIGIBLE),
            ),
            (
                "middle",
                f"From {low:g} to {high:g} w_c they are significant: largest distortion",
                middle,
                (NEGLIGIBLE, math.inf),
            ),
            (
                "high",
                f"Above {high:g} w_c they decrease: largest distortion relative to the middle zone",
                above / middle,
                (0.0, 1.0),
            ),
        )
    )


def _zone_levels(found: Found, cutoff: float) -> tuple[float, float, float, str]:
    """Mean distortion in the low zone, and greatest distortion in the middle and the high zone."""
    if isinstance(found, NoHarmonics):
        return math.nan, math.nan, math.nan, found.reason
    x, level = found.frequency / cutoff, distortion(found)
    low, high = x < ZONES[0], x > ZONES[1]
    zones = [level[zone] for zone in (low, ~low & ~high, high)]
    if any(zone.size < FEWEST_IN_ZONE for zone in zones):
        return math.nan, math.nan, math.nan, "the sweep does not cover all zones"
    below = float(np.sqrt(np.mean(zones[0] ** 2)))
    amplitude = float(np.mean(found.amplitude))
    note = f"{found.method}, input amplitude {amplitude:.3g}; sqrt(G2^2 + G3^2) / G1"
    return below, float(zones[1].max()), float(zones[2].max()), note
