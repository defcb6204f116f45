"""One trial as a model sees it: command, slip, and the signals by which a model may switch.

run = experiment_of(identify(read(folder)))          # Experiment or NoExperiment
run.signal["command"], run.signal["torque rate"], run.signal["twist"]
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from slipbench.identification.models.switched import STILL, IntArray, mode_of
from slipbench.identification.response.identify import Identification
from slipbench.identification.response.responses import INPUTS, excited_actuator
from slipbench.identification.signals.filters import bridged, low_pass
from slipbench.identification.signals.motion import NoMotion
from slipbench.identification.signals.trial_window import NoExcitation
from slipbench.protocol.recording.channel import FloatArray

SMOOTH = 40.0  # Hz, of the measured throttle before it is differentiated
SLOW = 0.5  # Hz; twist counts from its mean over about this long


@dataclass(frozen=True)
class Experiment:
    """One trial, from before its excitation until after it.

    u, y      (n,) change of the command about its rest, and slip; rate: Hz
    part      slice in which the excitation lasted
    speed     m/s, mean over that
    signal    by name, (n,): "command" and what a switched model may look at, where it was measured
    resting   share of each signal's amplitude below which it counts as zero, and the mode stays
    """

    u: FloatArray
    y: FloatArray
    rate: float
    part: slice
    speed: float
    signal: Mapping[str, FloatArray]

    def mode(self, name: str) -> IntArray:
        """Mode of each sample by the sign of a signal, shape (n,): 0 positive, 1 negative.

        Raises KeyError where the signal was not measured.
        """
        signal = self.signal[name]
        return mode_of(np.where(np.abs(signal) > STILL * np.ptp(signal), signal, 0.0))


@dataclass(frozen=True)
class NoExperiment:
    """Why a trial cannot be simulated."""

    reason: str


def experiment_of(found: Identification) -> Experiment | NoExperiment:
    """Cut a trial out of a recording, with up to 2 s before and after the excitation."""
    move, window = found.motion, found.window
    if isinstance(move, NoMotion):
        return NoExperiment(move.reason)
    if isinstance(window, NoExcitation):
        return NoExperiment(window.reason)
    command, position = INPUTS[excited_actuator(found.recording.trial, found.base, window)]
    whole, rate = window.record, found.base.rate
    given = found.base.get(command)
    if given is None:
        return NoExperiment(f"{command} was not recorded")
    u, y = bridged(given[whole]), bridged(move.slip.ratio[whole])
    part = slice(window.exciting.start - whole.start, window.exciting.stop - whole.start)
    rest = np.median(u[: part.start]) if part.start else np.median(u)
    signal = {"command": np.diff(u, prepend=u[0])}
    measured, crank = found.base.get(position), found.base.get("engine_speed")
    if measured is not None:
        signal["torque rate"] = torque_rate(bridged(measured[whole]), rate)
    if crank is not None:
        signal["twist"] = twist(bridged(crank[whole]), bridged(move.driven[whole]), rate)
    speed = float(np.nanmean(move.reference[window.exciting]))
    return Experiment(u - rest, y, rate, part, speed, signal)


def torque_rate(position: FloatArray, rate: float) -> FloatArray:
    """Rate of the engine's torque: where torque is not measured, by the throttle.

    position: (n,), what the actuator says that it did. Returns its rate, zero where it rests.
    """
    smooth = low_pass(position, rate, SMOOTH)
    change = np.gradient(smooth) * rate
    return np.where(np.abs(change) > 0.02 * np.abs(change).max(initial=0.0), change, 0.0)


def twist(engine_speed: FloatArray, driven: FloatArray, rate: float) -> FloatArray:
    """Twist of the driveline about its slow mean, in the unit of `driven` times s.

    Crank speed over the overall ratio less the wheel's speed, integrated; the ratio is the one at
    which both speeds agree over the trial. engine_speed: rad/s; driven: m/s; both (n,).
    """
    ratio = float(engine_speed @ driven / (engine_speed @ engine_speed))
    wound = np.cumsum(engine_speed * ratio - driven) / rate
    return np.asarray(wound - low_pass(wound, rate, SLOW))
