"""Maximum-bandwidth H-infinity design within the stated margins, of the lowest sufficient order.

The requirements are the same for every control law and are checked on the discrete controller; the
synthesis only provides candidates. Corner frequencies of the sensitivity weight are evaluated for a few
shapes of the weights, because the requirements are not part of the synthesis. Then the order is
reduced as long as bandwidth and rejection are kept.
"""

import numpy as np

from slipbench.identification.design.mixed_sensitivity import (
    Synthesis,
    WeightParameters,
    available,
    reduced,
    synthesis,
)
from slipbench.identification.design.problem import Problem
from slipbench.identification.design.widest import Designed, NoDesign, allowed, evaluated

CORNERS = np.geomspace(0.8, 8.0, 12)  # Hz
SHAPES = tuple(
    (peak, effort, quiet) for peak in (1.7, 2.0) for effort in (1.0, 3.0) for quiet in (5.0, 20.0)
)
COST = 0.98  # share of rejection and bandwidth that a reduced order must keep
SMALLEST = 3
INSTALL = "pip install 'slipbench[robust]'"


def h_infinity(problem: Problem) -> Designed | NoDesign:
    """H-infinity design with the highest rejection bandwidth that the problem allows."""
    if not available():
        return NoDesign(f"python-control does not find slycot: {INSTALL}")
    widest: tuple[float, WeightParameters] | None = None
    for shape in SHAPES:
        for corner in CORNERS:
            weights = WeightParameters(float(corner), *shape)
            found = _least_reduced(problem, weights)
            if found is None or not allowed(problem, found):
                continue
            rejection = problem.nominal(found.response).rejection
            if widest is None or rejection > widest[0]:
                widest = rejection, weights
    if widest is None:
        return NoDesign("no H-infinity synthesis meets the margins, not even the slowest")
    return evaluated(problem, _smallest(problem, *widest))


def _least_reduced(problem: Problem, weights: WeightParameters) -> Synthesis | None:
    """Controller of the highest order that can be discretised; only very fast poles are removed."""
    full = synthesis(problem, weights)
    if full is None:
        return None
    orders = range(full.nstates, SMALLEST - 1, -1)
    found = (reduced(full, order, weights.corner, problem.period) for order in orders)
    return next((f for f in found if f is not None), None)


def _smallest(problem: Problem, rejection: float, weights: WeightParameters) -> Synthesis:
    full, most = synthesis(problem, weights), _least_reduced(problem, weights)
    assert full is not None
    assert most is not None
    reach = problem.nominal(most.response).bandwidth
    for order in range(SMALLEST, full.nstates):
        found = reduced(full, order, weights.corner, problem.period)
        if found is not None and allowed(problem, found):
            m = problem.nominal(found.response)
            if m.rejection >= COST * rejection and m.bandwidth >= COST * reach:
                return found
    raise AssertionError("the highest order was allowed before")
