"""Types of hidden effects: magnitudes, shapes, and the injection points at which they act.

A kind of the library bears the library's name and tells its parameters by the library's words, so
that verdicts can be compared with it; the formulas are those of `physics` and `instruments`. What
the last kinds do is in no library. Sizes: the smallest of interest and the typical one of the
table of effects.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

SERVO, ENGINE, DRIVE, TYRE = "servo force", "engine torque", "driveline torque", "tyre force"
WHEEL, ROAD = "wheel torque", "road force"
ENGINE_SPEED, OPTICAL = "sensor of engine speed", "sensor of optical speed"
REAR_TEETH, FRONT_TEETH = "sensor of rear teeth", "sensor of front teeth"

Size = tuple[str, float, float]
"""Field that it sets, smallest of interest, typical."""
Shape = tuple[str, float, float]
"""Field that it sets, lowest, highest."""
WHOLE = frozenset({"tooth"})


@dataclass(frozen=True)
class FaultType:
    """A fault type: an effect that can be hidden in a case.

    places: injection points; several where they are physically equivalent.
    sizes, shapes: by the library's parameter. subjects: channels or wheels that may have it.
    signed: of either sign. like: whose numbers the library's formula means as well, so that
    intervals can be compared. quiet: hidden from any usual trial, or left to chance; no part of
    pairs.
    needs: excitation without which it does not show at all (for cases that do not excite it).
    """

    name: str
    places: tuple[str, ...]
    sizes: Mapping[str, Size]
    shapes: Mapping[str, Shape] = field(default_factory=dict)
    subjects: tuple[str, ...] = ()
    signed: bool = False
    like: tuple[str, ...] = ()
    quiet: bool = False
    needs: bool = False
    inside: bool = True


def _of(
    name: str, places: tuple[str, ...], small: float, typical: float, **more: object
) -> FaultType:
    """Fault type with one magnitude; `parameter` and `to` name it in library and generator."""
    parameter, to = str(more.pop("parameter")), str(more.pop("to"))
    more.setdefault("like", (parameter,))
    return FaultType(name, places, {parameter: (to, small, typical)}, **more)  # type: ignore[arg-type]


LIBRARY: tuple[FaultType, ...] = (
    _of("rate_limit", (SERVO,), 12.0, 6.0, parameter="limit", to="rate_limit", needs=True),
    _of(
        "acceleration_limit",
        (SERVO,),
        400.0,
        250.0,
        parameter="limit",
        to="acceleration_limit",
        needs=True,
    ),
    _of(
        "voltage_limit",
        (SERVO,),
        600.0,
        300.0,
        parameter="stall_acceleration",
        to="stall_acceleration",
        shapes={"no_load_speed": ("no_load_speed", 8.0, 20.0)},
        needs=True,
    ),
    _of(
        "throttle_stiction",
        (SERVO,),
        1e-3,
        4e-3,
        parameter="width",
        to="stiction",
        shapes={"breakaway": ("breakaway", 1.2, 1.8)},
    ),
    _of("gear_play", (SERVO,), 1e-3, 3e-3, parameter="play", to="play"),
    _of(
        "spring_knee",
        (SERVO,),
        0.1,
        0.5,
        parameter="stiffness",
        to="knee",
        shapes={"home": ("home", 0.05, 0.08)},
    ),
    _of("air_box_delay", (ENGINE,), 1e-3, 5e-3, parameter="delay", to="air_delay", like=()),
    _of("crank_angle_delay", (ENGINE,), 0.3, 1.5, parameter="turns", to="crank_turns", like=()),
    _of("asymmetric_filling", (ENGINE,), 0.15, 0.6, parameter="asymmetry", to="asymmetry"),
    _of(
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
    ),
    _of(
        "fuel_film",
        (ENGINE,),
        0.05,
        0.2,
        parameter="share",
        to="film_share",
        shapes={"time": ("film_time", 0.1, 0.3)},
    ),
    _of(
        "closed_throttle_friction",
        (ENGINE,),
        1.5,
        6.0,
        parameter="pumping",
        to="pumping",
        shapes={"opening": ("pumping_opening", 0.02, 0.05)},
    ),
    _of(
        "air_density",
        (ENGINE,),
        -0.015,
        -0.05,
        parameter="pressure",
        to="thin_air",
        quiet=True,
        like=(),
    ),
    _of("spark_curvature", (ENGINE,), 0.3, 1.3, parameter="curvature", to="spark_curvature"),
    _of("spark_clip", (ENGINE,), 0.14, 0.07, parameter="limit", to="spark_clip", needs=True),
    _of(
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
    ),
    _of(
        "compression_torque",
        (ENGINE, ENGINE_SPEED),
        10.0,
        40.0,
        parameter="swing",
        to="compression",
        quiet=True,
        like=(),
    ),
    _of(
        "chain_polygon", (DRIVE,), 1e-3, 3e-3, parameter="ripple", to="polygon", quiet=True, like=()
    ),
    _of("backlash", (DRIVE,), 2e-3, 8e-3, parameter="slack", to="slack"),
    _of("hardening_cush", (DRIVE,), 30.0, 150.0, parameter="hardening", to="hardening"),
    _of(
        "clutch_slip",
        (DRIVE, ENGINE),
        150.0,
        90.0,
        parameter="capacity",
        to="worn_clutch",
        needs=True,
    ),
    _of(
        "slipper_clutch",
        (DRIVE, ENGINE),
        30.0,
        12.0,
        parameter="back_torque",
        to="back_torque",
        needs=True,
    ),
    _of("driveline_loss", (DRIVE, WHEEL), 0.01, 0.04, parameter="loss", to="loss"),
    FaultType(
        "radius_growth",
        (TYRE, WHEEL, REAR_TEETH, FRONT_TEETH, OPTICAL),
        {"growth": ("growth", 2e-6, 1e-5), "front_growth": ("front_growth", 1e-6, 5e-6)},
        like=("growth", "front_growth"),
    ),
    _of(
        "load_transfer",
        (TYRE,),
        0.1,
        0.44,
        parameter="height",
        to="height",
        shapes={"settling": ("settling", 0.015, 0.03)},
    ),
    _of(
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
    ),
    _of(
        "grip_temperature",
        (TYRE,),
        -1e-3,
        -3e-3,
        parameter="sensitivity",
        to="heat_sensitivity",
        quiet=True,
        like=(),
    ),
    _of("grip_wear", (TYRE,), 5e-6, 2e-5, parameter="wear", to="wear", quiet=True, like=()),
    _of("relaxation_length", (TYRE,), 0.04, 0.15, parameter="length", to="relaxation"),
    _of(
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
    _of(
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
    _of(
        "optical_scale",
        (OPTICAL,),
        1.5e-3,
        5e-3,
        parameter="error",
        to="optical_error",
        signed=True,
    ),
    _of("optical_lag", (OPTICAL,), 5e-3, 20e-3, parameter="time_constant", to="optical_lag"),
    _of(
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
    _of(
        "eccentricity",
        ("rear teeth", "front teeth"),
        1e-3,
        5e-3,
        parameter="run_out",
        to="run_out",
        shapes={"phase": ("phase", -3.1, 3.1)},
        subjects=("rear_encoder", "front_encoder"),
    ),
    _of(
        "channel_latency",
        (),
        1.5e-3,
        5e-3,
        parameter="latency",
        to="latency",
        like=(),
        subjects=("optical_speed", "engine_speed", "throttle_position"),
    ),
    _of(
        "channel_lag",
        (),
        4e-3,
        20e-3,
        parameter="time_constant",
        to="lag",
        subjects=("engine_speed", "throttle_position"),
    ),
    _of(
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
    _of("quantiser", (), 1.5, 6.0, parameter="quantum", to="quantum", subjects=("engine_speed",)),
    _of(
        "held_frames",
        (),
        15e-3,
        30e-3,
        parameter="hold",
        to="hold",
        quiet=True,
        subjects=("engine_speed", "optical_speed", "throttle_position"),
    ),
    _of(
        "stale_frames",
        (),
        0.02,
        0.1,
        parameter="share",
        to="stale",
        quiet=True,
        subjects=("engine_speed", "optical_speed", "throttle_position"),
    ),
)
"""Kinds that the library of effects has."""

OUTSIDE: tuple[FaultType, ...] = (
    _of(
        "rider_on_his_arms",
        (ROAD, TYRE),
        0.06,
        0.2,
        parameter="share",
        to="rider_share",
        shapes={
            "frequency": ("rider_frequency", 12.0, 25.0),
            "damping": ("rider_damping", 0.15, 0.35),
        },
        inside=False,
    ),
    _of("play_of_the_air", (ENGINE,), 1.5e-3, 5e-3, parameter="play", to="air_play", inside=False),
    _of(
        "thermal_derate",
        (ENGINE,),
        0.06,
        0.2,
        parameter="derate",
        to="derate",
        shapes={"time": ("derate_time", 0.5, 2.0)},
        inside=False,
    ),
    _of(
        "stiffness_by_sign",
        (TYRE,),
        -0.2,
        -0.5,
        parameter="share",
        to="sign_stiffness",
        inside=False,
    ),
    _of(
        "ripple_of_the_map",
        (ENGINE,),
        1.0,
        3.0,
        parameter="swing",
        to="ripple",
        shapes={"period": ("ripple_period", 0.02, 0.05)},
        inside=False,
    ),
    _of(
        "spark_lag", (ENGINE,), 6e-3, 20e-3, parameter="time_constant", to="spark_lag", inside=False
    ),
    _of(
        "servo_gain_by_opening",
        (SERVO,),
        1.0,
        3.0,
        parameter="growth",
        to="servo_gain",
        inside=False,
    ),
    _of(
        "tyre_run_out",
        (WHEEL, TYRE, "rear teeth", REAR_TEETH),
        40.0,
        120.0,
        parameter="force",
        to="run_out",
        inside=False,
    ),
    _of(
        "dry_friction_of_the_cush",
        (DRIVE,),
        8.0,
        25.0,
        parameter="torque",
        to="cush_friction",
        inside=False,
    ),
)
"""Kinds that no library has."""

BY_NAME: Mapping[str, FaultType] = {kind.name: kind for kind in (*LIBRARY, *OUTSIDE)}
SENSOR_OF: Mapping[str, tuple[str, ...]] = {
    "engine_speed": (ENGINE_SPEED,),
    "optical_speed": (OPTICAL,),
    # What the plate tells drives the motion and is judged by the servo alone.
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
    for name, (_, low, high) in kind.shapes.items():
        parameters[name] = (
            float(rng.integers(int(low), int(high) + 1))
            if name in WHOLE
            else float(rng.uniform(low, high))
        )
    return Hidden(kind.name, grade, subject, parameters)
