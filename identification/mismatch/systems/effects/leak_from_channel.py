"""Leak from a channel: some of another recorded quantity adds to this one.

Half a track width times the yaw rate adds to the speed of an outer wheel; a bridge feels the load of
its neighbour; a supply wire couples into a sensor's: cross-talk.

Equation
--------
    f += g z

Symbols
-------
    g   share   of the other quantity that adds   0.02 to 0.5 of the usual ones (absent 0)
    z           the other quantity

Trace
-----
What is left over follows the other quantity along a line, whatever the quantity itself does.

Confused with
-------------
Gain with a channel (goes with the product of both): a segment in which the quantity itself is
small. Offset where the other quantity hardly changes.

Reference
---------
Everett, "Sensors for mobile robots" (1995), chapter on dead reckoning: speeds of the two wheels of an
axle.
"""

from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import SeamEffect
from slipbench.plant.parameters import parameter


def add(value: float, other: float, share: float) -> float:
    """Return the quantity plus a share of the other."""
    return value + share * other


@dataclass(frozen=True)
class LeakFromChannel(SeamEffect):
    """What another quantity adds."""

    name = "leak_from_channel"
    block = "seam"
    confused_with = ("gain_with_channel", "offset")
    uses = "channel"
    act = add

    share: float = parameter(
        0.1, "[seam/other]", -5.0, 5.0, "of the other quantity", absent=0.0, smallest=0.02
    )
