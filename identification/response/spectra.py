"""Spectra of the rear wheel, the engine and the suspension over one segment of a recording."""

import numpy as np

from slipbench.identification.signals.aligned import Aligned
from slipbench.identification.signals.dataset import Dataset
from slipbench.identification.signals.motion import Motion, NoMotion
from slipbench.identification.signals.spectrum import Spectrum, spectrum, steadiest
from slipbench.identification.signals.trial_window import NoExcitation, TrialWindow
from slipbench.protocol.recording.channel import FloatArray

SOURCES = {"engine_speed": "rad/s", "rear_suspension_travel": "m"}


def spectra(
    data: Aligned, base: Dataset, moved: Motion | NoMotion, window: TrialWindow | NoExcitation
) -> tuple[Spectrum, ...]:
    """Spectra of the excited segment, else of the steadiest one, each as far as it was sampled."""
    speed = moved.raw if isinstance(moved, Motion) else base.get("engine_speed")
    if speed is None:
        return ()
    segment = window.record if isinstance(window, TrialWindow) else steadiest(speed, base.rate)
    if segment is None:
        return ()
    wheel = moved.wheel_frequency if isinstance(moved, Motion) else None
    made = [
        spectrum(role, unit, value, base.rate, segment, wheel, reach)
        for role, unit, value, reach in _sources(data, base, moved)
    ]
    return tuple(s for s in made if s is not None)


def _sources(
    data: Aligned, base: Dataset, moved: Motion | NoMotion
) -> list[tuple[str, str, FloatArray, float]]:
    """Role, unit, values and the highest frequency that the samples carry."""
    found = [
        (role, unit, base.signals[role], _half_rate(data.time[role]))
        for role, unit in SOURCES.items()
        if data.has(role)
    ]
    if isinstance(moved, Motion):
        reach = min(_half_rate(part.time) for part in moved.axle.parts)
        found.insert(0, (f"{moved.axle.axle}_wheel_speed", "m/s", moved.raw, reach))
    return found


def _half_rate(time: FloatArray) -> float:
    return 0.5 / float(np.median(np.diff(time))) if time.size > 1 else 0.0
