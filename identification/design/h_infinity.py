"""The widest H-infinity loop that keeps its reserves, of the least order that is as good.

Every law is judged by the same conditions on what will run; the synthesis is only a way to
candidates. The corner of its sensitivity weight is raised until a condition says no, for a few
shapes of the weights; then the order is lowered as far as it costs nothing.
"""

import numpy as np

from identification.design.mixed_sensitivity import (
    Synthesis,
    Wishes,
    available,
    reduced,
    synthesis,
)
from identification.design.problem import Problem
from identification.design.widest import Designed, NoDesign, allowed, told

CORNERS = np.geomspace(0.8, 12.0, 20)  # Hz
SHAPES = tuple(
    (peak, effort, quiet)
    for peak in (1.7, 2.0)
    for effort in (0.3, 1.0, 3.0)
    for quiet in (5.0, 20.0)
)
COST = 0.98  # of the rejection at full order that a lower order must keep
SMALLEST = 3
INSTALL = "pip install 'slipbench[robust]'"


def h_infinity(problem: Problem) -> Designed | NoDesign:
    """Raise the corner as far as the problem allows; of all shapes the one that holds most off."""
    if not available():
        return NoDesign(f"python-control finds no slycot: {INSTALL}")
    widest: tuple[float, Wishes] | None = None
    for shape in SHAPES:
        for corner in CORNERS:
            wishes = Wishes(float(corner), *shape)
            found = _of_order(problem, wishes, None)
            if found is None or not allowed(problem, found):
                break
            rejection = problem.nominal(found.response).rejection
            if widest is None or rejection > widest[0]:
                widest = rejection, wishes
    if widest is None:
        return NoDesign("no synthesis keeps these reserves, not even the slowest")
    return told(problem, _smallest(problem, *widest))


def _of_order(problem: Problem, wishes: Wishes, order: int | None) -> Synthesis | None:
    full = synthesis(problem, wishes)
    if full is None:
        return None
    return reduced(full, order or full.nstates, wishes.corner, problem.period)


def _smallest(problem: Problem, rejection: float, wishes: Wishes) -> Synthesis:
    full = synthesis(problem, wishes)
    assert full is not None
    for order in range(SMALLEST, full.nstates + 1):
        found = reduced(full, order, wishes.corner, problem.period)
        if found is not None and allowed(problem, found):
            kept = problem.nominal(found.response).rejection
            if kept >= COST * rejection:
                return found
    raise AssertionError("the full order was allowed before")
