"""Channel of each bus of a binding, as in --channel powertrain=can0 --channel chassis=can1."""

import re
from collections.abc import Mapping, Sequence

from slipbench.bench.bus.opening import BusAddress
from slipbench.protocol.binding.binding import Binding
from slipbench.protocol.errors import InputError

DEFAULT = "can0"
NAMED = re.compile(r"([A-Za-z0-9_.-]+)=(.+)")  # a "=" in the address of a network is no name


def channels_of(texts: Sequence[str], binding: Binding) -> tuple[str, ...]:
    """Channel of each bus of a binding, in its order. texts: of --channel.

    One channel needs no name where there is one bus. Raises InputError where a bus has no channel, a
    name is no bus of the binding or comes twice, or two buses have the same channel.
    """
    if len(binding.buses) == 1 and len(texts) < 2 and not any(map(NAMED.fullmatch, texts)):
        return (texts[0] if texts else DEFAULT,)
    found: dict[str, str] = {}
    for text in texts:
        name, channel = _named(text, binding)
        if name in found:
            raise _invalid(f"--channel names the bus {name!r} twice", text, binding)
        found[name] = channel
    _require_all(found, binding)
    _require_different(found)
    return tuple(found[bus] for bus in binding.buses)


def addresses_of(
    texts: Sequence[str], binding: Binding, interface: str, bitrate: int, fd: bool
) -> tuple[BusAddress, ...]:
    """Address of each bus of a binding, in its order. Raises InputError as `channels_of`."""
    channels = channels_of(texts, binding)
    return tuple(
        BusAddress(interface, channel, bitrate, fd, bus)
        for channel, bus in zip(channels, binding.buses, strict=True)
    )


def _named(text: str, binding: Binding) -> tuple[str, str]:
    """Bus and channel of one text."""
    match = NAMED.fullmatch(text)
    if match is None:
        raise _invalid(f"--channel {text!r} names no bus", text, binding)
    if match[1] not in binding.buses:
        raise _invalid(f"no role of the binding lies on a bus {match[1]!r}", text, binding)
    return match[1], match[2]


def _invalid(what: str, text: str, binding: Binding) -> InputError:
    if binding.buses == ("",):
        expected = "one channel without a name: the binding names no bus"
        remedy = 'give one channel, or name buses in the binding: [messages.NAME] bus = "chassis"'
    else:
        expected = f"BUS=CHANNEL, each bus once, of {', '.join(binding.buses)}"
        remedy = f"as in --channel {binding.buses[0]}={DEFAULT}"
    return InputError(
        what, where=_where(binding), expected=expected, found=f"--channel {text}", remedy=remedy
    )


def _require_all(found: Mapping[str, str], binding: Binding) -> None:
    for bus in binding.buses:
        if bus not in found:
            raise InputError(
                f"no --channel names the bus {bus!r}",
                where=_where(binding),
                expected=f"a channel for {', '.join(binding.messages_on(bus))}",
                found=", ".join(f"--channel {name}={at}" for name, at in found.items()) or "none",
                remedy=f"add --channel {bus}=CHANNEL",
            )


def _require_different(found: Mapping[str, str]) -> None:
    names: dict[str, str] = {}
    for bus, channel in found.items():
        if channel in names:
            raise InputError(
                f"the buses {names[channel]!r} and {bus!r} have the same channel",
                where="--channel",
                expected="a channel of its own for each bus",
                found=channel,
                remedy="correct one of them; if it is one bus, give it one name in the binding",
            )
        names[channel] = bus


def _where(binding: Binding) -> str:
    return str(binding.path or binding.database.origin)
