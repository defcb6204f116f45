"""Many plays: a hysteresis of several widths, as in magnets and piezos.

Each domain switches at its own level. Several plays of growing width side by side make loops
within loops: the model of Prandtl and Ishlinskii, a special case of Preisach's.

Equation
--------
    p_i = min(max(p_i, f - w_i), f + w_i),   w_i = i w / 4,   i = 1 to 4,   f = mean of p_i

Symbols
-------
    w     width   half of the widest play   of the quantity   0.05 to 1 of it (absent 0)
    p_i           output of each play

Trace
-----
Small reversals make small loops, large ones large loops; nothing depends on speed.

Confused with
-------------
Hysteresis (one pause of one width), lag (depends on speed), Bouc-Wen (tends to a level): reversals of
several sizes.

Reference
---------
Hassani, Tjahjowidodo and Do, "A survey on hysteresis modeling, identification and control",
Mechanical Systems and Signal Processing (2014), section 3.3.
"""

from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import INPUT, SEAM, SeamEffect
from slipbench.plant.parameters import parameter


def follow(
    value: float, memory: float, second: float, third: float, fourth: float, width: float
) -> tuple[float, float, float, float, float]:
    """Return the mean of the plays, and the output of each."""
    a = min(max(memory, value - 0.25 * width), value + 0.25 * width)
    b = min(max(second, value - 0.5 * width), value + 0.5 * width)
    c = min(max(third, value - 0.75 * width), value + 0.75 * width)
    d = min(max(fourth, value - width), value + width)
    return 0.25 * (a + b + c + d), a, b, c, d


@dataclass(frozen=True)
class ManyPlays(SeamEffect):
    """Plays of several widths side by side."""

    name = "many_plays"
    block = "seam"
    confused_with = ("hysteresis", "lag", "bouc_wen")
    acts_on = (INPUT, SEAM)
    remembers = 4
    act = follow

    width: float = parameter(
        0.2, "[seam]", 0.0, 3.0, "half of the widest play", absent=0.0, smallest=0.04
    )
