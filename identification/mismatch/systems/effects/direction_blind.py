"""Direction blind: a sensor measures speed without its sign.

A single pulse track gives the speed, not the direction.

Equation
--------
    f += c (|f| - f)

Symbols
-------
    c   share   of the sensor that is blind   1   1, less where filters mix (absent 0)

Trace
-----
Negative motion is shown as positive; at every change of sign the reading has a corner at zero.

Confused with
-------------
Asymmetry (the corner without the change of sign), offset: motion through zero.

Reference
---------
Wigren and Schoukens, "Coupled electric drives data set and reference models", Uppsala University
2017-024.
"""

from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import OUTPUT, SeamEffect
from slipbench.plant.parameters import parameter


def without_sign(value: float, share: float) -> float:
    """Return the value, of which a share is replaced by its magnitude."""
    return value + share * (abs(value) - value)


@dataclass(frozen=True)
class DirectionBlind(SeamEffect):
    """The size without the sign."""

    name = "direction_blind"
    block = "seam"
    confused_with = ("asymmetry", "reversed_sign")
    acts_on = (OUTPUT,)
    act = without_sign

    share: float = parameter(
        1.0, "1", 0.0, 1.25, "of the sensor that is blind", absent=0.0, smallest=0.5
    )
