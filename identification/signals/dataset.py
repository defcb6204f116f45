"""All signals of a recording on one time base: only here are channels interpolated."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from slipbench.identification.signals.aligned import Aligned
from slipbench.identification.signals.samples import Samples, averaged, held, onto, smoothly
from slipbench.identification.signals.wheels import AxleSpeed
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.channel import FloatArray

STATES = frozenset({"gear", "trial_phase", "authority", "trip_reason", "rider_button"})
COMMANDS = frozenset({"throttle_command", "spark_command"})
RATES = (10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0)  # Hz
MOST_SAMPLES = 6_000_000  # 100 minutes at 1 kHz
COUNTS = frozenset({"rear_teeth", "front_teeth", "rear_tooth_counter", "front_tooth_counter"})


@dataclass(frozen=True)
class Dataset:
    """Signals on one time base.

    time     (n,) s on the bus clock since the recording's start, equally spaced
    rate     Hz
    signals  role -> (n,) SI, NaN where not known
    units    role -> its SI unit, also of quantities that are no role of the bench
    stated   role -> unit that its source states, empty where it states none
    """

    time: FloatArray
    rate: float
    signals: Mapping[str, FloatArray]
    units: Mapping[str, str] = field(default_factory=dict)
    stated: Mapping[str, str] = field(default_factory=dict)

    def get(self, role: str) -> FloatArray | None:
        """Signal of a role in SI, shape (n,); None where the recording has none."""
        return self.signals.get(role)


def dataset(data: Aligned) -> Dataset:
    """Put every channel but tooth counts onto one time base."""
    end = data.recording.duration or max((float(t[-1]) for t in data.time.values()), default=0.0)
    rate = _bounded(_rate(data), end, str(data.recording.folder))
    time = np.arange(max(int(np.floor(end * rate)) + 1, 1)) / rate
    signals = {
        role: _method(role)(data.samples(role), time) for role in data.time if role not in COUNTS
    }
    units = {role: data.recording.channels[role].unit for role in signals}
    stated = {role: data.recording.channels[role].stated for role in signals}
    return Dataset(time, rate, signals, units, stated)


def axle_signal(axle: AxleSpeed, time: FloatArray) -> FloatArray:
    """Put an axle's speed onto the time base, wheels averaged. Returns m/s, NaN where unknown."""
    wheels: FloatArray = np.stack([smoothly(part, time) for part in axle.parts])
    return np.asarray(wheels.mean(axis=0))


def _method(role: str) -> Callable[[Samples, FloatArray], FloatArray]:
    if role in STATES:
        return held
    return averaged if role in COMMANDS else onto


def _rate(data: Aligned) -> float:
    """Choose the least usual rate that the fastest channel fits into; teeth ask for the highest."""
    if any(role.endswith("_teeth") for role in data.time):
        return RATES[-1]
    fastest = max((_usual_rate(t) for t in data.time.values()), default=RATES[0])
    return next((rate for rate in RATES if rate >= 0.9 * fastest), RATES[-1])


def _bounded(rate: float, end: float, where: str) -> float:
    """Lower the rate until the time base fits into memory. Raises InputError where none does."""
    fitting = [r for r in RATES if r <= rate and r * end <= MOST_SAMPLES]
    if fitting:
        return fitting[-1]
    raise InputError(
        "the recording is too long to be put onto one time base",
        where=where,
        expected=f"at most {MOST_SAMPLES / RATES[0] / 3600:.0f} hours",
        found=f"{end / 3600:.0f} hours",
        remedy="check the time columns and offsets of its tables, or cut the log",
    )


def _usual_rate(time: FloatArray) -> float:
    step = float(np.median(np.diff(time)))
    return 1.0 / step if step > 0 else RATES[-1]
