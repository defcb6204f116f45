"""The parts of the motorcycle and their numbers, in SI; defaults are those of a 1000 cc superbike.

The structure follows the racing motorcycle of Corno and Savaresi, "Experimental Identification of
Rear Wheel Slip Dynamics of a Motorbike", IFAC SYSID 2009; the figures are typical of its class
and those of vehicles/nominal.toml.
"""

from dataclasses import dataclass
from math import pi

from slipbench.plant.parameters import Block, parameter


@dataclass(frozen=True)
class ThrottleServo(Block):
    """The throttle body under position control: second order, with hard stops at 0 and 1."""

    natural_frequency: float = parameter(
        2 * pi * 12.6, "rad/s", 2 * pi * 2, 2 * pi * 60, "natural frequency of the servo"
    )
    damping: float = parameter(0.4, "1", 0.05, 3.0, "damping ratio of the servo")
    delay: float = parameter(4e-3, "s", 0.0, 0.05, "from the command to the motor")


@dataclass(frozen=True)
class Intake(Block):
    """The way of the air from the throttle plate into the cylinder: a delay, then a lag."""

    delay: float = parameter(10e-3, "s", 0.0, 0.06, "dead time of the air path")
    filling_time: float = parameter(5e-3, "s", 1e-3, 0.1, "time constant of the manifold")


@dataclass(frozen=True)
class Engine(Block):
    """Torque from air, speed and spark; the full-load curve is a hump about its peak."""

    inertia: float = parameter(0.0175, "kg m^2", 4e-3, 0.08, "crank, clutch basket and shafts")
    peak_torque: float = parameter(112.0, "N m", 20.0, 250.0, "greatest full-load torque")
    peak_speed: float = parameter(
        11500 * pi / 30, "rad/s", 300.0, 2000.0, "crank speed of the peak"
    )
    torque_width: float = parameter(
        8000 * pi / 30, "rad/s", 100.0, 3000.0, "half width of the hump"
    )
    friction: float = parameter(4.0, "N m", 0.0, 20.0, "friction and pumping near standstill")
    friction_rise: float = parameter(
        7.5e-3, "N m s/rad", 0.0, 0.05, "growth of the friction with crank speed"
    )
    opening_scale: float = parameter(0.22, "1", 0.02, 1.0, "opening that fills 63 %")
    torque_scale: float = parameter(1.0, "1", 0.3, 2.0, "factor on the total torque")
    spark_gain: float = parameter(
        0.012 * 180 / pi, "1/rad", 0.0, 3.0, "relative torque per spark advance"
    )
    spark_delay: float = parameter(4e-3, "s", 0.0, 0.05, "from the spark command to the torque")


@dataclass(frozen=True)
class Driveline(Block):
    """Chain, cush drive and shafts as one spring and damper at the rear wheel; the clutch."""

    stiffness: float = parameter(3500.0, "N m/rad", 500.0, 20e3, "torsional stiffness")
    damping: float = parameter(8.0, "N m s/rad", 0.5, 60.0, "torsional damping")
    clutch_capacity: float = parameter(
        250.0, "N m", 20.0, 1000.0, "torque at the crank above which the clutch slips"
    )


@dataclass(frozen=True)
class RearWheel(Block):
    """The driven wheel."""

    inertia: float = parameter(0.65, "kg m^2", 0.2, 2.0, "wheel, tyre, disc and sprocket")
    radius: float = parameter(0.32, "m", 0.2, 0.45, "effective rolling radius")
    rolling_torque: float = parameter(1.0, "N m", 0.0, 30.0, "drag of bearings and chain")


@dataclass(frozen=True)
class Tyre(Block):
    """The static longitudinal force of the rear tyre: Pacejka's sine of an arc tangent.

    No formula is the tyre itself: the brush model, Dugoff's and Burckhardt's have the same slope
    and peak and differ by some per cent of the peak between. form_...: how far the force departs
    from the formula where the slope alone would give 1/8, 2/8 ... 8/8 and 12/8 of the peak.
    """

    slip_stiffness: float = parameter(45e3, "N", 3e3, 120e3, "force per slip at zero slip")
    friction: float = parameter(1.25, "1", 0.1, 2.5, "peak force over load")
    load: float = parameter(1350.0, "N", 100.0, 5000.0, "vertical load on the rear wheel")
    shape: float = parameter(1.55, "1", 1.05, 1.95, "shape factor C of the curve")
    form_1: float = parameter(0.0, "1", -0.3, 0.3, "departure at 1/8, in peaks")
    form_2: float = parameter(0.0, "1", -0.3, 0.3, "departure at 2/8, in peaks")
    form_3: float = parameter(0.0, "1", -0.3, 0.3, "departure at 3/8, in peaks")
    form_4: float = parameter(0.0, "1", -0.3, 0.3, "departure at 4/8, in peaks")
    form_5: float = parameter(0.0, "1", -0.3, 0.3, "departure at 5/8, in peaks")
    form_6: float = parameter(0.0, "1", -0.3, 0.3, "departure at 6/8, in peaks")
    form_7: float = parameter(0.0, "1", -0.3, 0.3, "departure at 7/8, in peaks")
    form_8: float = parameter(0.0, "1", -0.3, 0.3, "departure at 8/8, in peaks")
    form_9: float = parameter(0.0, "1", -0.3, 0.3, "departure at 12/8 and beyond, in peaks")
    low_speed: float = parameter(
        3.0, "m/s", 1.0, 10.0, "below it slip is taken relative to this speed"
    )


@dataclass(frozen=True)
class Body(Block):
    """Motorcycle and rider as one mass against the air and the road."""

    mass: float = parameter(245.0, "kg", 80.0, 500.0, "motorcycle with rider")
    drag_area: float = parameter(0.38, "m^2", 0.05, 1.5, "drag coefficient times area")
    air_density: float = parameter(1.2, "kg/m^3", 0.7, 1.5, "density of the air")
    rolling_resistance: float = parameter(0.012, "1", 0.0, 0.1, "rolling force over weight")


@dataclass(frozen=True)
class FrontWheel(Block):
    """The free wheel: it rolls without slip."""

    radius: float = parameter(0.30, "m", 0.2, 0.45, "effective rolling radius")


@dataclass(frozen=True)
class Encoder(Block):
    """A toothed disc on a wheel and the clock that times every tooth."""

    teeth: float = parameter(16, "1", 1, 360, "teeth in one turn", whole=True)
    resolution: float = parameter(1e-6, "s", 1e-9, 1e-3, "tick of the timer")
