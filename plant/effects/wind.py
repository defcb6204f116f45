"""Wind: what counts for the drag is the speed through the air, not over the ground.

At 53 m/s a headwind of 3 m/s adds more than a tenth to the drag. It blows steadily, with gusts, and
turns round with the road.

Equation
--------
    F = rho/2 C_d A ((v + u)|v + u| - v|v|);   u = w + w_g sin(2 pi t / t_g)

Symbols
-------
    w     head_wind     steady, positive is from ahead   m/s   -5 to 5 (absent 0)
    w_g   gust          amplitude                        m/s   0 to 3 (absent 0)
    t_g   gust_period   of the gusts                     s     3 to 20
    v                   speed over the ground            m/s

Trace
-----
A slow force, not tied to any input, larger in proportion to speed; with the other sign on the way
back.

Confused with
-------------
Grade (bound to a place), squat (bound to the input) and, while the speed drifts, a torque dip:
repeat the run, and ride it both ways.

Reference
---------
Hucho (ed.), "Aerodynamics of Road Vehicles", 4th edition (1998); Cooper, "Atmospheric turbulence
with respect to moving ground vehicles", Journal of Wind Engineering and Industrial Aerodynamics 17
(1984).
"""

import math
from dataclasses import dataclass

from slipbench.plant.effects.effect import Effect, Hook
from slipbench.plant.parameters import parameter

PERIODS = tuple(1.0 / f for f in (0.3375 - 0.0125 * n for n in range(24)))
"""s, 3 to 20: recordings of 20 s tell frequencies apart that differ by a quarter of 1/20 Hz."""


def blow(
    drag_force: float,
    speed: float,
    time: float,
    body_drag_area: float,
    body_air_density: float,
    head_wind: float,
    gust: float,
    gust_period: float,
) -> float:
    """The force against the motion [N]."""
    through = speed + head_wind + gust * math.sin(2.0 * math.pi * time / gust_period)
    more = through * abs(through) - speed * abs(speed)
    return drag_force + 0.5 * body_air_density * body_drag_area * more


@dataclass(frozen=True)
class Wind(Effect):
    """Drag by the speed through moving air."""

    name = "wind"
    block = "road"
    shows_in = ("optical_speed", "front_teeth", "rear_teeth")
    confused_with = ("grade", "squat", "torque_dip", "closed_throttle_friction")
    hooks = (Hook("drag_force", blow),)

    head_wind: float = parameter(
        3.0, "m/s", -30.0, 30.0, "steady, positive is from ahead", absent=0.0, smallest=1.0
    )
    gust: float = parameter(1.5, "m/s", 0.0, 20.0, "amplitude", absent=0.0, smallest=0.5)
    gust_period: float = parameter(8.0, "s", 0.2, 600.0, "of the gusts", sought=PERIODS)
