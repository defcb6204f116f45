"""Driveline loss: gears and chain keep a share of every torque that they pass.

Tooth flanks slide and chain links turn under load. Of the torque that drives the wheel a share is
lost; of the torque that brakes it the same share is lost on the way to the engine.

Equation
--------
    T_wheel = T_d - eta |T_d| sgn(w_r),   the sign fading below 1 rad/s

Symbols
-------
    eta   loss   share of the torque   1       0.02 to 0.06 (absent 0)
    w_r          speed of the wheel    rad/s
    T_d          driveline torque      N m

Trace
-----
The wheel gets less than the engine gives when driving, and more than that is missing when braking:
a kink at zero torque.

Confused with
-------------
Asymmetric filling (opening against closing, not driving against braking): the engine speed's
channel separates them, and so does a wide sweep; a narrow one cannot.

Reference
---------
Spicer, Richardson, Ehrlich et al., "Effects of frictional loss on bicycle chain drive efficiency",
Journal of Mechanical Design 123 (2001); Lodge and Burgess, Proc. IMechE C 216 (2002).
"""

from dataclasses import dataclass

from slipbench.plant.effects.effect import Effect, Hook
from slipbench.plant.parameters import parameter


def lose(wheel_torque: float, rear_speed: float, loss: float) -> float:
    """The torque that arrives at the wheel [N m]."""
    return wheel_torque - loss * abs(wheel_torque) * min(max(rear_speed, -1.0), 1.0)


@dataclass(frozen=True)
class DrivelineLoss(Effect):
    """Share of the torque that gears and chain keep."""

    name = "driveline_loss"
    block = "driveline"
    shows_in = ("rear_teeth", "engine_speed", "optical_speed")
    confused_with = ("asymmetric_filling", "closed_throttle_friction")
    hooks = (Hook("wheel_torque", lose),)

    loss: float = parameter(0.04, "1", 0.0, 0.4, "share of the torque", absent=0.0, smallest=0.01)
