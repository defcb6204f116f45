"""Spring knee: a second spring keeps the throttle a little open when nobody drives it.

Should the motor lose its current, the motorcycle must limp home. Two springs meet at a position of
some per cent; below it the motor works against the opening spring instead of the closing one, which
its controller does not know.

Equation
--------
    th'' += w_s^2 k (th_0 - th)   where th < th_0, else nothing

Symbols
-------
    k     stiffness   of the opening spring over that of the servo   1     0.2 to 1 (absent 0)
    th_0  home        opening at which both springs meet             1     0.05 to 0.08
    w_s   natural frequency of the servo                             rad/s

Trace
-----
Below one position the plate stays above its command and answers faster; above it nothing. A sweep
across the position gives even harmonics.

Confused with
-------------
Gear play and stiction, which do not care where the plate stands: a sweep about another opening.

Reference
---------
Deur, Pavkovic, Peric, Jansz and Hrovat, "An electronic throttle control strategy including
compensation of friction and limp-home effects", IEEE Transactions on Industry Applications 40
(2004).
"""

from dataclasses import dataclass

from slipbench.plant.effects.effect import Effect, Hook
from slipbench.plant.parameters import parameter


def push_home(
    servo_acceleration: float,
    throttle: float,
    throttle_servo_natural_frequency: float,
    stiffness: float,
    home: float,
) -> float:
    """The acceleration [1/s^2] with the opening spring's share."""
    below = max(home - throttle, 0.0)
    return servo_acceleration + throttle_servo_natural_frequency**2 * stiffness * below


@dataclass(frozen=True)
class SpringKnee(Effect):
    """The limp-home spring of the throttle body."""

    name = "spring_knee"
    block = "throttle_servo"
    shows_in = ("throttle_position",)
    confused_with = ("gear_play", "throttle_stiction")
    hooks = (Hook("servo_acceleration", push_home),)

    stiffness: float = parameter(
        0.5, "1", 0.0, 3.0, "opening spring over the servo's", absent=0.0, smallest=0.1
    )
    home: float = parameter(0.07, "1", 0.0, 0.5, "opening at which both springs meet")
