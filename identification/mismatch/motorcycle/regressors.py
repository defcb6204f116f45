"""Along what something may act: courses of quantities that the recording tells, bin by bin.

Quantities that no sensor shows (torque, slip) are those of the fitted simulation, which is driven
by the recorded inputs. What has a memory acts along a rate, or along the past of a quantity.
"""

from collections.abc import Mapping

import numpy as np

from identification.mismatch.along import PAST
from identification.mismatch.motorcycle.record import BIN
from identification.mismatch.record import Record
from plant.signals import Floats, Inputs, Outputs

MOTION = ("throttle", "throttle_rate", "air", "engine_speed", "twist", "driveline_torque",
          "tyre_force", "slip", "speed", "acceleration", "distance", "time")  # fmt: skip
REMEMBERED = ("throttle", "spark", "engine speed", "driveline torque", "slip", "speed", "command")
"""Quantities along whose past something may act."""
UNITS: Mapping[str, str] = {
    "throttle": "1", "throttle rate": "1/s", "air": "1", "air rate": "1/s",
    "engine speed": "rad/s", "engine acceleration": "rad/s^2", "twist": "rad",
    "twist rate": "rad/s", "driveline torque": "N m", "torque rate": "N m/s", "tyre force": "N",
    "force rate over speed": "N/m", "slip": "1", "speed": "m/s", "acceleration": "m/s^2",
    "distance": "m", "time": "s", "spark": "rad", "spark rate": "rad/s",
    "spark acceleration": "rad/s^2", "lean": "rad", "command": "1",
    "command rate": "1/s",
    "wheel angle": "rad", "command less position": "1", "throttle acceleration": "1/s^2",
    "slip rate": "1/s", "jerk": "m/s^3",
}  # fmt: skip


def motion_regressors(record: Record, out: Outputs) -> dict[str, Floats]:
    """Courses for what acts between the throttle plate and the road, (bins,) each."""
    binned, inputs = record.grid.binned, Inputs(record.inputs)
    seen = {name.replace("_", " "): binned(out[name]) for name in MOTION}
    if "throttle_position" in record.measured:
        smooth = binned(record.measured["throttle_position"])
        seen |= {"throttle": smooth, "throttle rate": _rate(smooth)}
        seen["throttle acceleration"] = _rate(seen["throttle rate"])
    seen["engine acceleration"] = _rate(seen["engine speed"])
    seen["twist rate"] = _rate(seen["twist"])
    seen["air rate"] = _rate(seen["air"])
    seen["torque rate"] = _rate(seen["driveline torque"])
    seen["slip rate"] = _rate(seen["slip"])
    seen["jerk"] = _rate(seen["acceleration"])
    seen["force rate over speed"] = _rate(seen["tyre force"]) / np.maximum(seen["speed"], 1.0)
    seen["spark"] = binned(inputs.spark)
    seen["spark rate"] = _rate(seen["spark"])
    seen["spark acceleration"] = _rate(seen["spark rate"])
    if "rear_turned" in record.measured:
        seen["wheel angle"] = binned(record.measured["rear_turned"]) % (2.0 * np.pi)
    if "lean_angle" in record.measured:
        seen["lean"] = binned(record.measured["lean_angle"])
    return with_past(seen)


def servo_regressors(record: Record, out: Outputs) -> dict[str, Floats]:
    """Courses for what acts in the throttle servo."""
    binned = record.grid.binned
    command = binned(Inputs(record.inputs).throttle_command)
    position = binned(record.measured["throttle_position"])
    return with_past({
        "throttle": position, "throttle rate": _rate(position),
        "throttle acceleration": _rate(binned(out.throttle_rate)),
        "command": command, "command rate": _rate(command),
        "command less position": command - position,
    })  # fmt: skip


def with_past(seen: dict[str, Floats]) -> dict[str, Floats]:
    """Return the courses, and those of which the past is asked for once more under that name."""
    return seen | {PAST + name: seen[name] for name in REMEMBERED if name in seen}


def _rate(values: Floats) -> Floats:
    return np.gradient(values, BIN)
