"""Beyond the paper: best linear approximation, with noise and distortion separated."""

from itertools import pairwise

import numpy as np

from slipbench.identification.response.best_linear import (
    BestLinearApproximation,
    Level,
    best_linear,
)
from slipbench.identification.response.periodic_record import PeriodicRecord, periodic_record_of
from slipbench.protocol.recording.channel import FloatArray
from slipbench.studies.paper.context import Context, Found, runs_of
from slipbench.studies.paper.harmonic_figures import linear_figure
from slipbench.studies.paper.paper_section import Section, Table, drawn

ZONES = (0.0, 0.25, 0.7, 1.2)  # of w_c, as the paper divides the band


def multisine(found: Found, context: Context) -> Section:
    """Section on the average of random-phase odd multisines."""
    results = [periodic_record_of(one) for one in runs_of(found, "multisine")]
    made = best_linear([record for record in results if isinstance(record, PeriodicRecord)])
    title = "Best linear approximation, noise and distortion"
    if not isinstance(made, BestLinearApproximation):
        return Section("12", title, (made.reason,))
    return Section(
        "12",
        title,
        (
            f"Random-phase odd multisines of the throttle, {made.realisations} realisations of "
            f"{made.periods} periods after one settling period. Variation between periods is noise; "
            "the level at even and at unexcited odd bins is distortion. The curve is "
            "the best linear approximation for this class of excitations.",
        ),
        drawn(
            "best_linear",
            "Best linear approximation from throttle to slip; noise and total are "
            "standard deviations of it, distortion: level at unexcited bins.",
            lambda: linear_figure(made, context.cutoff),
        ),
        (),
        {"Rms value relative to the best linear gain, %.": _levels(made, context.cutoff)},
    )


def _levels(made: BestLinearApproximation, cutoff: float) -> Table:
    """Noise, even and odd distortion relative to the gain, by zone."""
    head = ("w / w_c", "noise", "even distortion", "odd distortion")
    zones = tuple(pairwise(ZONES))
    one = made.noise_deviation * np.sqrt(made.realisations)
    columns = [
        [_share(made, made.frequency, one, low * cutoff, high * cutoff) for low, high in zones],
        *(
            [_share(made, x.frequency, _above(x), a * cutoff, b * cutoff) for a, b in zones]
            for x in (made.even, made.odd)
        ),
    ]
    names = [f"{low:g} … {high:g}" for low, high in zones]
    return (head, *zip(names, *columns, strict=True))


def _above(level: Level) -> FloatArray:
    """Distortion without the contribution of noise."""
    return np.sqrt(np.maximum(level.level**2 - level.noise**2, 0))


def _share(
    made: BestLinearApproximation, at: FloatArray, level: FloatArray, low: float, high: float
) -> str:
    inside = (at >= low) & (at < high)
    if not inside.any():
        return "no line"
    gain = np.interp(at[inside], made.frequency, np.abs(made.value))
    return f"{100 * np.sqrt(np.mean((level[inside] / gain) ** 2)):.1f}"
