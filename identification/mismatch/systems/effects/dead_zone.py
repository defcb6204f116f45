"""Dead zone: values below a threshold have no effect.

A valve overlaps its port, a coupling has free play, an amplifier has a bias: small values are lost,
and larger ones are smaller by the threshold.

Equation
--------
    f = max(|f| - w, 0) sign f

Symbols
-------
    w   width   half of the zone   of the quantity   0.02 to 1 of its usual magnitude (absent 0)
    f           the quantity at the seam

Trace
-----
Small motion does not pass and large motion nearly does: the gain grows with the amplitude.
Reversals leave a pause.

Confused with
-------------
Hysteresis (remembers where it came from), friction (acts on the speed): small slow motion.

Reference
---------
Gelb and Vander Velde, "Multiple-input describing functions" (1968), chapter 2.
"""

from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import SeamEffect
from slipbench.plant.parameters import parameter


def pass_above(value: float, width: float) -> float:
    """Return the value less the threshold; 0 within it."""
    return value - min(max(value, -width), width)


@dataclass(frozen=True)
class DeadZone(SeamEffect):
    """A threshold below which nothing passes."""

    name = "dead_zone"
    block = "seam"
    confused_with = ("hysteresis", "friction", "saturation")
    act = pass_above

    width: float = parameter(
        0.15, "[seam]", 0.0, 3.0, "half of the zone", absent=0.0, smallest=0.03
    )
