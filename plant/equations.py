"""The nominal motorcycle: equations in the order in which cause runs from the servo to the road.

Every equation is a plain function of named quantities and gives the quantity of its own name. Its
arguments are states (`RATES`), inputs, `time`, `step`, nominal parameters as `<block>_<field>`, and
what earlier equations gave. Every equation is also a seam: the effects that act there are applied
right after it.

The servo, intake lag, driveline and Pacejka tyre are the textbook forms that Corno and Savaresi
(SYSID 2009) and Pacejka, "Tire and Vehicle Dynamics", ch. 4, use; SI throughout.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray


def servo_velocity(throttle_rate: float) -> float:
    """Velocity of the plate [1/s]: the servo's own rate."""
    return throttle_rate


def servo_acceleration(
    throttle: float,
    throttle_rate: float,
    throttle_command: float,
    throttle_servo_natural_frequency: float,
    throttle_servo_damping: float,
) -> float:
    """th'' = w^2 (th_c - th) - 2 z w th' [1/s^2]; th_c: the command, d_c ago."""
    w = throttle_servo_natural_frequency
    return w * (w * (throttle_command - throttle) - 2.0 * throttle_servo_damping * throttle_rate)


def air_delay(intake_delay: float) -> float:
    """Delay of the air path [s]."""
    return intake_delay


def arriving(
    throttle: float,
    air_delay: float,
    stage: float,
    step: float,
    count: int,
    history: NDArray[np.float64],
    history_rate: NDArray[np.float64],
) -> float:
    """Throttle opening (0..1) one air delay (s) ago: the cubic through past positions and rates.

    The present is `stage` steps after kept sample `count`. Delays shorter than that lie in the
    step under way and use its own throttle. Without any history there is no delay.
    """
    capacity = len(history)
    if capacity == 0:
        return throttle
    back = max(stage - air_delay / step, 2.0 - capacity)
    i = count & (capacity - 1)
    if back >= 0.0:
        if stage == 0.0:
            return throttle
        curve = throttle - history[i] - history_rate[i] * step * stage
        return float(history[i] + history_rate[i] * step * back + curve * (back / stage) ** 2)
    whole = math.floor(back)
    f = back - whole
    i = (count + whole) & (capacity - 1)
    j = (i + 1) & (capacity - 1)
    rise = history[j] - history[i]
    bend = (1.0 - f) * (history_rate[i] * step - rise) - f * (history_rate[j] * step - rise)
    return float(history[i] + f * rise + f * (1.0 - f) * bend)


def filling_time(intake_filling_time: float) -> float:
    """Time constant of the manifold [s]."""
    return intake_filling_time


def air_rate(arriving: float, air: float, filling_time: float) -> float:
    """air' = (arriving - air) / tau_m [1/s]; arriving: the throttle, one delay ago."""
    return (arriving - air) / filling_time


def charge(air: float) -> float:
    """Air that the cylinder gets, as the opening that would give it in steady state."""
    return air


def friction_torque(
    engine_speed: float, engine_friction: float, engine_friction_rise: float
) -> float:
    """T_f = T_0 + T_1 w [N m], fading to zero below 10 rad/s so that the crank can stop."""
    direction = min(max(0.1 * engine_speed, -1.0), 1.0)
    return direction * (engine_friction + engine_friction_rise * abs(engine_speed))


def full_torque(
    engine_speed: float,
    engine_peak_torque: float,
    engine_peak_speed: float,
    engine_torque_width: float,
) -> float:
    """T_full = T_p / (1 + ((w - w_p) / W)^2) [N m]."""
    x = (engine_speed - engine_peak_speed) / engine_torque_width
    return engine_peak_torque / (1.0 + x * x)


def spark_factor(spark: float, engine_spark_gain: float) -> float:
    """1 + s_1 dalpha; dalpha: the spark offset [rad], d_a ago."""
    return 1.0 + engine_spark_gain * spark


def engine_torque(
    charge: float,
    friction_torque: float,
    full_torque: float,
    spark_factor: float,
    engine_opening_scale: float,
    engine_torque_scale: float,
    engine_disturbance: float,
) -> float:
    """T = s_T (-T_f + (T_full + T_f)(1 - exp(-air / th_0))) (1 + s_1 dalpha) [N m]."""
    filled = 1.0 - math.exp(-max(charge, 0.0) / engine_opening_scale)
    torque = -friction_torque + (full_torque + friction_torque) * filled
    return engine_torque_scale * torque * spark_factor + engine_disturbance


def spring_motion(
    twist: float, engine_speed: float, rear_speed: float, gear_ratio: float
) -> tuple[float, float]:
    """Twist phi [rad] and its rate w_e / N - w_r [rad/s] while the clutch holds."""
    return twist, engine_speed / gear_ratio - rear_speed


