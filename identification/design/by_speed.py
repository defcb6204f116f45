"""One PID for each speed, and the reserves of what lies between two speeds.

Between two designs the gains lie on a straight line (`controllers.schedule`). Nobody measured a
motorcycle there: so the gains halfway must keep the reserves on the paths of both neighbours.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from slipbench.identification.design.gains import Gains
from slipbench.identification.design.problem import Answering, Problem
from slipbench.identification.design.widest import Designed, NoDesign, pid

LEFT = 0.1  # of each reserve, for what lies between two speeds
ALIKE = 1.0  # m/s: runs whose speeds differ by less are of one speed


@dataclass(frozen=True)
class Scheduled:
    """designs: (speed in m/s, design), speeds increasing."""

    designs: tuple[tuple[float, Designed], ...]


def scheduled(problems: Sequence[tuple[float, Problem]], most: int = 60) -> Scheduled | NoDesign:
    """Design for every speed, and look between them. problems: (speed in m/s, problem)."""
    ordered = sorted(problems, key=lambda p: p[0])
    for (low, _), (high, _) in pairwise(ordered):
        if high - low < ALIKE:
            return NoDesign(f"two runs were ridden at {low:.1f} m/s; a schedule needs one a speed")
    found: list[tuple[float, Problem, Designed]] = []
    for speed, problem in ordered:
        asked = problem.required.with_reserve(LEFT)
        design = pid(replace(problem, required=asked), most)
        if isinstance(design, NoDesign):
            return NoDesign(f"at {speed:.1f} m/s: {design.reason}")
        found.append((speed, problem, design))
    for (low, before, one), (high, after, other) in pairwise(found):
        middle = halfway(one.controller, other.controller)
        if not (before.met(middle.response) and after.met(middle.response)):
            return NoDesign(
                f"gains halfway between {low:.1f} and {high:.1f} m/s do not keep the reserves at "
                "both; record a run between them"
            )
    return Scheduled(tuple((speed, design) for speed, _, design in found))


def halfway(a: Answering, b: Answering) -> Gains:
    """Return the PID that a schedule runs halfway between two speeds."""
    assert isinstance(a, Gains)
    assert isinstance(b, Gains)
    return replace(
        a,
        proportional=0.5 * (a.proportional + b.proportional),
        integral=0.5 * (a.integral + b.integral),
        derivative=0.5 * (a.derivative + b.derivative),
    )
