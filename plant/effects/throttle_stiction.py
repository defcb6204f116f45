"""Stiction: the throttle shaft sticks in its bearings and lets go with a jerk.

Dry friction of shaft, seals and brushes opposes every motion with a nearly constant torque, more
at the moment of breaking loose than while sliding (Stribeck). The servo has to build up an error
first.

Equation
--------
    th'' -= w_s^2 (F + (b - 1) F exp(-(th' / v_s)^2)) z + c d z';   z' = th' / d, |z| <= 1
    Bristles bend over a travel d before they slide (z = 1), and hold the plate where it stands;
    c = w_s sqrt(F / d) keeps it from ringing on them.

Symbols
-------
    F     width             error that just keeps it sliding    1     2e-3 to 6e-3 (absent 0)
    b     breakaway         friction at breaking loose, over F  1     1.5
    v_s   stribeck_speed    at which the excess has faded       1/s   0.1
    d     presliding        travel that bends the bristles      1     2e-4
    z     bristle           how far they are bent, of full      1
    w_s   natural frequency of the servo                        rad/s

Trace
-----
Flat tops and odd harmonics of small sines, a phase lag that grows as the amplitude falls, and no
answer at all below the width.

Confused with
-------------
Gear play (also flat at reversal, whatever the frequency, and without a jerk): a very small sine
separates them, since play passes nothing of it and friction lets it creep.

Reference
---------
Armstrong-Helouvry, Dupont and Canudas de Wit, "A survey of models, analysis tools and compensation
methods for the control of machines with friction", Automatica 30 (1994); Dahl, "Solid friction
damping of mechanical vibrations", AIAA Journal 14 (1976), on travel before sliding.
"""

import math
from dataclasses import dataclass

from slipbench.plant.effects.effect import Effect, Hook
from slipbench.plant.parameters import parameter


def stick(
    servo_acceleration: float,
    throttle_rate: float,
    bristle: float,
    throttle_servo_natural_frequency: float,
    width: float,
    breakaway: float,
    stribeck_speed: float,
    presliding: float,
    step: float,
) -> tuple[float, float]:
    """The acceleration [1/s^2] less that of the dry friction, and the bristles' rate."""
    bent = min(max(bristle + throttle_rate * step / presliding, -1.0), 1.0)
    x = throttle_rate / stribeck_speed
    friction = width * (1.0 + (breakaway - 1.0) * math.exp(-x * x))
    rate = (bent - bristle) / step
    held = throttle_servo_natural_frequency**2 * friction * bent
    held += throttle_servo_natural_frequency * math.sqrt(width * presliding) * rate
    return servo_acceleration - held, rate


@dataclass(frozen=True)
class ThrottleStiction(Effect):
    """Dry friction of the throttle shaft."""

    name = "throttle_stiction"
    block = "throttle_servo"
    shows_in = ("throttle_position",)
    confused_with = ("gear_play", "spring_knee")
    states = ("bristle",)
    starts = ("throttle_rate",)
    hooks = (Hook("servo_acceleration", stick, governs=("bristle",)),)

    width: float = parameter(
        4e-3, "1", 0.0, 0.05, "error that just keeps it sliding", absent=0.0, smallest=1e-3
    )
    breakaway: float = parameter(1.5, "1", 1.0, 4.0, "friction at breaking loose over sliding")
    stribeck_speed: float = parameter(0.1, "1/s", 0.01, 2.0, "speed at which the excess fades")
    presliding: float = parameter(2e-4, "1", 1e-5, 5e-3, "travel that bends the bristles")
