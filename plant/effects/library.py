"""Every effect that the bench knows; a new one is one file beside this and one line in it."""

from importlib import import_module

from slipbench.plant.effects.effect import Effect
from slipbench.plant.effects.free_curve import CURVES
from slipbench.plant.effects.full_load_table import FullLoadTable

NAMES = (
    "rate_limit",
    "acceleration_limit",
    "voltage_limit",
    "throttle_stiction",
    "gear_play",
    "spring_knee",
    "air_box_delay",
    "crank_angle_delay",
    "asymmetric_filling",
    "runner_resonance",
    "fuel_film",
    "closed_throttle_friction",
    "air_density",
    "spark_curvature",
    "spark_clip",
    "torque_dip",
    "firing_torque",
    "compression_torque",
    "chain_polygon",
    "backlash",
    "hardening_cush",
    "clutch_slip",
    "slipper_clutch",
    "driveline_loss",
    "radius_growth",
    "radius_with_lean",
    "load_transfer",
    "squat",
    "grip_temperature",
    "grip_wear",
    "relaxation_length",
    "wet_patch",
    "grade",
    "wind",
    "mounting_angle",
    "optical_scale",
    "optical_lag",
    "tooth_misplacement",
    "eccentricity",
    "channel_latency",
    "channel_lag",
    "moving_average",
    "channel_scale",
    "direction_blind_counter",
    "quantiser",
    "held_frames",
    "stale_frames",
    "clock_offset",
    "clock_drift",
)
"""Each names a file here. Of effects at one seam the earlier acts first."""


def _effect(name: str) -> type[Effect]:
    """The effect of a file: its class has the file's name, in capitals."""
    page = import_module(f"slipbench.plant.effects.{name}")
    effect: type[Effect] = getattr(page, name.title().replace("_", ""))
    return effect


LIBRARY: tuple[type[Effect], ...] = tuple(_effect(name) for name in NAMES)
STAND_INS: tuple[type[Effect], ...] = (*CURVES, FullLoadTable)
"""Curves without a name, and tables of a file; a simulation can have them, nobody looks for them."""
BY_NAME = {effect.name: effect for effect in (*LIBRARY, *STAND_INS)}
