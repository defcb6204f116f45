"""Types of hidden effects: those that the library has, and those of which it has none.

A kind of the library has the library's name and the library's names of parameters, so
that verdicts can be compared with it; the formulas are those of `physics` and `instruments`. What
the kinds of `outside` do is in no library. Sizes: the smallest of interest and the typical one of
the table of effects. Frames that are held are renewed at random intervals around the stated one.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from slipbench.studies.blind_validation.generator.fault_type import (
    DRIVE,
    ENGINE,
    ENGINE_SPEED,
    FRONT_TEETH,
    OPTICAL,
    REAR_TEETH,
    ROAD,
    SERVO,
    TYRE,
    WHEEL,
    WHOLE,
    FaultType,
    one_size,
)
from slipbench.studies.blind_validation.generator.outside import OUTSIDE

LIBRARY: tuple[FaultType, ...] = (
    one_size("rate_limit", (SERVO,), 12.0, 6.0, parameter="limit", to="rate_limit", needs=True),
    one_size(
        "acceleration_limit",
        (SERVO,),
        400.0,
        250.0,
        parameter="limit",
        to="acceleration_limit",
        needs=True,
    ),
    one_size(
        "voltage_limit",
        (SERVO,),
        600.0,
        300.0,
        parameter="stall_acceleration",
        to="stall_acceleration",
        shapes={"no_load_speed": ("no_load_speed", 8.0, 20.0)},
        needs=True,
    ),
    one_size(
        "throttle_stiction",
        (SERVO,),
        1e-3,
        4e-3,
        parameter="width",
        to="stiction",
        shapes={"breakaway": ("breakaway", 1.2, 1.8)},
        memory=True,
    ),
    one_size("gear_play", (SERVO,), 1e-3, 3e-3, parameter="play", to="play", memory=True),
    one_size(
        "spring_knee",
        (SERVO,),
        0.1,
        0.5,
        parameter="stiffness",
        to="knee",
        shapes={"home": ("home", 0.05, 0.08)},
    ),
    one_size(
        "air_box_delay",
        (ENGINE,),
        1e-3,
        5e-3,
        parameter="delay",
        to="air_delay",
        like=(),
        memory=True,
    ),
    one_size(
        "crank_angle_delay",
        (ENGINE,),
        0.3,
        1.5,
        parameter="turns",
        to="crank_turns",
        like=(),
        memory=True,
    ),
    one_size(
        "asymmetric_filling",
        (ENGINE,),
        0.15,
        0.6,
        parameter="asymmetry",
        to="asymmetry",
        memory=True,
    ),
    one_size(
        "runner_resonance",
        (ENGINE,),
        0.15,
        0.6,
        parameter="share",
        to="runner_share",
        shapes={
            "frequency": ("runner_frequency", 160.0, 380.0),
            "damping": ("runner_damping", 0.1, 0.3),
        },
        memory=True,
    ),
    one_size(
        "fuel_film",
        (ENGINE,),
        0.05,
        0.2,
        parameter="share",
        to="film_share",
        shapes={"time": ("film_time", 0.1, 0.3)},
        memory=True,
    ),
    one_size(
        "closed_throttle_friction",
        (ENGINE,),
        1.5,
        6.0,
        parameter="pumping",
        to="pumping",
        shapes={"opening": ("pumping_opening", 0.02, 0.05)},
    ),
    one_size(
        "air_density",
        (ENGINE,),
        -0.015,
        -0.05,
        parameter="pressure",
        to="thin_air",
        quiet=True,
        like=(),
    ),
    one_size("spark_curvature", (ENGINE,), 0.3, 1.3, parameter="curvature", to="spark_curvature"),
    one_size("spark_clip", (ENGINE,), 0.14, 0.07, parameter="limit", to="spark_clip", needs=True),
    one_size(
        "torque_dip",
        (ENGINE,),
        1.5,
        5.0,
        parameter="depth",
        to="dip",
        like=(),
        shapes={"centre": ("dip_centre", 1100.0, 1420.0), "width": ("dip_width", 50.0, 100.0)},
    ),
    FaultType(
        "firing_torque",
        (ENGINE, ENGINE_SPEED),
        {"share": ("firing", 0.3, 1.0), "spread": ("firing_spread", 0.015, 0.05)},
        quiet=True,
        by_angle=True,
    ),
    one_size(
        "compression_torque",
        (ENGINE, ENGINE_SPEED),
        10.0,
        40.0,
        parameter="swing",
        to="compression",
        quiet=True,
        by_angle=True,
        like=(),
    ),
    one_size(
        "chain_polygon",
        (DRIVE,),
        1e-3,
        3e-3,
        parameter="ripple",
        to="polygon",
        quiet=True,
        by_angle=True,
        like=(),
    ),
    one_size("backlash", (DRIVE,), 2e-3, 8e-3, parameter="slack", to="slack", memory=True),
    one_size("hardening_cush", (DRIVE,), 30.0, 150.0, parameter="hardening", to="hardening"),
    one_size(
        "clutch_slip",
        (DRIVE, ENGINE),
        150.0,
        90.0,
        parameter="capacity",
        to="worn_clutch",
        needs=True,
    ),
    one_size(
        "slipper_clutch",
        (DRIVE, ENGINE),
        30.0,
        12.0,
        parameter="back_torque",
        to="back_torque",
        needs=True,
    ),
    one_size("driveline_loss", (DRIVE, WHEEL), 0.01, 0.04, parameter="loss", to="loss"),
    FaultType(
        "radius_growth",
        (TYRE, WHEEL, REAR_TEETH, FRONT_TEETH, OPTICAL),
        {"growth": ("growth", 2e-6, 1e-5), "front_growth": ("front_growth", 1e-6, 5e-6)},
        like=("growth", "front_growth"),
    ),
    one_size(
        "load_transfer",
        (TYRE,),
        0.1,
        0.44,
        parameter="height",
        to="height",
        shapes={"settling": ("settling", 0.015, 0.03)},
        memory=True,
    ),
    one_size(
        "squat",
        (TYRE,),
        0.08,
        0.3,
        parameter="share",
        to="squat",
        shapes={
            "frequency": ("squat_frequency", 13.0, 25.0),
            "damping": ("squat_damping", 0.2, 0.4),
        },
        memory=True,
    ),
    one_size(
        "grip_temperature",
        (TYRE,),
        -1e-3,
        -3e-3,
        parameter="sensitivity",
        to="heat_sensitivity",
        quiet=True,
        like=(),
        memory=True,
    ),
    one_size("grip_wear", (TYRE,), 5e-6, 2e-5, parameter="wear", to="wear", quiet=True, like=()),
    one_size(
        "relaxation_length", (TYRE,), 0.04, 0.15, parameter="length", to="relaxation", memory=True
    ),
    one_size(
        "wet_patch",
        (TYRE,),
        0.1,
        0.4,
        parameter="loss",
        to="wet",
        quiet=True,
        like=(),
        shapes={"place": ("wet_place", 60.0, 200.0), "length": ("wet_length", 15.0, 40.0)},
    ),
    one_size(
        "grade",
        (ROAD,),
        0.003,
        0.01,
        parameter="slope",
        to="slope",
        signed=True,
        quiet=True,
        like=(),
        shapes={"place": ("slope_place", 60.0, 150.0), "length": ("slope_length", 80.0, 250.0)},
    ),
    FaultType(
        "wind",
        (ROAD,),
        {"head_wind": ("head_wind", 1.0, 3.0), "gust": ("gust", 0.5, 1.5)},
        {"gust_period": ("gust_period", 4.0, 15.0)},
        quiet=True,
    ),
    FaultType(
        "mounting_angle",
        (OPTICAL,),
        {"angle": ("aside", 0.04, 0.1), "pitch": ("aside_pitch", 1e-3, 4e-3)},
    ),
    one_size(
        "optical_scale",
        (OPTICAL,),
        1.5e-3,
        5e-3,
        parameter="error",
        to="optical_error",
        signed=True,
    ),
    one_size(
        "optical_lag",
        (OPTICAL,),
        5e-3,
        20e-3,
        parameter="time_constant",
        to="optical_lag",
        memory=True,
    ),
    one_size(
        "tooth_misplacement",
        ("rear teeth", "front teeth"),
        2e-4,
        1e-3,
        parameter="displacement",
        to="displacement",
        signed=True,
        shapes={"tooth": ("tooth", 0, 15)},
        subjects=("rear_encoder", "front_encoder"),
    ),
    one_size(
        "eccentricity",
        ("rear teeth", "front teeth"),
        1e-3,
        5e-3,
        parameter="run_out",
        to="run_out",
        shapes={"phase": ("phase", -3.1, 3.1)},
        subjects=("rear_encoder", "front_encoder"),
    ),
    one_size(
        "channel_latency",
        (),
        1.5e-3,
        5e-3,
        parameter="latency",
        to="latency",
        like=(),
        subjects=("optical_speed", "engine_speed", "throttle_position"),
        memory=True,
    ),
    one_size(
        "channel_lag",
        (),
        4e-3,
        20e-3,
        parameter="time_constant",
        to="lag",
        subjects=("engine_speed", "throttle_position"),
        memory=True,
    ),
    one_size(
        "moving_average",
        (),
        10e-3,
        40e-3,
        parameter="window",
        to="window",
        subjects=("engine_speed", "optical_speed", "throttle_position"),
        memory=True,
    ),
    one_size(
        "channel_scale",
        (),
        5e-3,
        0.02,
        parameter="error",
        to="error",
        signed=True,
        like=(),
        subjects=("engine_speed", "throttle_position"),
    ),
    one_size(
        "quantiser", (), 1.5, 6.0, parameter="quantum", to="quantum", subjects=("engine_speed",)
    ),
    one_size(
        "held_frames",
        (),
        15e-3,
        30e-3,
        parameter="hold",
        to="hold",
        own={"jitter": ("jitter", 0.0, 0.4)},
        quiet=True,
        subjects=("engine_speed", "optical_speed", "throttle_position"),
        memory=True,
    ),
    one_size(
        "stale_frames",
        (),
        0.02,
        0.1,
        parameter="share",
        to="stale",
        quiet=True,
        subjects=("engine_speed", "optical_speed", "throttle_position"),
        memory=True,
    ),
)
"""Kinds that the library of effects has."""

BY_NAME: Mapping[str, FaultType] = {kind.name: kind for kind in (*LIBRARY, *OUTSIDE)}
SENSOR_OF: Mapping[str, tuple[str, ...]] = {
    "engine_speed": (ENGINE_SPEED,),
    "optical_speed": (OPTICAL,),
    # The measured throttle position drives the motion and is predicted by the servo alone.
    "throttle_position": (SERVO, "sensor of throttle position"),
    "rear_encoder": ("rear teeth", REAR_TEETH),
    "front_encoder": ("front teeth", FRONT_TEETH),
}


@dataclass(frozen=True)
class Hidden:
    """A hidden effect of a case. parameters: by the names of the library, SI."""

    kind: str
    grade: str
    subject: str
    parameters: Mapping[str, float]

    @property
    def key(self) -> str:
        """Name of the effect in a verdict."""
        return f"{self.kind}.{self.subject}" if self.subject else self.kind

    @property
    def places(self) -> tuple[str, ...]:
        """Injection points at which it acts."""
        return SENSOR_OF[self.subject] if self.subject else BY_NAME[self.kind].places


def draw_hidden(rng: np.random.Generator, kind: FaultType, grade: str) -> Hidden:
    """One hidden effect. grade: "moderate", about typical; "small", just above the relevance limit."""
    factor = float(rng.uniform(1.0, 1.5) if grade == "small" else rng.uniform(0.7, 1.5))
    sign = float(rng.choice((-1.0, 1.0))) if kind.signed else 1.0
    subject = str(rng.choice(kind.subjects)) if kind.subjects else ""
    parameters = {}
    for name, (_, small, typical) in kind.sizes.items():
        base = small if grade == "small" else typical
        grows = abs(typical) > abs(small)
        parameters[name] = sign * base * (factor if grows else 1 / factor)
    for name, (_, low, high) in (*kind.shapes.items(), *kind.own.items()):
        parameters[name] = (
            float(rng.integers(int(low), int(high) + 1))
            if name in WHOLE
            else float(rng.uniform(low, high))
        )
    return Hidden(kind.name, grade, subject, parameters)