def spring_torque(spring_twist: float, driveline_stiffness: float) -> float:
    """Elastic torque k phi [N m]."""
    return driveline_stiffness * spring_twist


def damping_torque(spring_rate: float, driveline_damping: float) -> float:
    """Viscous torque c phi' [N m]."""
    return driveline_damping * spring_rate


def clutch_capacity(driveline_clutch_capacity: float, clutch: float, gear_ratio: float) -> float:
    """Greatest torque that the clutch passes, referred to the wheel [N m]."""
    return clutch * driveline_clutch_capacity * gear_ratio


def driveline_torque(spring_torque: float, damping_torque: float, clutch_capacity: float) -> float:
    """T_d = k phi + c phi' [N m], or the clutch's capacity where that is less."""
    return min(max(spring_torque + damping_torque, -clutch_capacity), clutch_capacity)


def twist_velocity(
    driveline_torque: float,
    spring_torque: float,
    spring_twist: float,
    damping_torque: float,
    engine_speed: float,
    rear_speed: float,
    gear_ratio: float,
    driveline_damping: float,
    driveline_stiffness: float,
    step: float,
) -> float:
    """phi' [rad/s]: w_e / N - w_r while the clutch holds, less what a slipping clutch lets go.

    A slipping clutch unwinds the spring at k / c, but never faster than the step can follow; of a
    spring that hardens with phi^2 the slope counts.
    """
    excess = spring_torque + damping_torque - driveline_torque
    slope = 3.0 * spring_torque / (spring_twist or 1.0) - 2.0 * driveline_stiffness
    viscosity = max(driveline_damping, 0.5 * max(driveline_stiffness, slope) * step)
    return engine_speed / gear_ratio - rear_speed - excess / viscosity


def wheel_torque(driveline_torque: float) -> float:
    """Torque that arrives at the rear wheel [N m]: nothing is lost on the way."""
    return driveline_torque


def engine_acceleration(
    engine_torque: float, driveline_torque: float, gear_ratio: float, engine_inertia: float
) -> float:
    """J_e w_e' = T - T_d / N [rad/s^2]."""
    return (engine_torque - driveline_torque / gear_ratio) / engine_inertia


def crank_velocity(
    engine_speed: float, rear_speed: float, kept_rear_speed: float, gear_ratio: float
) -> float:
    """psi' [rad/s]: w_e, less what the rear wheel turns faster than it is to be kept to."""
    if math.isnan(kept_rear_speed):
        return engine_speed
    return engine_speed - gear_ratio * (rear_speed - kept_rear_speed)


def rear_radius(rear_wheel_radius: float) -> float:
    """Rolling radius of the rear tyre [m]."""
    return rear_wheel_radius


def rear_load(tyre_load: float, load: float) -> float:
    """Vertical load on the rear tyre [N]."""
    return tyre_load * load


def rear_grip(tyre_friction: float, grip: float) -> float:
    """Friction coefficient at the peak of the tyre's curve."""
    return tyre_friction * grip


def slip(rear_speed: float, rear_radius: float, speed: float, tyre_low_speed: float) -> float:
    """lambda = (w_r r - v) / v; below the low speed, over that speed instead of v."""
    return (rear_speed * rear_radius - speed) / max(abs(speed), tyre_low_speed)


