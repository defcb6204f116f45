"""True parameters of a motorcycle, SI; its vehicle file states them with errors."""

from typing import NamedTuple


class Machine(NamedTuple):
    """Numbers of the textbook's blocks, from the servo to the road.

    servo: w_s rad/s, z_s, d_c s. intake: tau_a, tau_m s. engine: J_e kg m^2, T_p N m at w_p rad/s
    with the half width W rad/s, friction T_0 N m + T_1 N m s/rad, th_0, scale s_T, spark s_1 1/rad
    after d_a s. driveline: k N m/rad, c N m s/rad, clutch N m at the crank. rear wheel: J_r, r,
    rolling N m. tyre: C N per slip, mu, F_z N, shape. body: m, C_d A, rho, f_r. front: r_f.
    ratio: crank turns per wheel turn in the gear of the ride.
    """

    servo_frequency: float
    servo_damping: float
    servo_delay: float
    air_delay: float
    filling_time: float
    crank_inertia: float
    peak_torque: float
    peak_speed: float
    torque_width: float
    friction: float
    friction_rise: float
    opening_scale: float
    torque_scale: float
    spark_gain: float
    spark_delay: float
    stiffness: float
    damping: float
    clutch: float
    wheel_inertia: float
    radius: float
    rolling: float
    slip_stiffness: float
    grip: float
    load: float
    shape: float
    mass: float
    drag_area: float
    air_density: float
    rolling_resistance: float
    front_radius: float
    ratio: float = 8.75
