"""Equations of motion of the true motorcycle: rates of its states, from the servo to the road.

Written from the textbook's equations. Effects that the vehicle file leaves out stand where they act
and vanish with their numbers (`MotionFaults`). Dry friction of the throttle shaft is LuGre's bristle
(Canudas de Wit et al., IEEE TAC 40, 1995); the gap of the driveline cannot pull; a tyre relaxes in
its slip, not in its force (Pacejka 2012, chapter 7); friction in the rubber is Dahl's.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from slipbench.studies.blind_validation.generator.fault_parameters import MotionFaults
from slipbench.studies.blind_validation.generator.machine import Machine
from slipbench.studies.blind_validation.generator.tyres import force

Floats = NDArray[np.float64]

(
    PLATE,
    PLATE_RATE,
    BRISTLE,
    AIR,
    FILM,
    RUNNER,
    RUNNER_RATE,
    SPARK,
    HEAT,
    CRANK_SPEED,
    CRANK,
    TWIST,
    RUBBER,
    WHEEL_SPEED,
    WHEEL,
    SPEED,
    WAY,
    FRONT,
    SLIP,
    FELT,
    SQUAT,
    SQUAT_RATE,
    WARMTH,
    SEEN,
    RIDER,
    RIDER_RATE,
) = range(26)
STATES = 26
COMMAND, SPARK_COMMAND, DELAYED, WIND, SHOVE, BUMP, SCATTER = range(7)
"""Inputs at an instant: commands, delayed throttle, m/s, N, relative load, relative torque."""
G = 9.80665
BRISTLE_BEND = 2e-4  # opening, at which a bristle of the throttle shaft lets go
FASTEST_BRISTLE = 8e3  # 1/s; faster ones are stiffer than the steps of integration bear
RUBBER_BEND = 3e-3  # rad, at which the dry friction of the rubber is developed


@njit(cache=True, error_model="numpy")
def limited(value: float, low: float, high: float) -> float:
    """Value, limited to a range."""
    return min(max(value, low), high)


@njit(cache=True, error_model="numpy")
def servo(x: Floats, dx: Floats, command: float, m: Machine, e: MotionFaults) -> None:
    """Write the rates of throttle plate and friction bristles into dx. x, dx: SI, (STATES,)."""
    position, rate = x[PLATE], x[PLATE_RATE]
    stiffness = m.servo_frequency**2
    error = command - position
    error -= limited(error, -e.dead_band, e.dead_band)
    push = stiffness * (1.0 + e.servo_gain * (position - 0.1)) * error
    if e.cogging > 0.0:
        push += stiffness * e.cogging * math.sin(2.0 * math.pi * position / e.cogging_period)
    push += -2.0 * m.servo_damping * m.servo_frequency * rate
    push += stiffness * e.knee * max(e.home - position, 0.0)
    dx[BRISTLE] = 0.0
    if e.stiction > 0.0:
        sliding = stiffness * e.stiction
        level = sliding * (1.0 + (e.breakaway - 1.0) * math.exp(-((rate / e.stribeck) ** 2)))
        bend = sliding / BRISTLE_BEND
        settling = min(abs(rate) * bend / level, FASTEST_BRISTLE)
        dx[BRISTLE] = settling * (math.copysign(level / bend, rate) - x[BRISTLE])
        push -= bend * x[BRISTLE] + math.sqrt(bend) * dx[BRISTLE]
    push = limited(push, -e.acceleration_limit, e.acceleration_limit)
    if e.stall_acceleration < math.inf:
        share = rate / e.no_load_speed
        most, least = max(1.0 - share, 0.02), max(1.0 + share, 0.02)
        push = limited(push, -e.stall_acceleration * least, e.stall_acceleration * most)
    if abs(rate) >= e.rate_limit and push * rate > 0.0:
        push = -500.0 * (rate - math.copysign(e.rate_limit, rate))
    dx[PLATE], dx[PLATE_RATE] = limited(rate, -e.rate_limit, e.rate_limit), push


@njit(cache=True, error_model="numpy")
def charge_of(x: Floats, dx: Floats, arriving: float, m: Machine, e: MotionFaults) -> float:
    """Charge of the cylinders as an equivalent opening, 1; writes the rates of manifold, film, runner.

    x, dx: states and rates, SI, (STATES,). arriving: delayed throttle opening, 1.
    """
    air = x[AIR]
    filling = m.filling_time
    if e.asymmetry > 0.0:
        filling *= 1.0 + e.asymmetry * 0.5 * (1.0 + math.tanh((air - arriving) / 5e-4))
    dx[AIR] = (arriving - air) / filling
    w = e.runner_frequency
    dx[RUNNER] = x[RUNNER_RATE]
    dx[RUNNER_RATE] = w * w * (air - x[RUNNER]) - 2.0 * e.runner_damping * w * x[RUNNER_RATE]
    drawn = air + e.runner_share * (x[RUNNER] - air)
    dx[FILM] = (drawn - x[FILM]) / e.film_time
    return float(drawn - e.film_share * (drawn - x[FILM]))


@njit(cache=True, error_model="numpy")
def spark_factor(x: Floats, dx: Floats, command: float, m: Machine, e: MotionFaults) -> float:
    """Torque factor of the spark, 1: linear, or a limited parabola. command: rad; x, dx: (STATES,)."""
    advance = limited(command, -e.spark_clip, e.spark_clip)
    dx[SPARK] = 0.0
    if e.spark_lag > 0.0:
        dx[SPARK] = (advance - x[SPARK]) / e.spark_lag
        advance = x[SPARK]
    return 1.0 + m.spark_gain * advance - e.spark_curvature * advance * advance


@njit(cache=True, error_model="numpy")
def crank_torque(
    t: float, x: Floats, dx: Floats, charge: float, u: Floats, m: Machine, e: MotionFaults
) -> float:
    """Torque of gas, friction and pistons at the crank, N m. x, dx: SI, (STATES,)."""
    w, angle, opening = x[CRANK_SPEED], x[CRANK], max(charge, 0.0)
    friction = m.friction + m.friction_rise * w
    if e.pumping > 0.0:
        friction += e.pumping * 1e-3 * w * math.exp(-opening / e.pumping_opening)
    if e.cold_drag > 0.0:
        friction += e.cold_drag * math.exp(-max(t, 0.0) / e.oil_time)
    full = m.peak_torque / (1.0 + ((w - m.peak_speed) / m.torque_width) ** 2)
    full *= 1.0 + e.thin_air + 0.1 * e.torque_drift * max(t, 0.0)
    full *= 1.0 + e.ram_air * (x[SPEED] / 50.0) ** 2
    if e.warming > 0.0:
        full *= math.sqrt(298.15 / (298.15 + e.warming * (1.0 - math.exp(-t / 60.0))))
    gas = (full + friction) * (1.0 - math.exp(-opening / m.opening_scale))
    dx[HEAT] = (gas * w / 6e4 - x[HEAT]) / e.derate_time
    gas *= 1.0 - e.derate * x[HEAT]
    torque = m.torque_scale * (gas - friction) * spark_factor(x, dx, u[SPARK_COMMAND], m, e)
    torque += gas * u[SCATTER]
    if e.firing > 0.0 or e.firing_spread > 0.0:
        pulses = math.sin(2.0 * angle) + 0.25 * math.sin(4.0 * angle + 0.7)
        torque += gas * (e.firing * pulses + e.firing_spread * math.sin(0.5 * angle + 0.4))
    if e.compression > 0.0:
        torque -= e.compression * (math.sin(2.0 * angle) + 0.15 * math.sin(4.0 * angle))
    if e.dip > 0.0:
        torque -= e.dip / math.cosh((w - e.dip_centre) / (1.336 * e.dip_width)) ** 2
    if e.ripple > 0.0:
        torque += e.ripple * math.sin(2.0 * math.pi * opening / e.ripple_period)
    if e.torque_waves > 0.0:
        torque += e.torque_waves * math.sin(2.0 * math.pi * w / e.waves_period)
    return float(torque)


@njit(cache=True, error_model="numpy")
def chain_torque(x: Floats, dx: Floats, m: Machine, e: MotionFaults) -> float:
    """Torque of chain, cush and clutch at the wheel [N m]; winds the spring."""
    twist, rate = x[TWIST], x[CRANK_SPEED] / m.ratio - x[WHEEL_SPEED]
    felt, felt_rate = twist, rate
    if e.soft_centre > 0.0:
        felt -= e.soft_centre * e.soft_twist * math.tanh(twist / e.soft_twist)
    if e.polygon > 0.0:
        angle = e.sprocket * x[WHEEL] + 0.9
        felt += e.polygon / e.sprocket * math.sin(angle)
        felt_rate += e.polygon * x[WHEEL_SPEED] * math.cos(angle)
    if e.slack > 0.0:
        half = 0.5 * e.slack
        beyond = max(felt - half, 0.0) + min(felt + half, 0.0)
        torque = m.stiffness * beyond * (1.0 + e.hardening * beyond * beyond)
        if beyond > 0.0:
            torque = max(torque + m.damping * felt_rate, 0.0)
        if beyond < 0.0:
            torque = min(torque + m.damping * felt_rate, 0.0)
    else:
        torque = m.stiffness * felt * (1.0 + e.hardening * felt * felt) + m.damping * felt_rate
    dx[RUBBER] = 0.0
    if e.cush_friction > 0.0:
        dx[RUBBER] = (felt_rate - abs(felt_rate) * x[RUBBER]) / RUBBER_BEND
        torque += e.cush_friction * x[RUBBER]
    capacity = min(m.clutch, e.worn_clutch) * m.ratio
    passed = limited(torque, -min(capacity, e.back_torque * m.ratio), capacity)
    dx[TWIST] = rate + (passed - torque) / m.damping
    return passed


@njit(cache=True, error_model="numpy")
def section(way: float, place: float, length: float, rounding: float) -> float:
    """1 on a section of road, 0 elsewhere, with rounded ends. way, place, length, rounding: m."""
    begun = 1.0 / (1.0 + math.exp(-limited(2.0 * (way - place) / rounding, -40.0, 40.0)))
    ended = 1.0 / (1.0 + math.exp(-limited(2.0 * (way - place - length) / rounding, -40.0, 40.0)))
    return begun - ended


@njit(cache=True, error_model="numpy")
def tyre_force(
    x: Floats, dx: Floats, radius: float, bump: float, formula: int, m: Machine, e: MotionFaults
) -> float:
    """Force of the rear tyre, N; writes the rates of its states. x, dx: SI, (STATES,)."""
    v = max(abs(x[SPEED]), 3.0)
    s = (x[WHEEL_SPEED] * radius - x[SPEED]) / v
    dx[SLIP] = 0.0
    if e.relaxation > 0.0:
        dx[SLIP] = v / e.relaxation * (s - x[SLIP])
        s = x[SLIP]
    load = m.load * (1.0 + bump) + m.mass * e.height * x[FELT]
    load = limited(load + e.squat * x[SQUAT_RATE] / e.squat_frequency, 50.0, m.mass * G)
    grip = m.grip * max(1.0 + e.heat_sensitivity * x[WARMTH], 0.3) * (1.0 - e.wear * x[WAY])
    if e.wet > 0.0:
        grip *= 1.0 - e.wet * section(x[WAY], e.wet_place, e.wet_length, 1.0)
    stiffness = m.slip_stiffness * load / m.load
    stiffness *= max(1.0 + e.stiffness_by_speed * (x[SPEED] - 40.0) / 40.0, 0.3)
    if s < 0.0:
        stiffness *= 1.0 + e.sign_stiffness
    passed = force(formula, s, stiffness, grip * load, m.shape)
    dx[WARMTH] = (e.heating * abs(passed * s * x[SPEED]) - x[WARMTH]) / e.cooling
    w = e.squat_frequency
    dx[SQUAT] = x[SQUAT_RATE]
    dx[SQUAT_RATE] = w * w * (passed - x[SQUAT]) - 2.0 * e.squat_damping * w * x[SQUAT_RATE]
    return passed


@njit(cache=True, error_model="numpy")
def body(
    t: float, x: Floats, dx: Floats, driving: float, u: Floats, m: Machine, e: MotionFaults
) -> None:
    """Write the rates of motorcycle and rider along the road. driving: N; x, dx: SI, (STATES,)."""
    v = x[SPEED]
    through = v + u[WIND] + e.head_wind
    if e.gust > 0.0:
        through += e.gust * math.sin(2.0 * math.pi * t / e.gust_period)
    crouch = 1.0
    if e.tuck != 0.0:
        crouch += e.tuck * (1.0 - math.exp(-max(t, 0.0) / e.tuck_time))
    drag = 0.5 * m.air_density * m.drag_area * crouch * through * abs(through)
    resistance = m.rolling_resistance
    if e.slope != 0.0:
        resistance += e.slope * section(x[WAY], e.slope_place, e.slope_length, 10.0)
    resisting = drag + m.mass * G * resistance
    push = driving - resisting + u[SHOVE]
    a = push / m.mass
    dx[RIDER], dx[RIDER_RATE] = x[RIDER_RATE], 0.0
    if e.rider_share > 0.0:
        w = e.rider_frequency
        pull = w * w * x[RIDER] + 2.0 * e.rider_damping * w * x[RIDER_RATE]
        a = (push / m.mass + e.rider_share * pull) / (1.0 - e.rider_share)
        dx[RIDER_RATE] = -pull - a
    dx[SPEED], dx[WAY] = a, v
    dx[FELT] = (a - x[FELT]) / e.settling
    dx[FRONT] = v / (m.front_radius * (1.0 + e.front_growth * v * v))


@njit(cache=True, error_model="numpy")
def optical_speed(x: Floats, a: float, e: MotionFaults) -> float:
    """Speed at the optical sensor before its own lag, m/s. a: m/s²; x: SI, (STATES,)."""
    scale = 1.0 + e.optical_error
    if e.patch != 0.0:
        scale += e.patch * section(x[WAY], e.patch_place, e.patch_length, 5.0)
    return float(x[SPEED]) * scale * math.cos(e.aside + e.aside_pitch * a)


@njit(cache=True, error_model="numpy")
def rates(
    t: float, x: Floats, dx: Floats, u: Floats, formula: int, m: Machine, e: MotionFaults
) -> None:
    """Write the rates of all states into dx. t: s; x, dx: SI, (STATES,); u: inputs, SI, (7,)."""
    servo(x, dx, u[COMMAND], m, e)
    charge = charge_of(x, dx, u[DELAYED], m, e)
    torque = crank_torque(t, x, dx, charge, u, m, e)
    passed = chain_torque(x, dx, m, e)
    arriving = passed - e.loss * abs(passed)
    radius = m.radius * (1.0 + e.growth * x[SPEED] ** 2)
    driving = tyre_force(x, dx, radius, u[BUMP], formula, m, e)
    dx[CRANK_SPEED], dx[CRANK] = (torque - passed / m.ratio) / m.crank_inertia, x[CRANK_SPEED]
    shake = 0.0
    if e.run_out > 0.0:
        shake += e.run_out * radius * math.sin(x[WHEEL])
    if e.brake_drag > 0.0:
        shake -= e.brake_drag * math.exp(-x[WAY] / e.brake_way)
    turning = arriving - radius * driving - m.rolling + shake
    dx[WHEEL_SPEED], dx[WHEEL] = turning / m.wheel_inertia, x[WHEEL_SPEED]
    body(t, x, dx, driving, u, m, e)
    dx[SEEN] = 0.0
    if e.optical_lag > 0.0:
        dx[SEEN] = (optical_speed(x, dx[SPEED], e) - x[SEEN]) / e.optical_lag
