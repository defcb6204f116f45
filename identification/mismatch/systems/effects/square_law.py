"""Square law: the output is the square of the input, with its sign.

A propeller's thrust goes with the square of its speed, the flow through an orifice with the root of
its pressure, a brake's force with its current squared. A linear model is right at one point only.

Equation
--------
    f += c (f |f| / F - f)

Symbols
-------
    c   share   of the quantity that follows the square   1             0.1 to 1 (absent 0)
    F   full    where line and square meet                of the seam   its usual magnitude
    f           the quantity

Trace
-----
Little happens at small values, too much at large ones; the gain grows in proportion to the value.

Confused with
-------------
Square of the quantity (has one sign: bends up on both sides); dead zone (a straight line beyond it);
cubic: values of both signs over a wide range. Where all values have one sign, square and square law
are the same.

Reference
---------
ArduPilot, "Motor thrust scaling": thrust as a mixture of a line and a square of the throttle.
"""

from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import INPUT, SEAM, SeamEffect
from slipbench.plant.parameters import parameter


def bend(value: float, share: float, full: float) -> float:
    """Return the quantity, a share of it squared with its sign."""
    return value + share * (value * abs(value) / full - value)


@dataclass(frozen=True)
class SquareLaw(SeamEffect):
    """A square that keeps the sign."""

    name = "square_law"
    block = "seam"
    confused_with = ("quadratic", "cubic", "dead_zone")
    acts_on = (INPUT, SEAM)
    act = bend

    share: float = parameter(
        0.3, "1", -1.0, 1.5, "of the quantity that follows the square", absent=0.0, smallest=0.06
    )
    full: float = parameter(1.0, "[seam]", 1e-3, 1e3, "where line and square meet", given=True)
