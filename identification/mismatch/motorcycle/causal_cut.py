"""Cut of the causal graph at every recorded signal; the channels define the output groups."""

from collections.abc import Sequence

from slipbench.identification.mismatch.simulation.causal_partition import (
    CausalPartition,
    OutputGroup,
    noise_memory,
)
from slipbench.identification.mismatch.simulation.record import Record
from slipbench.plant.effects.effect import Effect
from slipbench.plant.equations import EQUATIONS
from slipbench.plant.sensing import is_sensor_effect
from slipbench.plant.signals import Inputs

LEADS = (
    ("throttle_position", "measured_throttle"),
    ("engine_speed", "measured_engine_speed"),
    ("rear", "measured_rear_speed"),
)
"""Signals that may drive the motion, causes first: recorded quantity, input of simulation."""
SPEEDS = (
    "engine_speed",
    "rear_teeth",
    "rear_wheel_speed",
    "front_teeth",
    "front_wheel_speed",
    "optical_speed",
    "gnss_speed",
    "vehicle_speed",
)
SERVO_SEAMS = tuple(e.__name__ for e in EQUATIONS)[
    : [e.__name__ for e in EQUATIONS].index("air_delay")
]


def partition(records: Sequence[Record], order: int = 12) -> CausalPartition:
    """Return the subsystems and output groups that all these records support."""
    available = set.intersection(*(set(r.sensors) for r in records))
    measured = set.intersection(*(set(r.measured) for r in records))
    command = all(Inputs(r.inputs).throttle_command.any() for r in records)
    subsystems: dict[str, tuple[tuple[str, str], ...]] = {}
    groups: list[OutputGroup] = []
    memory = noise_memory(records)
    servo = "throttle_position" in available and command
    if servo:
        subsystems["servo"] = ()
        groups.append(
            OutputGroup("throttle servo", "servo", ("throttle_position",), order, memory, False)
        )
    driver = next(((s, i) for s, i in LEADS if s in measured), None)
    subsystems["motion"] = (driver,) if driver else ()
    readings = {"engine_speed": ("engine_speed",), "rear": ("rear_teeth", "rear_wheel_speed")}
    excluded = readings.get(driver[0], ()) if driver else ()
    compared = tuple(o for o in SPEEDS if o in available and o not in excluded)
    if compared:
        groups.append(OutputGroup("motion", "motion", compared, order, memory))
    for wheel in ("rear", "front"):
        if f"{wheel}_tooth_pattern" in available:
            pattern = (f"{wheel}_tooth_pattern",)
            groups.append(OutputGroup(f"{wheel} encoder", "motion", pattern, 0, memory))
    return CausalPartition(subsystems, tuple(groups))


def changes_simulation(effect: Effect, cut: CausalPartition, subsystem: str) -> bool:
    """Return whether an effect falsifies the driver of a subsystem that is itself simulated."""
    if not is_sensor_effect(effect):
        return False
    servo = any(effect.channel in b.outputs for b in cut.groups if b.subsystem == "servo")
    return servo and any(source == effect.channel for source, _ in cut.subsystems[subsystem])


def concerns(effect: Effect, cut: CausalPartition, subsystem: str) -> bool:
    """Return whether an effect can change the outputs of a subsystem."""
    drives = changes_simulation(effect, cut, subsystem)
    if is_sensor_effect(effect):
        return drives or any(
            effect.channel in b.outputs for b in cut.groups if b.subsystem == subsystem
        )
    servo = [hook.seam in SERVO_SEAMS for hook in effect.hooks]
    if subsystem == "servo":
        return any(servo)
    return not all(servo) or not servo or "servo" not in cut.subsystems
