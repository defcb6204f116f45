"""Step 3: reduction of the 1X order, and its phase lag (figure 3)."""

import math

from slipbench.identification.report.report import Drawn
from slipbench.identification.response.identify import Identification
from slipbench.identification.signals.motion import Motion
from slipbench.identification.signals.tooth_pitch import ToothPitch
from slipbench.studies.paper import encoder_figures, filter_figures
from slipbench.studies.paper.context import Context, Found, runs_of
from slipbench.studies.paper.line_reduction import LineReductions, line_reductions, reduction_claims
from slipbench.studies.paper.paper_section import Section, Table, drawn

TITLE = "Filtering"
SHOWN = (2.0, 5.0, 8.0, 10.0, 15.0)  # Hz


def filtering(found: Found, context: Context) -> Section:
    """Section on filtering offline, online, and by learnt tooth pitch."""
    one = runs_of(found, "throttle")[0]
    lines, motion = line_reductions(one), one.motion
    if not isinstance(lines, LineReductions) or not isinstance(motion, Motion):
        return Section("3", TITLE, (f"Not shown: {lines}.",))
    return Section(
        "3",
        TITLE,
        (
            "The paper removes the wheel order with a low pass and a second-order "
            "notch that tracks the wheel frequency. Applied forwards and backwards "
            "offline it adds no phase; online it does. Estimating the pitch error of "
            "every tooth is better: the wheel speed is then correct, all orders are "
            "removed at once, and no delay is added.",
        ),
        _figures(one, motion, lines, context.nominal.rear_wheel.radius),
        reduction_claims(lines),
        {"Phase lag of each online filter, degrees.": _phase_table(lines)},
    )


def _figures(
    one: Identification, motion: Motion, lines: LineReductions, radius: float
) -> tuple[Drawn, ...]:
    pitch, teeth = motion.pitch, motion.axle.teeth_per_turn or 0
    speed = float(radius * 2 * math.pi * lines.frequency)
    return (
        *drawn(
            "filtering",
            "Figure 3 of the paper: rear wheel speed raw, notched, and with tooth- "
            "pitch compensation; right: reduction of each order.",
            lambda: filter_figures.filtering(one, lines),
        ),
        *drawn(
            "filter_phases",
            "Gain and phase of what a controller could run online.",
            lambda: filter_figures.phases(lines, speed, radius, teeth),
        ),
        *drawn(
            "teeth",
            "Where every tooth stands, learnt from the recording.",
            lambda: encoder_figures.teeth(pitch) if isinstance(pitch, ToothPitch) else None,
        ),
    )


def _phase_table(lines: LineReductions) -> Table:
    costs = filter_figures.phase_costs(lines, SHOWN)
    head = ("filter", *(f"{f:g} Hz" for f in SHOWN))
    return (head, *((name, *(f"{x:z.1f}" for x in row)) for name, row in costs.items()))
