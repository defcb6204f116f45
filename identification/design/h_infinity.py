"""The widest H-infinity loop that keeps its reserves, of the least order that is as good.

Every law is judged by the same conditions on what will run; the synthesis is only a way to
candidates. Corners of its sensitivity weight are tried for a few shapes of the weights, since the
conditions are not its own and the slowest synthesis need not be the one that keeps them; then the
order is lowered as far as it costs nothing.
"""

import numpy as np

from slipbench.identification.design.mixed_sensitivity import (
    Synthesis,
    Wishes,
    available,
    reduced,
    synthesis,
)
from slipbench.identification.design.problem import Problem
from slipbench.identification.design.widest import Designed, NoDesign, allowed, told

CORNERS = np.geomspace(0.8, 8.0, 12)  # Hz
SHAPES = tuple(
    (peak, effort, quiet) for peak in (1.7, 2.0) for effort in (1.0, 3.0) for quiet in (5.0, 20.0)
)
COST = 0.98  # of rejection and bandwidth at the highest order that a lower one must keep
SMALLEST = 3
INSTALL = "pip install 'slipbench[robust]'"


def h_infinity(problem: Problem) -> Designed | NoDesign:
    """Of all syntheses that the problem allows take the one that holds most off."""
    if not available():
        return NoDesign(f"python-control finds no slycot: {INSTALL}")
    widest: tuple[float, Wishes] | None = None
    for shape in SHAPES:
        for corner in CORNERS:
            wishes = Wishes(float(corner), *shape)
            found = _least_reduced(problem, wishes)
            if found is None or not allowed(problem, found):
                continue
            rejection = problem.nominal(found.response).rejection
            if widest is None or rejection > widest[0]:
                widest = rejection, wishes
    if widest is None:
        return NoDesign("no synthesis keeps these reserves, not even the slowest")
    return told(problem, _smallest(problem, *widest))


def _least_reduced(problem: Problem, wishes: Wishes) -> Synthesis | None:
    """Leave out only what SLICOT has nearly at infinity for the path's steep fall."""
    full = synthesis(problem, wishes)
    if full is None:
        return None
    orders = range(full.nstates, SMALLEST - 1, -1)
    found = (reduced(full, order, wishes.corner, problem.period) for order in orders)
    return next((f for f in found if f is not None), None)


def _smallest(problem: Problem, rejection: float, wishes: Wishes) -> Synthesis:
    full, most = synthesis(problem, wishes), _least_reduced(problem, wishes)
    assert full is not None
    assert most is not None
    reach = problem.nominal(most.response).bandwidth
    for order in range(SMALLEST, full.nstates):
        found = reduced(full, order, wishes.corner, problem.period)
        if found is not None and allowed(problem, found):
            m = problem.nominal(found.response)
            if m.rejection >= COST * rejection and m.bandwidth >= COST * reach:
                return found
    raise AssertionError("the highest order was allowed before")
