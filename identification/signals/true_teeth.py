"""An axle's speed from teeth where they really stand, wherever a recording lets them be learnt."""

from dataclasses import replace

from slipbench.identification.signals.aligned import Aligned
from slipbench.identification.signals.dataset import Dataset
from slipbench.identification.signals.teeth import speed_from_teeth
from slipbench.identification.signals.tooth_evidence import Answers
from slipbench.identification.signals.tooth_pitch import NoToothPitch, ToothPitch, learn_pitch
from slipbench.identification.signals.wheels import AxleSpeed

FALLBACKS = (("throttle_command", "throttle_position"), ("spark_command", "spark_advance"))


def pitch_of(axle: AxleSpeed, data: Aligned, base: Dataset) -> ToothPitch | NoToothPitch:
    """Learn the gaps between an axle's teeth; the response to throttle and spark is kept apart."""
    if axle.teeth_per_turn is None:
        return NoToothPitch(f"the {axle.axle} wheel was not timed tooth by tooth")
    role = f"{axle.axle}_teeth"
    count = data.recording.channels[role].value
    return learn_pitch(data.time[role], count, axle.teeth_per_turn, inputs(base))


def with_true_teeth(axle: AxleSpeed, pitch: ToothPitch, data: Aligned) -> AxleSpeed:
    """Form the speed anew, every gap with its own angle."""
    assert axle.teeth_per_turn is not None
    assert axle.radius is not None
    role = f"{axle.axle}_teeth"
    count = data.recording.channels[role].value
    turning = speed_from_teeth(
        data.time[role], count, axle.teeth_per_turn, axle.parts[0].origin, pitch.gaps
    )
    method = f"{axle.method}, tooth-pitch errors compensated, from {pitch.turns:.0f} turns"
    return replace(axle, parts=(turning.scaled(axle.radius),), method=method)


def inputs(base: Dataset) -> tuple[Answers, ...]:
    """Inputs of the vehicle: the commanded ones, else the measured ones."""
    found = []
    for command, measured in FALLBACKS:
        value = base.get(command)
        value = base.get(measured) if value is None else value
        if value is not None:
            found.append(Answers(base.time, value))
    return tuple(found)
