"""Regressors of effects: recorded and simulated quantities, row by row.

Quantities without a sensor (torque, slip) are those of the fitted simulation, which is driven by
the recorded inputs. The regressor of an effect with memory is a rate, or the past of a quantity.
"""

from collections.abc import Mapping

import numpy as np
from scipy import signal

from slipbench.identification.mismatch.motorcycle.places import later
from slipbench.identification.mismatch.simulation.record import Record
from slipbench.identification.mismatch.simulation.regressor import ANGLE, quantity_of, with_kinds
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
"""Quantities whose past may be a regressor; for the spark, its share of the torque."""
TURNING = ("throttle", "command", "air", "twist", "slip")
"""Quantities that may act with hysteresis, as in play and dry friction."""
DETAILED = ("throttle", "command", "air", "engine speed", "distance")
"""Quantities over which a map may be wrong in detail, or the road differ for a short segment."""
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
"""Quantities whose scale may be wrong, and the quantity on which the scale may depend."""
LATELY = 0.05
"""Time constant of the average of the simulation's error, s."""
PASSED = 2
"""Bins before the average: smoothing and rates extend from one bin into the next."""
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
    """Return the regressors of effects between the throttle plate and the road, (rows,) each.

    spark_delay: s, from the request of an advance to its effect.
    """
    rate, inputs = record.grid.rate, Inputs(record.inputs)
    signals = {name.replace("_", " "): out[name] for name in MOTION}
    if "throttle_position" in record.measured:
        smooth = record.grid.smoothed(record.measured["throttle_position"])
        signals |= {"throttle": smooth, "throttle rate": rate(smooth)}
        signals["throttle acceleration"] = rate(signals["throttle rate"])
    signals["engine acceleration"] = rate(signals["engine speed"])
    signals["twist rate"] = rate(signals["twist"])
    signals["air rate"] = rate(signals["air"])
    signals["torque rate"] = rate(signals["driveline torque"])
    signals["slip rate"] = rate(signals["slip"])
    signals["jerk"] = rate(signals["acceleration"])
    signals["force rate over speed"] = rate(signals["tyre force"]) / np.maximum(
        signals["speed"], 1.0
    )
    signals["spark"] = later(inputs.spark, spark_delay / record.grid.step)
    signals["spark rate"] = rate(signals["spark"])
    signals["spark acceleration"] = rate(signals["spark rate"])
    signals["spark torque"] = signals["engine torque"] * signals["spark"]
    if "rear_turned" in record.measured:
        signals[ANGLE] = record.measured["rear_turned"]
    if "lean_angle" in record.measured:
        signals["lean"] = record.measured["lean_angle"]
    return _with_derived(signals)


def servo_regressors(record: Record, out: Outputs, delay: float) -> dict[str, Floats]:
    """Return the regressors of effects in the throttle servo, (rows,) each.

    delay: s, from the command to the motor.

    Curves of the servo are fitted to its position: a regressor with the noise of a reading would
    explain that noise. So the simulated position is used, corrected by its past errors.
    """
    rate = record.grid.rate
    command = later(Inputs(record.inputs).throttle_command, delay / record.grid.step)
    position = _corrected(record, "throttle_position", out.throttle)
    return _with_derived(
        {
            "throttle": position,
            "throttle rate": rate(position),
            "throttle acceleration": rate(out.throttle_rate),
            "command": command,
            "command rate": rate(command),
            "command less position": command - position,
        }
    )


def _corrected(record: Record, role: str, simulated: Floats) -> Floats:
    """Return a simulated output plus the recent mean of its errors, without the current bins."""
    grid = record.grid
    decay = np.exp(-grid.step / LATELY)
    error = signal.lfilter([1.0 - decay], [1.0, -decay], record.measured[role] - simulated)
    delay_rows = PASSED * grid.rows_per_bin + _between_samples(record, role)
    return np.asarray(simulated + np.concatenate((np.zeros(delay_rows), error))[: simulated.size])


def _between_samples(record: Record, role: str) -> int:
    """Rows between readings: readings are interpolated, so each contains part of the next one."""
    time = record.sensors[role].time
    if time is None or time.size < 2:
        return 0
    return int(np.ceil(np.median(np.diff(time)) / record.grid.step))


def _with_derived(signals: dict[str, Floats]) -> dict[str, Floats]:
    """Return the waveforms and the regressors of past, hysteresis, detail and scale."""
    return with_kinds(signals, REMEMBERED, TURNING, DETAILED, SCALED)
