"""Back EMF: the motion of a motor induces a voltage that opposes its supply.

The voltage that drives current through the winding is the supply voltage less the induced one.

Equation
--------
    u -= k w

Symbols
-------
    k   constant   induced voltage over speed   0.05 to 1 of the usual ones (absent 0)
    w              a speed among the states
    u              the input

Trace
-----
The response to the input falls as the speed rises, and free running slows down while the drive is
shorted, not while it is open.

Confused with
-------------
Viscous friction and linear loss: the same where the input acts in proportion; they are
distinguished by a saturation, a lag or a delay of the input, or by coasting with an open drive.

Reference
---------
Younkin, "Electric servo motor equations and time constants": voltage equation of the DC servo motor.
"""

from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import INPUT, SeamEffect
from slipbench.plant.parameters import parameter


def induce(value: float, other: float, constant: float) -> float:
    """Return the remaining voltage."""
    return value - constant * other


@dataclass(frozen=True)
class BackEmf(SeamEffect):
    """Voltage that the motion induces."""

    name = "back_emf"
    block = "seam"
    confused_with = ("viscous_friction", "linear_loss", "supply_limit")
    acts_on = (INPUT,)
    uses = "speed"
    act = induce

    constant: float = parameter(
        0.2, "[seam/other]", -3.0, 3.0, "induced voltage over speed", absent=0.0, smallest=0.04
    )
