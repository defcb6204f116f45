"""Scale: a channel has a wrong gain.

A calibration is old, a tyre has another size, a gain is not what the data sheet says.

Equation
--------
    f *= 1 + s

Symbols
-------
    s   share   too much   1   -0.5 to 0.5 (absent 0)

Trace
-----
What is left over looks like the channel itself.

Confused with
-------------
A gain of the system: re-calibration adjusts it, which hides the effect where it is not well known.

Reference
---------
JCGM 200:2012, "International vocabulary of metrology", 2.39 on calibration.
"""

from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import INPUT, OUTPUT, SeamEffect
from slipbench.plant.parameters import parameter


def magnify(value: float, share: float) -> float:
    """Return the value times the wrong gain."""
    return value * (1.0 + share)


@dataclass(frozen=True)
class Scale(SeamEffect):
    """A wrong gain."""

    name = "scale"
    block = "seam"
    confused_with = ("offset", "gain_with_channel")
    acts_on = (INPUT, OUTPUT)
    act = magnify

    share: float = parameter(0.1, "1", -0.9, 5.0, "too much", absent=0.0, smallest=0.02)
