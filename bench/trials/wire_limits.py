"""Check a trial against the signals of the database.

A command beyond its signal's range could not be sent, and a limit at or beyond the end of its
sensor's range would never trip: both are rejected when the trial file is read.
"""

from collections.abc import Iterator
from operator import attrgetter

from slipbench.bench.trials.excitation import Excitation
from slipbench.protocol.codec.codec import Codec
from slipbench.protocol.codec.messages import Authority
from slipbench.protocol.codec.slot import Slot
from slipbench.protocol.errors import InputError
from slipbench.protocol.quantity import shown
from slipbench.protocol.trial_file import TrialFile

# Key of the trial file (a value or two bounds), and the signal that carries it.
CARRIED = {
    "limits.throttle": ("ActuatorCommand", "throttle"),
    "limits.spark": ("ActuatorCommand", "spark"),
    "limits.engine_speed": ("EngineStatus", "engine_speed"),
    "limits.speed": ("OpticalSpeed", "speed"),
    "limits.grip_closed": ("RiderControls", "grip"),
    "limits.brake_pressure": ("RiderControls", "front_brake"),
    "limits.clutch": ("RiderControls", "clutch"),
    "operating_point.engine_speed": ("EngineStatus", "engine_speed"),
    "operating_point.gear": ("EngineStatus", "gear"),
}
PERIODIC = (
    "EcuStatus",
    "ThrottleStatus",
    "EngineStatus",
    "RiderControls",
    "OpticalSpeed",
    "RearWheelSpeed",
    "FrontWheelSpeed",
)
ROUNDING = 1e-9  # of the range: a limit that is the signal's own stands in other units


def check_wire(trial: TrialFile, excitation: Excitation, codec: Codec, where: str) -> None:
    """Reject what the frames cannot carry. Raises InputError that names every such value."""
    amplitude = trial.excitation.amplitude
    faults = [
        *_unmonitored(codec),
        *_no_release(codec),
        *_beyond(trial, codec),
        *_too_fine(excitation, codec, amplitude),
    ]
    if faults:
        raise InputError(
            "; ".join(faults),
            where=where,
            expected=f"what the frames of {codec.origin} carry",
            remedy="change the trial, or give the motorcycle's own database with --dbc",
        )


def _unmonitored(codec: Codec) -> Iterator[str]:
    """Name each periodic status without a cycle time, by which a second sender is found."""
    for name in PERIODIC:
        for carrier in codec.carriers(name) if codec.has(name) else ():
            if not codec.plan_of(carrier).message.cycle_time:
                yield f"message {carrier} has no cycle time (attribute GenMsgCycleTime)"


def _no_release(codec: Codec) -> Iterator[str]:
    """Report a command signal that cannot carry the neutral value, which releases authority."""
    for name in ("throttle", "spark"):
        signal = _slot_of(codec, "ActuatorCommand", name)
        if signal is None:
            continue
        if not signal.low <= round(-signal.offset / signal.scale) <= signal.high:
            yield f"ActuatorCommand.{name} cannot carry 0, which releases authority"


def check_authority(authority: Authority, codec: Codec, where: str) -> None:
    """Check that signals can show the authority that a trial needs, and its end.

    Raises InputError: such a trial would never begin, or never release.
    """
    for name in ("ActuatorCommand", "EcuStatus"):
        carried = _slot_of(codec, name, "authority")
        if carried is None:
            continue
        shown_as = set((carried.values or {}).values())
        for each in (Authority.NONE, authority):
            if each not in shown_as:
                raise InputError(
                    f"{carried.name} cannot show the authority {each.name.lower()},"
                    f" which the trial {'ends' if each is Authority.NONE else 'begins'} with",
                    where=where,
                    expected=f"values of {name}.authority that name {each.name.lower()}",
                    found=", ".join(member.name.lower() for member in sorted(shown_as)),
                    remedy="add it to `values` of the role in the binding file",
                )


def _beyond(trial: TrialFile, codec: Codec) -> Iterator[str]:
    """Name each value that its signal cannot carry, or a limit at the end of its signal's range.

    A limit trips when the measured value is beyond it, so at the end of the range it never does.
    """
    for key, (message, name) in CARRIED.items():
        signal_slot = _slot_of(codec, message, name)
        if signal_slot is None:
            continue
        low, high = sorted(
            raw * signal_slot.scale + signal_slot.offset
            for raw in (signal_slot.low, signal_slot.high)
        )
        stated = attrgetter(key)(trial)
        values = stated if isinstance(stated, tuple) else (stated,)
        measured = key.startswith("limits.") and message != "ActuatorCommand"
        slack = ROUNDING * (high - low) * (-1.0 if measured else 1.0)
        if not all(low - slack <= value <= high + slack for value in values):
            stated_values = " .. ".join(str(value) for value in values)
            ends = f"{shown(low, values[-1])} .. {shown(high, values[-1])}"
            within = "within" if measured else "in"
            yield f"{key} = {stated_values} is not {within} {ends} ({message}.{name})"


def _too_fine(excitation: Excitation, codec: Codec, amplitude: float) -> Iterator[str]:
    """Report an excitation that is below the resolution of its command signal.

    A slip target is in no signal; a floating-point signal has no step.
    """
    carried = _slot_of(codec, "ActuatorCommand", excitation.actuator)
    if carried is None or carried.real:
        return
    step = abs(carried.scale)
    largest = float(abs(excitation.table).max())
    if largest < step:
        yield (
            f"excitation.amplitude = {amplitude} is less than one step of"
            f" ActuatorCommand.{excitation.actuator} ({shown(step, amplitude)})"
        )


def _slot_of(codec: Codec, message: str, name: str) -> Slot | None:
    """Slot of a field; None where no signal holds it."""
    parts = codec.parts(message) if codec.has(message) else []
    return next((part.slot(name) for part in parts if name in part.fields), None)