def tyre_force(
    slip: float,
    rear_grip: float,
    rear_load: float,
    tyre_load: float,
    tyre_slip_stiffness: float,
    tyre_shape: float,
    tyre_form_1: float,
    tyre_form_2: float,
    tyre_form_3: float,
    tyre_form_4: float,
    tyre_form_5: float,
    tyre_form_6: float,
    tyre_form_7: float,
    tyre_form_8: float,
    tyre_form_9: float,
) -> float:
    """F_x = D sin(C atan(B lambda)) [N]; D = mu F_z, B C D = C_kappa (Pacejka).

    Grip moves the peak alone; load moves peak and slope. Between their places, departures from the
    formula are cubics with the slopes of central differences (Catmull and Rom, "A class of local
    interpolating splines", 1974): where the force has a corner, its place is hard to calibrate.
    """
    peak = max(rear_grip * rear_load, 1e-3)
    B = tyre_slip_stiffness * rear_load / (tyre_load * tyre_shape * peak)
    force = peak * math.sin(tyre_shape * math.atan(B * slip))
    eighths = 8.0 * B * tyre_shape * abs(slip)
    place = math.floor(eighths)
    way, far = eighths - place, 0.25 * (tyre_form_9 - tyre_form_8)
    if place < 1.0:
        before, start, end, after = -tyre_form_1, 0.0, tyre_form_1, tyre_form_2
    elif place < 2.0:
        before, start, end, after = 0.0, tyre_form_1, tyre_form_2, tyre_form_3
    elif place < 3.0:
        before, start, end, after = tyre_form_1, tyre_form_2, tyre_form_3, tyre_form_4
    elif place < 4.0:
        before, start, end, after = tyre_form_2, tyre_form_3, tyre_form_4, tyre_form_5
    elif place < 5.0:
        before, start, end, after = tyre_form_3, tyre_form_4, tyre_form_5, tyre_form_6
    elif place < 6.0:
        before, start, end, after = tyre_form_4, tyre_form_5, tyre_form_6, tyre_form_7
    elif place < 7.0:
        before, start, end, after = tyre_form_5, tyre_form_6, tyre_form_7, tyre_form_8
    elif place < 8.0:
        before, start, end, after = tyre_form_6, tyre_form_7, tyre_form_8, tyre_form_8 + far
    else:
        before = tyre_form_7 if place < 9.0 else tyre_form_8 + far * min(place - 9.0, 4.0)
        start = tyre_form_8 + far * min(place - 8.0, 4.0)
        end = tyre_form_8 + far * min(place - 7.0, 4.0)
        after = tyre_form_8 + far * min(place - 6.0, 4.0)
    slope, last, rise = 0.5 * (end - before), 0.5 * (after - start), end - start
    bend = 3.0 * rise - 2.0 * slope - last
    form = start + way * (slope + way * (bend + way * (slope + last - 2.0 * rise)))
    force += peak * (form if slip > 0.0 else -form)
    return force


def rear_acceleration(
    wheel_torque: float,
    tyre_force: float,
    rear_radius: float,
    rear_speed: float,
    rear_brake: float,
    rear_wheel_rolling_torque: float,
    rear_wheel_inertia: float,
) -> float:
    """J_r w_r' = T - r F_x - rolling - brake [rad/s^2]; both drags fade below 1 rad/s."""
    drag = (rear_brake + rear_wheel_rolling_torque) * min(max(rear_speed, -1.0), 1.0)
    return (wheel_torque - rear_radius * tyre_force - drag) / rear_wheel_inertia


def front_radius(front_wheel_radius: float) -> float:
    """Rolling radius of the front tyre [m]."""
    return front_wheel_radius


def front_speed(speed: float, front_radius: float) -> float:
    """w_f = v / r_f [rad/s]: the front wheel rolls."""
    return speed / front_radius


def drag_force(
    speed: float,
    front_brake: float,
    front_radius: float,
    body_mass: float,
    body_rolling_resistance: float,
    body_drag_area: float,
    body_air_density: float,
) -> float:
    """rho/2 C_d A v^2 + m g f_r + brake / r_f [N], against the motion."""
    direction = min(max(4.0 * speed, -1.0), 1.0)
    contact = body_mass * 9.80665 * body_rolling_resistance + front_brake / front_radius
    return 0.5 * body_air_density * body_drag_area * speed * abs(speed) + contact * direction


def acceleration(
    tyre_force: float, drag_force: float, road_force: float, body_mass: float
) -> float:
    """m v' = F_x - drag + road force [m/s^2]."""
    return (tyre_force - drag_force + road_force) / body_mass


def optical_speed(speed: float) -> float:
    """What the optical sensor sees [m/s]: the true speed."""
    return speed


EQUATIONS: tuple[Callable[..., Any], ...] = (
    servo_velocity,
    servo_acceleration,
    air_delay,
    arriving,
    filling_time,
    air_rate,
    charge,
    friction_torque,
    full_torque,
    spark_factor,
    engine_torque,
    spring_motion,
    spring_torque,
    damping_torque,
    clutch_capacity,
    driveline_torque,
    twist_velocity,
    wheel_torque,
    engine_acceleration,
    crank_velocity,
    rear_radius,
    rear_load,
    rear_grip,
    slip,
    tyre_force,
    rear_acceleration,
    front_radius,
    front_speed,
    drag_force,
    acceleration,
    optical_speed,
)
"""In the order of evaluation. The name of an equation is its seam, and what it gives."""

GIVES_SEVERAL = {"spring_motion": ("spring_twist", "spring_rate")}
"""The seams that give something else than one quantity of their own name."""

RATES = {
    "throttle": "servo_velocity",
    "throttle_rate": "servo_acceleration",
    "air": "air_rate",
    "engine_speed": "engine_acceleration",
    "twist": "twist_velocity",
    "rear_speed": "rear_acceleration",
    "speed": "acceleration",
    "crank_angle": "crank_velocity",
    "rear_angle": "rear_speed",
    "front_angle": "front_speed",
    "distance": "speed",
}
"""Each state of the motorcycle and the quantity that is its rate."""
