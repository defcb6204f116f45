"""Backlash: the slack of the chain, the dogs and the cush drive.

When the torque of the driveline changes sign, the chain's upper run goes slack and the lower one
has to tighten before anything is passed on. For a moment the engine and the wheel are two free
bodies; then they meet with whatever difference of speed they have gained.

Equation
--------
    phi_s = phi - a/2 sgn(phi)  where |phi| > a/2, else 0;   T = k phi_s + c e phi'
    e = min(1, |phi_s| / (s a)): the damper engages with the spring, so that the torque is
    continuous and nothing is passed inside the gap.

Symbols
-------
    a   slack      total gap, as an angle of the rear wheel     rad   4e-3 to 15e-3 (absent 0)
    s   softness   share of the gap over which damping engages  1     0.2

Trace
-----
Zero crossings of the driveline torque: a flat spot, then a step of wheel speed, at small throttle
and when the rider opens after closing. Nothing at all while the torque keeps its sign.

Confused with
-------------
A hardening cush drive (also softer near zero): a sweep about a loaded mean, where backlash is
silent, separates them. A lower stiffness absorbs part of it: several amplitudes separate those.

Reference
---------
Lagerberg and Egardt, "Backlash estimation with application to automotive powertrains", IEEE
Transactions on Control Systems Technology 15 (2007).
"""

from dataclasses import dataclass

from slipbench.plant.effects.effect import Effect, Hook
from slipbench.plant.parameters import parameter


def dead_zone(
    spring_twist: float, spring_rate: float, slack: float, softness: float
) -> tuple[float, float]:
    """Twist beyond the gap [rad] and the rate that the damper feels [rad/s]."""
    half = 0.5 * slack
    beyond = max(spring_twist - half, 0.0) + min(spring_twist + half, 0.0)
    if slack > 0.0:
        spring_rate *= min(1.0, abs(beyond) / (softness * slack))
    return beyond, spring_rate


@dataclass(frozen=True)
class Backlash(Effect):
    """Slack of the chain and the dogs."""

    name = "backlash"
    block = "driveline"
    shows_in = ("rear_teeth", "engine_speed")
    confused_with = ("hardening_cush", "slipper_clutch", "clutch_slip")
    hooks = (Hook("spring_motion", dead_zone),)

    slack: float = parameter(
        8e-3, "rad", 0.0, 0.1, "total gap at the rear wheel", absent=0.0, smallest=2e-3
    )
    softness: float = parameter(0.2, "1", 0.02, 1.0, "share of the gap to engage the damper")
