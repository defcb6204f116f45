"""Linear loss: a store has an additional loss in proportion to its content.

Seals seep, charges creep away, pipes rub: slow flow is in proportion to its pressure, fast flow to
its square root. A model that knows one of the two overstates the loss at one end of the range and
understates it at the other; the rate is negative where the model's own law takes too much from a
full store.

Equation
--------
    x' = f - r x

Symbols
-------
    r   rate   of the loss   1/s   0.004 to 0.1 of the store a period (absent 0)
    x          the state

Trace
-----
The time constant is another one when full than when empty; at rest the level is off in proportion.

Confused with
-------------
Overflow (only above an edge), a scale of what comes in (the time constant stays), a quadratic at
the sensor of the store (changes the reading, not the rate).

Reference
---------
White, "Fluid mechanics", 8th edition (2016), section 6.3: loss in laminar and in turbulent flow.
"""

from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import RATE, SeamEffect
from slipbench.plant.parameters import parameter


def lose(value: float, rate_of: float, rate: float) -> float:
    """Return the remaining rate of change."""
    return value - rate * rate_of


@dataclass(frozen=True)
class LinearLoss(SeamEffect):
    """A state that loses in proportion to itself."""

    name = "linear_loss"
    block = "seam"
    confused_with = ("overflow", "scale", "quadratic")
    acts_on = (RATE,)
    act = lose

    rate: float = parameter(0.02, "[1/time]", -1.0, 1.0, "of the loss", absent=0.0, smallest=0.004)
