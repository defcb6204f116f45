"""Gain-scheduled PID over speed, with margins between the design speeds.

The gains are interpolated linearly between two designs (`controllers.schedule`). No recording
exists there, so the gains halfway must meet the margins on the paths of both neighbours.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from slipbench.identification.design.gains import Gains
from slipbench.identification.design.problem import LinearController, Problem
from slipbench.identification.design.widest import Designed, NoDesign, pid

RESERVE = 0.1  # of each margin, kept for the speeds between two designs
SIMILAR = 1.0  # m/s: runs whose speeds differ by less count as one speed


@dataclass(frozen=True)
class Scheduled:
    """designs: (speed in m/s, design), speeds increasing."""

    designs: tuple[tuple[float, Designed], ...]


def scheduled(problems: Sequence[tuple[float, Problem]], most: int = 60) -> Scheduled | NoDesign:
    """Designs for every speed, checked halfway between. problems: (speed in m/s, problem)."""
    ordered = sorted(problems, key=lambda p: p[0])
    for (low, _), (high, _) in pairwise(ordered):
        if high - low < SIMILAR:
            return NoDesign(f"two runs at {low:.1f} m/s; a gain schedule needs one run per speed")
    found: list[tuple[float, Problem, Designed]] = []
    for speed, problem in ordered:
        required = problem.required.with_reserve(RESERVE)
        design = pid(replace(problem, required=required), most)
        if isinstance(design, NoDesign):
            return NoDesign(f"at {speed:.1f} m/s: {design.reason}")
        found.append((speed, problem, design))
    for (low, before, one), (high, after, other) in pairwise(found):
        middle = halfway(one.controller, other.controller)
        if not (before.met(middle.response) and after.met(middle.response)):
            return NoDesign(
                f"the interpolated gains halfway between {low:.1f} and {high:.1f} m/s do not meet the "
                "margins at both speeds; record a run between them"
            )
    return Scheduled(tuple((speed, design) for speed, _, design in found))


def halfway(a: LinearController, b: LinearController) -> Gains:
    """PID halfway between two designs, as the gain schedule interpolates it."""
    assert isinstance(a, Gains)
    assert isinstance(b, Gains)
    return replace(
        a,
        proportional=0.5 * (a.proportional + b.proportional),
        integral=0.5 * (a.integral + b.integral),
        derivative=0.5 * (a.derivative + b.derivative),
    )
