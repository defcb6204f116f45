"""Sensor effects: what acts between a physical quantity and its frames.

Two kinds act here, found by what they can do. One changes values: before the sensor is sampled
(`stage` "signal": a lag, a scale) or in its frames (`stage` "frame": a word length, a stale value).
The other changes a clock. Each is a pure function with an explicit memory, so that a bench that
lives sample by sample and an analysis of a whole recording get the same.

    memories, value = measure(sensor_effects(effects, "engine_speed", "signal"), memories, time, value)
    stamp, value = measure_channel(effects, "engine_speed", timing, time, value)
"""

from collections.abc import Iterable
from typing import Protocol, TypeGuard, runtime_checkable

import numpy as np

from slipbench.plant.channels import ChannelTiming, sample
from slipbench.plant.effects.effect import Effect
from slipbench.plant.signals import Floats

Memories = tuple[Floats, ...]


@runtime_checkable
class SensorEffect(Protocol):
    """An effect that changes the values of one channel. stage: "signal" or "frame"."""

    channel: str
    stage: str

    def measure(self, memory: Floats, time: Floats, value: Floats) -> tuple[Floats, Floats]:
        """The memory after these samples, and the values that are sent instead.

        memory: empty at first. time: s, increasing, shape (n,), n >= 1; value: shape (n,).
        """
        ...


@runtime_checkable
class Misdates(Protocol):
    """An effect that puts a clock wrong."""

    clock: str

    def clock_error(self, time: float) -> float:
        """Error of the clock in s at a true time in s, positive where it is ahead."""
        ...


_KNOWN: dict[type, bool] = {}


def is_sensor_effect(effect: object) -> TypeGuard[SensorEffect]:
    """Whether an effect changes the values of a channel.

    Looked up once a class: fits look for sensor effects very often.
    """
    kind = type(effect)
    if kind not in _KNOWN:
        _KNOWN[kind] = isinstance(effect, SensorEffect)
    return _KNOWN[kind]


def sensor_effects(
    effects: Iterable[Effect], channel: str, *stages: str
) -> tuple[SensorEffect, ...]:
    """Effects that act on a channel, stage by stage, in their given order."""
    acting = [e for e in effects if is_sensor_effect(e) and e.channel == channel]
    return tuple(effect for stage in stages for effect in acting if effect.stage == stage)


def measure(
    effects: tuple[SensorEffect, ...], memories: Memories, time: Floats, value: Floats
) -> tuple[Memories, Floats]:
    """Memories after these samples, and the reported values, shape (n,).

    memories: `()` at first; time: s, shape (n,); value: in the channel's unit, shape (n,).
    """
    new = []
    for i, effect in enumerate(effects):
        memory = memories[i] if memories else np.empty(0)
        memory, value = effect.measure(memory, time, value)
        new.append(memory)
    return tuple(new), value


def clock_of(effects: Iterable[Effect], timing: ChannelTiming) -> tuple[float, float]:
    """Offset (s) and drift (1) of a channel's clock, the effects on it included."""
    offset, drift = timing.clock_offset, timing.clock_drift
    for effect in effects:
        if isinstance(effect, Misdates) and effect.clock == timing.clock:
            offset += effect.clock_error(0.0)
            drift += effect.clock_error(1.0) - effect.clock_error(0.0)
    return offset, drift


def measure_channel(
    effects: Iterable[Effect],
    channel: str,
    timing: ChannelTiming,
    time: Floats,
    value: Floats,
    start: float = 0.0,
) -> tuple[Floats, Floats]:
    """Time stamps on the channel's own clock (s) and values of its frames, without noise.

    time: true time, s, increasing, shape (n,); value: true value, shape (n,); samples fall at
    start + k period. Raises ValueError for a channel of events, such as teeth.
    """
    effects = tuple(effects)
    _, measured = measure(sensor_effects(effects, channel, "signal"), (), time, value)
    at, frames = sample(time, measured, timing, start)
    _, reading = measure(sensor_effects(effects, channel, "frame"), (), at, frames)
    offset, drift = clock_of(effects, timing)
    return at + offset + drift * at, reading
