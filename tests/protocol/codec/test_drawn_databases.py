"""On any database: what is sent is received, within half a step of its signal."""

import math
from dataclasses import fields, replace
from functools import cache
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory

import pytest

from slipbench.dbc import MOTORBIKE, MOTORBIKE_ROLES
from slipbench.protocol.binding.binding import Binding, read_binding
from slipbench.protocol.codec.assembly import Assembly
from slipbench.protocol.codec.codec import Codec, Sender
from slipbench.protocol.codec.faults import Fault, FrameFault
from slipbench.protocol.codec.messages import BenchMessage, Intervals, ToothIntervals
from slipbench.protocol.codec.placement import KINDS
from slipbench.protocol.codec.wire import FieldsPart, TeethPart
from slipbench.protocol.database.database import load_database
from tests.paths import TRIALS
from tests.protocol.binding.foreign import foreign_binding

SUPERBIKE = TRIALS.parent / "bindings" / "superbike.toml"
DRAWN = range(1, 13)


@cache
def binding_of(name: str | int) -> Binding:
    if isinstance(name, str):
        return read_binding(Path(name))
    with TemporaryDirectory() as folder:
        return foreign_binding(name, Path(folder))


ALL = [str(SUPERBIKE), *DRAWN]


def drawn_message(codec: Codec, name: str, random: Random) -> BenchMessage:
    """A message whose values its signals can hold, not only those of their steps."""
    parts = codec.parts(name)
    if isinstance(parts[0], TeethPart):
        layout = random.choice(list(Intervals))
        number, longest = parts[0].capacity()[layout]
        intervals = tuple(random.uniform(1e-5, longest) for _ in range(random.randint(1, number)))
        return ToothIntervals(layout, random.randrange(parts[0].modulo), intervals)
    values: dict[str, object] = {}
    for part in parts:
        assert isinstance(part, FieldsPart)
        values |= dict(part.constants)
        for field in part.fields:
            values[field] = drawn_value(part.slot(field), random)
    return KINDS[name](**values)


def drawn_value(slot, random: Random):
    if slot.values is not None:
        return random.choice(list(slot.values.values()))
    raw = random.randint(int(slot.low), int(slot.high))
    while raw in slot.unknown:
        raw = random.randint(int(slot.low), int(slot.high))
    if isinstance(slot.scale, int):
        return slot.value(raw)
    inside = slot.low < raw < slot.high and not slot.unknown
    return slot.value(raw + (random.uniform(-0.49, 0.49) if inside else 0.0))


def received(codec: Codec, assembly: Assembly, frames) -> dict[str, BenchMessage]:
    found = {}
    for frame in frames:
        plan = codec.plan(frame.identifier, frame.extended)
        payload = plan.check(frame.data)
        assert not isinstance(payload, FrameFault), payload
        joined = assembly.take(plan, payload, 0.0)
        assert not isinstance(joined, FrameFault), joined
        found.update({name: message for name, message, _ in joined})
    return found


@pytest.mark.parametrize("name", ALL, ids=lambda name: Path(str(name)).stem)
def test_each_message_is_received_as_it_was_sent(name):
    random = Random(f"round trip {name}")
    codec = binding_of(name).codec()
    sender, assembly = Sender(codec), Assembly(codec)
    for turn in range(8):
        sent, frames = {}, []
        for key in codec.placement:
            sent[key] = drawn_message(codec, key, random)
            frames += sender.frames(sent[key], name=key)
        got = received(codec, assembly, frames)
        for key, message in sent.items():
            if key in got:
                assert_same(codec, key, message, got[key])
        assert got.keys() == sent.keys() or turn == 0  # a frame waits for all of its messages


def assert_same(codec: Codec, name: str, sent: BenchMessage, got: BenchMessage) -> None:
    if isinstance(sent, ToothIntervals):
        step = 0.5 * codec.parts(name)[0]._slots[sent.layout][0].scale
        assert (got.layout, got.tooth_count) == (sent.layout, sent.tooth_count)
        assert got.intervals == pytest.approx(sent.intervals, abs=1.01 * step)
        return
    slots = {field: part.slot(field) for part in codec.parts(name) for field in part.fields}
    for each in fields(sent):
        one, other = getattr(sent, each.name), getattr(got, each.name)
        if each.name not in slots:
            assert one == other or (math.isnan(one) and math.isnan(other))
            continue
        step = 0.5 * abs(slots[each.name].scale)
        if each.name == "time" and len(codec.carriers(name)) > 1:
            continue  # a message of several frames has no time of its own
        assert other == pytest.approx(one, abs=1.01 * step), f"{name}.{each.name}"


@pytest.mark.parametrize("name", ALL, ids=lambda name: Path(str(name)).stem)
def test_a_damaged_frame_is_a_fault_where_a_checksum_protects_it(name):
    random = Random(f"damage {name}")
    codec = binding_of(name).codec()
    sender = Sender(codec)
    frames = [
        frame
        for key in [*codec.placement] * 2
        for frame in sender.frames(drawn_message(codec, key, random), name=key)
    ]
    for frame in frames:
        plan = codec.plan(frame.identifier, frame.extended)
        protection = plan.message.protection
        if protection is None or (protection.profile == 0 and protection.checksum is None):
            continue
        wrong = bytearray(frame.data)
        bit = random.randrange(8 * plan.message.length)
        wrong[bit // 8] ^= 1 << bit % 8
        fault = plan.check(wrong)
        assert isinstance(fault, FrameFault)
        assert (fault.fault, fault.message) == (Fault.CRC, plan.message.name)
        short = plan.check(frame.data[: plan.message.length - 1])
        assert isinstance(short, FrameFault)
        assert short.fault == Fault.SHORT


def test_a_binding_of_our_own_names_gives_our_own_frames():
    """Bit for bit, and the same values of the same frames."""
    random = Random("own")
    own = Codec(load_database(MOTORBIKE))
    bound = read_binding(MOTORBIKE_ROLES).codec()
    assert bound.placement.keys() == own.placement.keys()
    ours, theirs = Sender(own), Sender(bound)
    for _ in range(30):
        for key in own.placement:
            message = drawn_message(own, key, random)
            one, other = (sender.frames(message, name=key) for sender in (ours, theirs))
            assert one == other
            for frame in one:
                assert own.decode(*frame) == bound.decode(*frame)


def test_every_random_payload_has_one_meaning_in_both():
    random = Random("payloads of both")
    own = Codec(load_database(MOTORBIKE))
    bound = read_binding(MOTORBIKE_ROLES).codec()
    for _ in range(400):
        plan = random.choice(list(own.plans.values()))
        payload = bytearray(random.randbytes(plan.message.length))
        if plan.guard:
            plan.guard.protect(payload, random.randrange(15))
        one, other = (c.decode(plan.message.identifier, payload) for c in (own, bound))
        if isinstance(one, FrameFault):
            assert replace(one, expected="", found="") == replace(other, expected="", found="")
        else:
            assert one == other
