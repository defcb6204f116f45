"""Every effect for model files; a new effect is one file in this folder and one line here."""

from importlib import import_module

from slipbench.identification.mismatch.systems.effects.seam_effect import SeamEffect

NAMES = (
    "dead_zone",
    "saturation",
    "choked_flow",
    "cavitation",
    "friction",
    "viscous_friction",
    "quadratic_drag",
    "load_friction",
    "back_drive_loss",
    "friction_by_direction",
    "presliding",
    "back_emf",
    "supply_limit",
    "asymmetry",
    "quadratic",
    "square_law",
    "cubic",
    "delay",
    "lag",
    "elastic_transmission",
    "elastic_load",
    "elastic_backlash",
    "hard_stop",
    "hysteresis",
    "many_plays",
    "bouc_wen",
    "rate_limit",
    "slew_limit",
    "acceleration_limit",
    "jerk_limit",
    "braking_loop",
    "linear_loss",
    "overflow",
    "direction_blind",
    "reversed_sign",
    "scale",
    "offset",
    "gain_with_channel",
    "gain_with_size",
    "gain_with_tilt",
    "leak_from_channel",
    "supply_sag",
    "thermal_gain",
    "unbalance",
    "cogging",
    "torque_ripple",
    "low_speed_dropout",
    "eccentricity",
    "moving_average",
    "sensor_delay",
    "held_samples",
    "clock_offset",
    "clock_drift",
)
"""Names of the files in this folder. At one seam, effects act in this order."""


def _effect(name: str) -> type[SeamEffect]:
    """Return the effect of a file: its class has the file's name, in capitals."""
    page = import_module(f"slipbench.identification.mismatch.systems.effects.{name}")
    effect: type[SeamEffect] = getattr(page, name.title().replace("_", ""))
    return effect


LIBRARY: tuple[type[SeamEffect], ...] = tuple(_effect(name) for name in NAMES)
BY_NAME = {effect.name: effect for effect in LIBRARY}
CODES = {effect.name: code for code, effect in enumerate(LIBRARY)}
