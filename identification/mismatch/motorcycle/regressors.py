"""Along what something may act: courses of quantities that the recording tells, row by row.

Quantities that no sensor shows (torque, slip) are those of the fitted simulation, which is driven
by the recorded inputs. What has a memory acts along a rate, or along the past of a quantity.
"""

from collections.abc import Mapping

import numpy as np
from scipy import signal

from slipbench.identification.mismatch.motorcycle.places import later
from slipbench.identification.mismatch.simulation.record import Record
from slipbench.identification.mismatch.simulation.regressor import (
    ANGLE,
    DETAIL,
    HYSTERESIS,
    OVER,
    PAST,
    SCALE,
    quantity_of,
    scale,
)
from slipbench.plant.signals import Floats, Inputs, Outputs

MOTION = (
    "throttle",
    "throttle_rate",
    "air",
    "engine_torque",
    "engine_speed",
    "twist",
    "driveline_torque",
    "tyre_force",
    "slip",
    "speed",
    "acceleration",
    "distance",
    "time",
)
REMEMBERED = (
    "throttle",
    "spark torque",
    "engine speed",
    "driveline torque",
    "slip",
    "speed",
    "command",
)
"""Quantities along whose past something may act; of the spark it is what it moves of the torque."""
TURNING = ("throttle", "command", "air", "twist", "slip")
"""Quantities whose turning back something may follow late, as play and dry friction do."""
DETAILED = ("throttle", "command", "air", "engine speed", "distance")
"""Quantities over which a map may be wrong in detail, or the road be another for a short stretch."""
SCALED = (
    ("command less position", "throttle"),
    ("throttle rate", "throttle"),
    ("engine torque", "engine speed"),
    ("engine torque", "spark"),
    ("engine torque", "time"),
    ("driveline torque", "speed"),
    ("tyre force", "speed"),
    ("tyre force", "time"),
)
"""Quantities that may count for more or less, and along what."""
LATELY = 0.05
"""Seconds over which what a simulation was off is averaged."""
PASSED = 2
"""Bins before that: smoothing and rates reach from one bin into the next."""
UNITS: Mapping[str, str] = {
    "throttle": "1",
    "throttle rate": "1/s",
    "air": "1",
    "air rate": "1/s",
    "engine torque": "N m",
    "engine speed": "rad/s",
    "engine acceleration": "rad/s^2",
    "twist": "rad",
    "twist rate": "rad/s",
    "driveline torque": "N m",
    "torque rate": "N m/s",
    "tyre force": "N",
    "force rate over speed": "N/m",
    "slip": "1",
    "speed": "m/s",
    "acceleration": "m/s^2",
    "distance": "m",
    "time": "s",
    "spark": "rad",
    "spark rate": "rad/s",
    "spark acceleration": "rad/s^2",
    "spark torque": "N m rad",
    "lean": "rad",
    "command": "1",
    "command rate": "1/s",
    quantity_of(ANGLE): "rad",
    "command less position": "1",
    "throttle acceleration": "1/s^2",
    "slip rate": "1/s",
    "jerk": "m/s^3",
}


def motion_regressors(record: Record, out: Outputs, spark_delay: float) -> dict[str, Floats]:
    """Waveforms for what acts between the throttle plate and the road, (rows,) each.

    spark_delay: s, after which an advance that was asked for is felt.
    """
    rate, inputs = record.grid.rate, Inputs(record.inputs)
    seen = {name.replace("_", " "): out[name] for name in MOTION}
    if "throttle_position" in record.measured:
        smooth = record.grid.smoothed(record.measured["throttle_position"])
        seen |= {"throttle": smooth, "throttle rate": rate(smooth)}
        seen["throttle acceleration"] = rate(seen["throttle rate"])
    seen["engine acceleration"] = rate(seen["engine speed"])
    seen["twist rate"] = rate(seen["twist"])
    seen["air rate"] = rate(seen["air"])
    seen["torque rate"] = rate(seen["driveline torque"])
    seen["slip rate"] = rate(seen["slip"])
    seen["jerk"] = rate(seen["acceleration"])
    seen["force rate over speed"] = rate(seen["tyre force"]) / np.maximum(seen["speed"], 1.0)
    seen["spark"] = later(inputs.spark, spark_delay / record.grid.step)
    seen["spark rate"] = rate(seen["spark"])
    seen["spark acceleration"] = rate(seen["spark rate"])
    seen["spark torque"] = seen["engine torque"] * seen["spark"]
    if "rear_turned" in record.measured:
        seen[ANGLE] = record.measured["rear_turned"]
    if "lean_angle" in record.measured:
        seen["lean"] = record.measured["lean_angle"]
    return _and_more(seen)


def servo_regressors(record: Record, out: Outputs, delay: float) -> dict[str, Floats]:
    """Waveforms for what acts in the throttle servo, (rows,) each.

    delay: s, after which a command is the motor's.

    Its position is what these curves are judged by: a position that carried a reading's own noise
    would explain that noise. So the simulation's is followed, corrected by what is past.
    """
    rate = record.grid.rate
    command = later(Inputs(record.inputs).throttle_command, delay / record.grid.step)
    position = _followed(record, "throttle_position", out.throttle)
    return _and_more(
        {
            "throttle": position,
            "throttle rate": rate(position),
            "throttle acceleration": rate(out.throttle_rate),
            "command": command,
            "command rate": rate(command),
            "command less position": command - position,
        }
    )


def _followed(record: Record, role: str, shown: Floats) -> Floats:
    """Return what is shown plus the mean of what was off lately, the bins under way left out."""
    grid = record.grid
    keep = np.exp(-grid.step / LATELY)
    rest = signal.lfilter([1.0 - keep], [1.0, -keep], record.measured[role] - shown)
    late = PASSED * grid.rows_per_bin + _between_samples(record, role)
    return np.asarray(shown + np.concatenate((np.zeros(late), rest))[: shown.size])


def _between_samples(record: Record, role: str) -> int:
    """Rows from one reading to the next: readings are drawn through, so the next one shows."""
    time = record.sensors[role].time
    if time is None or time.size < 2:
        return 0
    return int(np.ceil(np.median(np.diff(time)) / record.grid.step))


def _and_more(seen: dict[str, Floats]) -> dict[str, Floats]:
    """Return the courses, those whose past or turning back is asked for, and scales."""
    more = {PAST + name: seen[name] for name in REMEMBERED if name in seen}
    more |= {HYSTERESIS + name: seen[name] for name in TURNING if name in seen}
    more |= {DETAIL + name: seen[name] for name in DETAILED if name in seen}
    for what, along in SCALED:
        if what in seen and along in seen:
            more[f"{SCALE}{what}{OVER}{along}"] = scale(seen[what], seen[along])
    return seen | more
