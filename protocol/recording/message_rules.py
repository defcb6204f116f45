"""Tables of a binding file beside its roles: rules of messages, and degraded modes."""

import difflib
from dataclasses import replace
from typing import Annotated, Literal

from pydantic import Field, field_validator, model_validator

from slipbench.protocol.codec.protection import guard_of
from slipbench.protocol.configuration import Section
from slipbench.protocol.database.layout import Checksum, Database, Message, Protection
from slipbench.protocol.errors import InputError
from slipbench.protocol.quantity import Between

Byte = Annotated[int, Field(ge=0, le=255)]
Period = Annotated[
    float,
    Between("s", "0.5 ms", "10 s", "no bus carries a status more often, or is of use at less"),
]
BusName = Annotated[str, Field(pattern=r"^[A-Za-z0-9_.-]{0,15}$")]
"""Name of a bus: that of the frames in a record, which has no spaces."""
Timeout = Annotated[
    float, Between("s", "2 ms", "50 ms", "for that long the bench drives without seeing")
]


class ChecksumRule(Section):
    """Checksum in one byte over all other bytes of the frame.

    signal      the checksum's signal
    kind        exclusive or, sum modulo 256, or CRC-8
    polynomial  of a CRC-8, without its highest term; 0x1D: SAE J1850, 0x2F: AUTOSAR 8H2F
    start       value before the first byte
    final_xor   is combined with the result by exclusive or
    """

    signal: str
    kind: Literal["xor", "sum", "crc8"]
    polynomial: Byte = 0x1D
    start: Byte = 0
    final_xor: Byte = 0


class ProtectionRule(Section):
    """Protection of a message: an AUTOSAR E2E profile, or a plain counter, a checksum, or both.

    profile   "E2E1", "E2E2", "E2E5"; "plain": `counter` and `checksum`; "none"
    data_id   of profiles 1 and 5
    data_ids  of profile 2: 16 numbers, 0 to 255
    counter   name of the counter signal
    period    number of values of the counter; none: 2^width
    checksum  checksum of profile "plain"
    """

    profile: Literal["E2E1", "E2E2", "E2E5", "plain", "none"]
    data_id: Annotated[int, Field(ge=0, le=0xFFFF)] | None = None
    data_ids: tuple[Byte, ...] = ()
    counter: str = ""
    period: Annotated[int, Field(ge=2, le=65536)] | None = None
    checksum: ChecksumRule | None = None

    @model_validator(mode="after")
    def _complete(self) -> "ProtectionRule":
        plain = self.profile == "plain"
        if self.profile in ("E2E1", "E2E5") and self.data_id is None:
            raise ValueError(f"profile {self.profile} needs data_id")
        if self.profile == "E2E2" and len(self.data_ids) != 16:
            raise ValueError("profile E2E2 needs data_ids: 16 numbers, 0 to 255")
        if plain and not (self.counter or self.checksum):
            raise ValueError('profile "plain" needs counter, checksum, or both')
        if not plain and (self.counter or self.checksum):
            raise ValueError('counter and checksum belong to profile = "plain"')
        return self

    def protection(self) -> Protection | None:
        """Protection as the database holds it; None for profile "none"."""
        if self.profile == "none":
            return None
        rule = self.checksum
        checksum = None
        if rule is not None:
            checksum = Checksum(rule.signal, rule.kind, rule.polynomial, rule.start, rule.final_xor)
        number = {"E2E1": 1, "E2E2": 2, "E2E5": 5, "plain": 0}[self.profile]
        return Protection(
            number,
            self.data_id or 0,
            bytes(self.data_ids),
            self.counter,
            self.period or 0,
            checksum,
        )


class MessageRules(Section):
    """What the database does not state of a message.

    cycle_time  in place of the database's
    timeout     silence after which its values are stale; none: limits.stale of the trial
    bus         name of the bus on which it lies, as in "chassis"; none: `bus` of the file
    protection  none: as the attributes E2EProfile and E2EDataId of the database state
    """

    cycle_time: Period | None = None
    timeout: Timeout | None = None
    bus: BusName = ""
    protection: ProtectionRule | None = None


class Degraded(Section):
    """What the bus lacks, and what the bench does instead. Every entry is a statement of the user.

    wheels           "wheel_speed": no tooth times; slip from sampled wheel speeds
    speed            "front_wheel" or "gnss": no optical speed; slip against that speed
    echo             no echo of the requests; they count as applied after this latency
    hand_back        no authority signal; the ECU gives the throttle back after this time without
                     a request (prove it with `slipbench check --silence`)
    throttle_body    "follows_ecu": the throttle body does not state its authority
    unmonitored      of "gear", "clutch", "brake", "throttle_fault": has no signal, is not monitored
    """

    wheels: Literal["wheel_speed"] | None = None
    speed: Literal["front_wheel", "gnss"] | None = None
    echo: (
        Annotated[
            float, Between("s", "0 ms", "100 ms", "a later actuator belongs to no traction control")
        ]
        | None
    ) = None
    hand_back: (
        Annotated[
            float,
            Between(
                "s", "2 ms", "50 ms", "for that long the last request acts with the bench dead"
            ),
        ]
        | None
    ) = None
    throttle_body: Literal["follows_ecu"] | None = None
    unmonitored: tuple[Literal["gear", "clutch", "brake", "throttle_fault"], ...] = ()

    @field_validator("unmonitored", mode="after")
    @classmethod
    def _once(cls, names: tuple[str, ...]) -> tuple[str, ...]:
        if len(set(names)) < len(names):
            raise ValueError("names one of them twice")
        return names


def with_rules(database: Database, rules: dict[str, MessageRules], where: str) -> Database:
    """Database with the protection and cycle times of a binding file.

    Raises InputError where a message or signal is missing, or does not suit its protection.
    """
    for name in rules:
        if name not in database.by_name:
            near = difflib.get_close_matches(name, database.by_name, n=1, cutoff=0.4)
            raise InputError(
                f"messages.{name}: the database has no message {name!r}",
                where=where,
                expected="a message of " + database.origin,
                remedy=f"did you mean {near[0]!r}?"
                if near
                else "is it the database of this vehicle?",
            )
    if not rules:
        return database
    messages = tuple(_ruled(message, rules.get(message.name)) for message in database.messages)
    for message in messages:
        if message.name in rules:
            _check(message, where)
    return replace(database, messages=messages)


def _ruled(message: Message, rule: MessageRules | None) -> Message:
    if rule is None:
        return message
    protection = message.protection
    if rule.protection is not None:
        protection = rule.protection.protection()
    cycle = message.cycle_time if rule.cycle_time is None else rule.cycle_time
    return replace(message, protection=protection, cycle_time=cycle)


def _check(message: Message, where: str) -> None:
    try:
        guard_of(message)
    except InputError as fault:
        raise InputError(
            f"messages.{message.name}: {fault}",
            where=where,
            remedy="correct the protection of the message",
        ) from fault
