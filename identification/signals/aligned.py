"""A recording with every channel on the bus clock, still at its own instants."""

from collections.abc import Mapping
from dataclasses import dataclass

from slipbench.identification.signals.clocks import BUS, ClockFit, Unaligned, align_all
from slipbench.identification.signals.samples import Samples, sampled
from slipbench.protocol.recording.channel import Channel, FloatArray
from slipbench.protocol.recording.recording import Recording


@dataclass(frozen=True)
class Aligned:
    """Channels on the bus clock.

    time    role -> (n,) s on the bus clock, for every channel whose clock could be aligned
    clocks  clock -> its fit, or why there is none
    absent  role -> why it cannot be used
    """

    recording: Recording
    time: Mapping[str, FloatArray]
    clocks: Mapping[str, ClockFit | Unaligned]
    absent: Mapping[str, str]

    def has(self, role: str) -> bool:
        """Whether a role has samples that can be used."""
        return role in self.time

    def samples(self, role: str) -> Samples:
        """The samples of a role, times on the bus clock."""
        channel = self.recording.channels[role]
        return sampled(self.time[role], channel.value, channel.origin)


def aligned(recording: Recording) -> Aligned:
    """Lay every device's clock onto the bus clock."""
    clocks = align_all(recording.channels.values())
    time: dict[str, FloatArray] = {}
    absent = dict(recording.missing)
    for role, channel in recording.channels.items():
        on_bus = _bus_time(channel, clocks)
        if channel.time.size < 2:
            absent[role] = f"{channel.time.size} samples ({channel.origin})"
        elif isinstance(on_bus, Unaligned):
            absent[role] = f'clock "{on_bus.clock}" cannot be aligned: {on_bus.reason}'
        else:
            time[role] = on_bus
    return Aligned(recording, time, clocks, absent)


def _bus_time(
    channel: Channel, clocks: Mapping[str, ClockFit | Unaligned]
) -> FloatArray | Unaligned:
    if channel.clock == BUS:
        return channel.time
    fit = clocks.get(channel.clock)
    if isinstance(fit, ClockFit):
        return fit.to_bus(channel.time)
    return fit or Unaligned(channel.clock, "no samples")
