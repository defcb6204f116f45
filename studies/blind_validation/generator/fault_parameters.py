"""Parameters of the hidden effects on the motion; each default means that the effect is absent."""

from math import inf
from typing import NamedTuple


class MotionFaults(NamedTuple):
    """Parameters of all effects on the motion, SI; the defaults mean absence.

    Those from `rider_share` on are not in the library.
    """

    rate_limit: float = inf  # 1/s, of the plate
    acceleration_limit: float = inf  # 1/s^2
    stall_acceleration: float = inf  # 1/s^2, of the motor at rest
    no_load_speed: float = 12.0  # 1/s, where the motor has no torque to accelerate
    stiction: float = 0.0  # opening, error that keeps the plate sliding
    breakaway: float = 1.5  # over sliding friction
    stribeck: float = 0.1  # 1/s
    play: float = 0.0  # opening, between motor and plate
    knee: float = 0.0  # opening spring over the servo's stiffness
    home: float = 0.07  # opening at which the springs meet
    air_delay: float = 0.0  # s
    crank_turns: float = 0.0
    asymmetry: float = 0.0  # of the filling time when emptying
    runner_share: float = 0.0
    runner_frequency: float = 220.0  # rad/s
    runner_damping: float = 0.15
    film_share: float = 0.0
    film_time: float = 0.2  # s
    pumping: float = 0.0  # N m at 1000 rad/s behind a closed plate
    pumping_opening: float = 0.03
    thin_air: float = 0.0  # relative departure of the pressure
    warming: float = 0.0  # K, of the air box
    spark_curvature: float = 0.0  # 1/rad^2
    spark_clip: float = inf  # rad
    dip: float = 0.0  # N m
    dip_centre: float = 1410.0  # rad/s
    dip_width: float = 73.0  # rad/s
    firing: float = 0.0  # swing over mean torque
    firing_spread: float = 0.0
    compression: float = 0.0  # N m
    polygon: float = 0.0  # relative swing of the chain's speed
    sprocket: float = 42.0  # teeth
    slack: float = 0.0  # rad, whole gap at the wheel
    hardening: float = 0.0  # 1/rad^2
    worn_clutch: float = inf  # N m at the crank
    back_torque: float = inf  # N m at the crank
    loss: float = 0.0  # share of the torque
    growth: float = 0.0  # s^2/m^2, rear
    front_growth: float = 0.0
    height: float = 0.0  # of the centre of gravity over the wheelbase
    settling: float = 0.02  # s
    squat: float = 0.0
    squat_frequency: float = 19.0  # rad/s
    squat_damping: float = 0.3
    heat_sensitivity: float = 0.0  # 1/K
    heating: float = 0.05  # K/W
    cooling: float = 30.0  # s
    wear: float = 0.0  # 1/m
    relaxation: float = 0.0  # m
    wet: float = 0.0  # loss of grip
    wet_place: float = 50.0  # m
    wet_length: float = 20.0  # m
    slope: float = 0.0
    slope_place: float = 50.0
    slope_length: float = 200.0
    head_wind: float = 0.0  # m/s
    gust: float = 0.0  # m/s
    gust_period: float = 8.0  # s
    aside: float = 0.0  # rad, of the optical sensor
    aside_pitch: float = 0.0  # rad s^2/m
    optical_error: float = 0.0
    optical_lag: float = 0.0  # s
    rider_share: float = 0.0  # of the mass, sprung on its arms
    rider_frequency: float = 16.0  # rad/s
    rider_damping: float = 0.25
    air_play: float = 0.0  # opening, hysteresis between plate and air
    derate: float = 0.0  # share of the torque at full heat
    derate_time: float = 3.0  # s
    sign_stiffness: float = 0.0  # more slip stiffness when braking
    ripple: float = 0.0  # N m, periodic with the opening
    ripple_period: float = 0.03  # opening
    spark_lag: float = 0.0  # s
    servo_gain: float = 0.0  # relative growth of the servo's stiffness per opening
    run_out: float = 0.0  # N, force of the tyre once a turn
    cush_friction: float = 0.0  # N m, dry
    soft_centre: float = 0.0  # share of the cush's stiffness that is absent near zero torque
    soft_twist: float = 0.015  # rad
    dead_band: float = 0.0  # opening, error that the servo ignores
    cogging: float = 0.0  # opening, amplitude of the detents of the servo motor
    cogging_period: float = 0.03  # opening
    cold_drag: float = 0.0  # N m at the crank, of cold oil
    oil_time: float = 4.0  # s
    torque_drift: float = 0.0  # relative, of the torque per 10 s
    ram_air: float = 0.0  # relative growth of the torque at 50 m/s
    torque_waves: float = 0.0  # N m, periodic with the crank speed
    waves_period: float = 180.0  # rad/s
    stiffness_by_speed: float = 0.0  # relative growth of the slip stiffness from 40 to 80 m/s
    brake_drag: float = 0.0  # N m at the rear wheel, of pads that retract
    brake_way: float = 150.0  # m
    tuck: float = 0.0  # relative change of the drag area as the rider crouches
    tuck_time: float = 3.0  # s
    patch: float = 0.0  # scale error of the optical sensor on a section of road
    patch_place: float = 100.0  # m
    patch_length: float = 80.0  # m
