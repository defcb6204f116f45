"""Gear play: between the throttle motor and the plate the teeth of two gears have clearance.

After every reversal the motor has to cross the clearance before it moves the plate again. The plate
follows at one flank of the gap while opening and at the other while closing.

Equation
--------
    c = min(max(m, th_c - a/2), th_c + a/2),   m' = (c - m) / step;   the servo follows c, not th_c

Symbols
-------
    a     play      total gap                              1   2e-3 to 5e-3 (absent 0)
    m     flank     where the flank was left (a state)     1
    c               command that arrives at the plate      1
    th_c            command to the servo                   1

Trace
-----
A flat spot at every reversal, of a width in command that does not depend on frequency; a small
sine comes out smaller by the gap.

Confused with
-------------
Stiction (its flat spot depends on the rate, and it jerks): a tiny sine separates them.

Reference
---------
Nordin and Gutman, "Controlling mechanical systems with backlash: a survey", Automatica 38 (2002).
"""

from dataclasses import dataclass

from slipbench.plant.effects.effect import Effect, Hook
from slipbench.plant.parameters import parameter


def cross_the_gap(
    servo_acceleration: float,
    throttle_command: float,
    flank: float,
    throttle_servo_natural_frequency: float,
    play: float,
    step: float,
) -> tuple[float, float]:
    """Acceleration [1/s^2] towards what arrives, and the rate of the flank [1/s]."""
    half = 0.5 * play
    arriving = min(max(flank, throttle_command - half), throttle_command + half)
    missing = throttle_servo_natural_frequency**2 * (arriving - throttle_command)
    return servo_acceleration + missing, (arriving - flank) / step


@dataclass(frozen=True)
class GearPlay(Effect):
    """Clearance in the gears of the throttle body."""

    name = "gear_play"
    block = "throttle_servo"
    shows_in = ("throttle_position",)
    confused_with = ("throttle_stiction", "spring_knee")
    states = ("flank",)
    starts = ("throttle",)
    hooks = (Hook("servo_acceleration", cross_the_gap, governs=("flank",)),)

    play: float = parameter(3e-3, "1", 0.0, 0.1, "whole gap", absent=0.0, smallest=1e-3)
