"""Where a binding and the bus contradict each other: one sentence each, with its remedy."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from slipbench.bench.check.observed_roles import carrier, is_sent_by_bench, roles_of, values_of
from slipbench.bench.check.traffic import BusTraffic
from slipbench.protocol.binding.behaviour import PLAUSIBLE, SPEED, SPEED_ROLES
from slipbench.protocol.binding.binding import Binding
from slipbench.protocol.binding.binding_text import protection_text
from slipbench.protocol.binding.capture import traffic_of
from slipbench.protocol.binding.gear_ratios import SLOW
from slipbench.protocol.errors import InputError
from slipbench.protocol.logs.decode import Frames

CONTRADICTED = (
    0.5  # share of frames without a fault below which a protection is not that of the sender
)
IMPLAUSIBLE = 0.02  # share of values
ALIKE = 1.25  # ratio of two speeds of one vehicle; tyres and slip stay within it
FEWEST = 20  # frames from which anything is concluded


@dataclass(frozen=True)
class Finding:
    """One contradiction. role: or message, that it concerns."""

    role: str
    what: str
    expected: str
    found: str
    remedy: str

    def __str__(self) -> str:
        """The finding in the form of every input error."""
        return str(
            InputError(
                self.what,
                where=self.role,
                expected=self.expected,
                found=self.found,
                remedy=self.remedy,
            )
        )


def findings(binding: Binding, traffic: BusTraffic) -> list[Finding]:
    """Everything in which binding and bus contradict each other."""
    return [
        *_other_senders(binding, traffic),
        *_protections(binding, traffic),
        *_cycle_times(binding, traffic),
        *_values(binding, traffic),
        *_speeds(binding, traffic),
        *_same_signal(binding),
    ]


def _other_senders(binding: Binding, traffic: BusTraffic) -> Iterator[Finding]:
    """Requests on the bus that this program has not sent."""
    roles = roles_of(binding).roles
    for name in sorted(binding.sent):
        frames = traffic.sorted.frames[name]
        if len(frames):
            held = [
                role
                for role, source in roles.items()
                if is_sent_by_bench(role) and carrier(binding, source).name == name
            ]
            yield Finding(
                ", ".join(held),
                f"another node sends {name}, which the bench sends",
                "no frame of it while the bench only listens",
                f"{len(frames)} frames, identifier {frames.message.identifier:#x}",
                "take the other node off the bus, or bind the requests to a message of their own",
            )


def _protections(binding: Binding, traffic: BusTraffic) -> Iterator[Finding]:
    """Protections that the frames do not obey, with the one that they do."""
    for name in _carriers(binding):
        frames = traffic.sorted.frames[name]
        if frames.message.protection is None or len(frames) < FEWEST:
            continue
        right = float(frames.protected.mean())
        if right >= CONTRADICTED and not _stands(frames):
            continue
        shown = traffic_of(frames, traffic.log.time_ns)
        instead = protection_text(frames.message, shown)
        wrong = f"the checksum or counter is wrong in {1 - right:.0%} of {len(frames)} frames"
        yield Finding(
            f"messages.{name}.protection",
            "the frames do not have this protection",
            _protection_name(frames),
            wrong if right < CONTRADICTED else "the counter does not count",
            f"state the protection that they have: {instead}"
            if instead
            else "none is found in these frames: ask the maker of the ECU, or state it as none",
        )


def _stands(frames: Frames) -> bool:
    """Whether the counter of the protection does not count."""
    if not frames.counter_period:
        return False
    steps = np.diff(frames.counters) % frames.counter_period
    return bool(np.mean(steps == 0) > CONTRADICTED)


def _protection_name(frames: Frames) -> str:
    protection = frames.message.protection
    assert protection is not None
    if protection.profile:
        return f"AUTOSAR E2E profile {protection.profile}, data id {protection.data_id:#06x}"
    parts = [f"counter {protection.counter}"] if protection.counter else []
    if protection.checksum is not None:
        parts.append(f"{protection.checksum.kind} in {protection.checksum.signal}")
    return " and ".join(parts)


def _cycle_times(binding: Binding, traffic: BusTraffic) -> Iterator[Finding]:
    for name in _carriers(binding):
        message = binding.database.message(name)
        if message.cycle_time is None or len(traffic.sorted.frames[name]) < FEWEST:
            continue
        rate = traffic.rate(name)
        if rate * message.cycle_time < 0.5 and message.attributes.get("GenMsgSendType") != 1:
            yield Finding(
                f"messages.{name}.cycle_time",
                "the message comes more rarely than stated",
                f"every {message.cycle_time * 1e3:g} ms",
                f"every {1e3 / rate:.3g} ms, in the mean",
                "state the cycle time that it has, or correct the sender",
            )


def _values(binding: Binding, traffic: BusTraffic) -> Iterator[Finding]:
    """Values that no motorcycle has: the unit or the signal is another one."""
    for role in _measured(binding):
        low, high = SPEED if role in SPEED_ROLES else PLAUSIBLE.get(role, (-np.inf, np.inf))
        _, values = values_of(binding, traffic, role)
        if values.size < FEWEST or not np.isfinite(low):
            continue
        outside = np.mean((values < low) | (values > high))
        if outside > IMPLAUSIBLE:
            unit = roles_of(binding).unit(role)
            yield Finding(
                role,
                "its values are not those of this role",
                f"{low:g} to {high:g} {unit}".removesuffix(" 1"),
                f"{values.min():.4g} to {values.max():.4g}",
                "is it another unit? state unit or scale in the binding; or bind another signal",
            )


def _speeds(binding: Binding, traffic: BusTraffic) -> Iterator[Finding]:
    """Two speeds of one vehicle that differ by a factor: one unit is wrong."""
    moving = {}
    for role in _measured(binding):
        if role in SPEED_ROLES:
            times, values = values_of(binding, traffic, role)
            if values.size >= FEWEST:
                moving[role] = times, values
    if len(moving) < 2:
        return
    base = np.arange(0.0, traffic.duration, 0.1)
    held = {role: np.interp(base, *series) for role, series in moving.items()}
    middle = np.median(list(held.values()), axis=0)
    for role, speed in held.items():
        fast = (speed > SLOW) & (middle > SLOW)
        if np.count_nonzero(fast) < FEWEST:
            continue
        ratio = speed[fast] / middle[fast]
        factor = float(np.median(ratio))
        steady = np.ptp(np.quantile(ratio, [0.1, 0.9])) < 0.1 * factor
        if steady and not 1 / ALIKE < factor < ALIKE:
            yield Finding(
                role,
                "it differs from the other speeds by a constant factor",
                "the speed of " + ", ".join(other for other in held if other != role),
                f"{factor:.3g} times that speed",
                "correct its unit, scale or radius in the binding",
            )


def _same_signal(binding: Binding) -> Iterator[Finding]:
    """A signal with two roles that cannot both be right."""
    taken: dict[str, str] = {}
    for role, source in roles_of(binding).roles.items():
        if len(source.signals) != 1:
            continue
        before = taken.setdefault(source.signals[0], role)
        if before != role and not _of_one_axle(before, role):
            yield Finding(
                role,
                f"{source.signals[0]} is also bound to {before}",
                "a signal of its own for each role",
                "one signal for both",
                "bind each role to a signal of its own, or remove one of them",
            )


def _of_one_axle(one: str, other: str) -> bool:
    """Whether one role is a side of the axle that is the other."""
    return {one.replace("_left", "").replace("_right", "")} == {
        other.replace("_left", "").replace("_right", "")
    }


def _carriers(binding: Binding) -> list[str]:
    """Messages of the motorcycle that hold a role."""
    return list(
        dict.fromkeys(
            carrier(binding, source).name
            for role, source in roles_of(binding).roles.items()
            if not source.column and not is_sent_by_bench(role)
        )
    )


def _measured(binding: Binding) -> list[str]:
    """Roles with a signal that the motorcycle sends and that is a number."""
    return [
        role
        for role, source in roles_of(binding).roles.items()
        if source.signals and not source.values and not is_sent_by_bench(role)
    ]
