"""Laws of signals in frames: bit for bit as cantools lays them out, and back within half a step."""

import math
import struct
from dataclasses import replace
from random import Random

import cantools.database.can as can
import pytest
from cantools.database.conversion import BaseConversion
from hypothesis import assume, given
from hypothesis import strategies as st

from slipbench.protocol.codec.assembly import Assembly
from slipbench.protocol.codec.codec import Codec, Sender
from slipbench.protocol.codec.faults import Fault, FrameFault
from slipbench.protocol.codec.messages import (
    Authority,
    ChassisStatus,
    EngineStatus,
    RiderControls,
    ThrottleStatus,
    WheelSpeed,
)
from slipbench.protocol.codec.placement import SignalAt
from slipbench.protocol.codec.slot import Slot, slot
from slipbench.protocol.database.database import describe
from slipbench.protocol.database.layout import Database, Message, Signal
from slipbench.protocol.errors import InputError

UNITS = {"": ("", 1.0, 0.0), "%": ("", 0.01, 0.0), "km/h": ("m/s", 1 / 3.6, 0.0)}
UNITS |= {"rpm": ("rad/s", math.pi / 30, 0.0), "degC": ("K", 1.0, 273.15), "ms": ("s", 1e-3, 0.0)}


def theirs(name: str, at: int, length: int, big: bool, **more) -> can.Signal:
    """A signal of cantools whose first bit, in its byte order, is bit `at` of the frame."""
    conversion = BaseConversion.factory(
        more.pop("scale", 1), more.pop("offset", 0), None, more.pop("is_float", False)
    )
    start = 8 * (at // 8) + 7 - at % 8 if big else at
    order = "big_endian" if big else "little_endian"
    return can.Signal(name, start, length, order, conversion=conversion, **more)


@st.composite
def drawn(draw) -> can.Signal:
    """A signal of any layout that a classic frame holds."""
    is_float = draw(st.booleans()) and draw(st.booleans())
    length = draw(st.sampled_from([16, 32, 64]) if is_float else st.integers(1, 40))
    return theirs(
        "s",
        draw(st.integers(0, 64 - length)),
        length,
        draw(st.booleans()),
        is_float=is_float,
        is_signed=is_float or draw(st.booleans()),
        scale=draw(st.sampled_from([1, 0.1, 0.25, -0.5, 0.0078125, 3])),
        offset=draw(st.sampled_from([0, -40, 12.5, 100])),
        unit=draw(st.sampled_from(sorted(UNITS))),
    )


def framed(*signals: can.Signal) -> tuple[can.Message, Message, Database]:
    message = can.Message(0x123, "Frame", 8, list(signals), strict=False)
    ours = describe(message)
    return message, ours, Database("made.dbc", "", (ours,))


def words(payload: bytes) -> tuple[int, int]:
    return int.from_bytes(payload, "little"), int.from_bytes(payload, "big")


def payload_of(made: Slot, value: float) -> bytes:
    return made.pack(value).to_bytes(8, "big" if made.big else "little")


@given(signal=drawn(), data=st.data())
def test_a_slot_packs_and_reads_as_cantools_does(signal, data):
    message, ours, database = framed(signal)
    made = slot(database, ours, "s", float)
    layout = ours.signal("s")
    _, slope, zero = UNITS[signal.unit]
    if signal.is_float:
        raw = data.draw(st.floats(-60000, 60000, width=16))
    else:
        raw = data.draw(st.integers(*layout.raw_range))
    expected = message.encode({"s": raw}, scaling=False, strict=False)
    physical = raw * layout.scale + layout.offset
    si = physical * slope + zero
    step = abs(layout.scale * slope)
    back = made.read(words(expected))
    assert back == raw
    assert made.value(back) == pytest.approx(si, rel=1e-12, abs=1e-9)
    if signal.is_float:
        assert made.value(made.read(words(payload_of(made, si)))) == pytest.approx(
            si, rel=2e-3, abs=1e-3 * step + 1e-6
        )
    else:
        assert payload_of(made, si) == expected
        assert payload_of(made, si + 0.49 * step * data.draw(st.sampled_from([-1, 1]))) == expected


@given(signal=drawn(), raw=st.integers(0, 100), sign=st.sampled_from([1, -1]), data=st.data())
def test_a_binding_converts_as_it_says(signal, raw, sign, data):
    """Value = sign * scale * SI(value) + offset, and back to the same bits."""
    message, ours, database = framed(signal)
    layout = ours.signal("s")
    assume(signal.is_float or layout.raw_range[1] >= raw)
    factor, offset = data.draw(st.sampled_from([1.0, 0.3, 2.0])), data.draw(st.sampled_from([0, 5]))
    to, slope, zero = UNITS[signal.unit]
    at = SignalAt("Frame", "s", to=to, sign=sign, radius=factor, offset=offset)
    made = slot(database, ours, "s", float, at)
    payload = message.encode({"s": raw}, scaling=False, strict=False)
    value = sign * factor * ((raw * layout.scale + layout.offset) * slope + zero) + offset
    assert made.value(made.read(words(payload))) == pytest.approx(value, rel=1e-9, abs=1e-9)
    again = made.read(words(payload_of(made, value)))
    assert again == (pytest.approx(raw, rel=2e-3, abs=2e-2) if signal.is_float else raw)


@given(signal=drawn(), value=st.floats())
def test_a_value_is_sent_within_half_a_step_or_refused(signal, value):
    """Never a wrapped number, an infinity, or what is no number."""
    _, ours, database = framed(signal)
    made = slot(database, ours, "s", float)
    try:
        sent = payload_of(made, value)
    except ValueError:
        return
    raw = made.read(words(sent))
    assert raw is not None
    step = abs(made.scale)
    error = 2e-3 * abs(value - made.offset) if made.real else 0.5 * step * (1 + 1e-6)
    assert made.value(raw) == pytest.approx(value, abs=error + 1e-3 * step + 1e-9 * abs(value))


LIMITED = Signal("s", 0, 12, scale=0.1, offset=-20, minimum=-10.0, maximum=150.0, unit="%")


@pytest.mark.parametrize("is_float", [False, True])
@pytest.mark.parametrize("scale", [0.1, -0.1])
def test_limits_of_the_database_hold_for_sent_and_received_values(is_float, scale):
    signal = replace(
        LIMITED, scale=scale, is_float=is_float, length=32 if is_float else 13, signed=True
    )
    made = slot_of(signal, SignalAt("Frame", "s", to=""))
    for value in (-0.1, 0.0, 0.333, 1.5):
        raw = made.read(words(payload_of(made, value)))
        assert made.low <= raw <= made.high
    for value in (-0.13, 1.53):
        with pytest.raises(ValueError, match=rf"Frame.s = {value} is not in -0\.1 to 1\.5"):
            made.pack(value)


def test_narrow_limits_of_a_float_hold_what_lies_between():
    signal = Signal("s", 0, 32, is_float=True, signed=True, minimum=0.25, maximum=0.75)
    made = slot_of(signal, None)
    for value in (0.25, 0.5, 0.75):
        assert made.low <= made.read(words(payload_of(made, value))) <= made.high


@pytest.mark.parametrize("limit", [2000.3, 0.0003, 7e6 + 0.3])
def test_a_float_at_its_limit_is_received_as_the_wire_rounds_it_and_a_little_more_is_not(limit):
    signal = Signal("s", 0, 32, is_float=True, signed=True, minimum=-limit, maximum=limit)
    made = slot_of(signal, None)
    for value in (-limit, limit):
        assert made.low <= made.read(words(payload_of(made, value))) <= made.high
        assert not made.low <= made.read(words(struct.pack("<f", 1.00001 * value))) <= made.high


def test_a_float_without_limits_is_as_large_as_it_wants():
    made = slot_of(Signal("s", 0, 32, is_float=True, signed=True), None)
    for value in (-1e30, 0.0, 1e30):
        assert made.low <= made.read(words(payload_of(made, value))) <= made.high


def slot_of(signal: Signal, at: SignalAt | None, kind: type = float) -> Slot:
    message = Message("Frame", 1, 8, (signal,))
    return slot(Database("made.dbc", "", (message,)), message, signal.name, kind, at)


@pytest.mark.parametrize("scale", [0.1, 0.01, 0.3, 1.7])
def test_an_unknown_value_is_known_by_what_the_database_shows_of_it(scale):
    """Every raw value, as its physical value is written: scale * raw is rarely a round number."""
    for raw in range(256):
        shown = float(f"{raw * scale - 40:.9g}")
        signal = Signal("s", 0, 8, scale=scale, offset=-40)
        made = slot_of(signal, SignalAt("Frame", "s", to="", unknown=(shown,)))
        assert made.read(words(bytes([raw] + 7 * [0]))) is None
        assert made.read(words(bytes([raw ^ 1] + 7 * [0]))) == raw ^ 1


@pytest.mark.parametrize(("length", "code"), [(32, "<f"), (64, "<d")])
def test_a_float_is_known_unless_it_is_no_number_or_means_unknown(length, code):
    """As the wire rounds it: -0.1 is no float of 32 bits."""
    signal = Signal("s", 0, length, is_float=True, signed=True)
    made = slot_of(signal, SignalAt("Frame", "s", to="", unknown=(-0.1, 250.0)))

    def payload(number: float) -> tuple[int, int]:
        return words(struct.pack(code, number).ljust(8, b"\0"))

    for number in (math.nan, math.inf, -math.inf, -0.1, 250.0):
        assert made.read(payload(number)) is None
    for number in (0.0, 0.125, -0.09375, 250.25, -250.0):
        assert made.read(payload(number)) == number
        assert made.shown(payload(number)) == f"{number:g}"
    assert made.shown(payload(math.nan)) == "nan"


def test_a_signed_raw_value_is_shown_in_si():
    made = slot_of(Signal("s", 4, 4, signed=True, scale=0.5, offset=1), None)
    for raw in range(-8, 8):
        assert made.shown(((raw & 0xF) << 4, 0)) == f"{0.5 * raw + 1:g}"


@pytest.mark.parametrize(
    ("name", "field", "wraps"),
    [
        ("time", "", True),
        ("tick", "", True),
        ("speed", "", False),
        ("t", "time", True),
        ("time", "speed", False),
    ],
)
def test_a_clock_wraps_by_the_field_that_it_is(name, field, wraps):
    message = Message("Frame", 1, 8, (Signal(name, 0, 8),))
    database = Database("made.dbc", "", (message,))
    assert slot(database, message, name, float, field=field).wraps is wraps
    if not field:
        assert slot(database, message, name, float).wraps is wraps


def test_a_whole_number_has_sign_and_offset_of_its_binding():
    """A gear that is sent as gear + 1, say; the recording converts in the same way. It has no unit."""
    at = SignalAt("Frame", "s", offset=-1)
    made = slot_of(Signal("s", 0, 4, unit="gear"), at, int)
    assert [made.value(raw) for raw in range(4)] == [-1, 0, 1, 2]
    assert made.pack(2) == 3


def test_the_unit_of_a_binding_is_in_place_of_the_database_s():
    for unit in ("", "m/s"):
        made = slot_of(Signal("s", 0, 8, unit=unit), SignalAt("Frame", "s", unit="km/h", to="m/s"))
        assert made.value(36) == pytest.approx(10.0)
    with pytest.raises(InputError, match=r"^made\.dbc: Frame\.s: the unit 'rpm' does not suit"):
        slot_of(Signal("s", 0, 8, unit="rpm"), SignalAt("Frame", "s", to="m/s"))


@pytest.mark.parametrize("kind", [bool, Authority])
@pytest.mark.parametrize("change", [{"sign": -1}, {"offset": 1.0}, {"radius": 2.0}])
def test_a_flag_has_no_sign_scale_or_offset(kind, change):
    """An inverted button would be read upright."""
    signal = Signal("s", 0, 1 if kind is bool else 2)
    with pytest.raises(InputError, match=r"made.dbc: Frame.s: .*no sign, scale or offset") as no:
        slot_of(signal, SignalAt("Frame", "s", **change), kind)
    assert "values" in str(no.value)


def test_values_give_each_raw_value_its_meaning():
    made = slot_of(Signal("s", 0, 3), SignalAt("Frame", "s", values={0: 1, 5: 0}), bool)
    assert made.value(0) is True
    assert made.value(5) is False
    assert made.read((1, 0)) is None
    assert (made.pack(True), made.pack(False)) == (0, 5)
    assert [made.shown((raw, 0)) for raw in range(8)] == list("01234567")
    assert made.expected == "0 to 7 (SI)"


@pytest.mark.parametrize(
    ("kind", "values", "says", "expected"),
    [
        (bool, {0: 0, 8: 1}, "raw value 8, which the signal cannot hold", "0 to 7"),
        (bool, {0: 0, 1: 2}, "the meaning 2, which this role does not have", "0 false, 1 true"),
        (Authority, {0: 0, 1: 7}, "the meaning 7", "0 none, 1 throttle, 2 spark, 3 both"),
        (int, {-1: 2}, "raw value -1", "0 to 7"),
    ],
)
def test_values_that_cannot_be_are_refused(kind, values, says, expected):
    with pytest.raises(InputError, match=rf"^made\.dbc: Frame\.s: .*{says}(?s:.)*: {expected}$"):
        slot_of(Signal("s", 0, 3), SignalAt("Frame", "s", values=values), kind)


@pytest.mark.parametrize("pages", [1, 2])
def test_multiplexed_fields_are_sent_and_received_page_by_page(pages):
    """cantools decodes each frame; a message of several pages comes when each has come."""
    controls = {"front_brake": (1, "bar"), "rear_brake": (pages, "bar")}
    signals = [
        theirs("page", 0, 4, True, is_multiplexer=True),
        *(
            theirs(
                name,
                8 + 16 * (number if pages == 1 else 0),
                16,
                number == 0,
                scale=0.01,
                unit=unit,
                multiplexer_ids=[page],
                multiplexer_signal="page",
            )
            for number, (name, (page, unit)) in enumerate(controls.items())
        ),
        theirs("button", 56, 1, False),
        theirs("grip", 40, 10, False, scale=0.1, unit="%"),
        theirs("clutch", 50, 6, False, scale=2, unit="%"),
    ]
    message, _, database = framed(*signals)
    names = ("button", "grip", "front_brake", "rear_brake", "clutch")
    at = {name: SignalAt("Frame", name, to=None) for name in names}
    codec = Codec(database, {"RiderControls": at})
    controls = RiderControls(True, 0.25, 12.34e5, 56.78e5, 0.5)
    frames = Sender(codec).frames(controls)
    assert len(frames) == pages
    decoded = [message.decode(frame.data) for frame in frames]
    assert {each["page"] for each in decoded} == set(range(1, pages + 1))
    assert {key: value for each in decoded for key, value in each.items()} == pytest.approx(
        {"page": pages, "front_brake": 12.34, "rear_brake": 56.78}
        | {"button": 1, "grip": 25.0, "clutch": 50}
    )
    assembly = Assembly(codec)
    plan = codec.plan(0x123)
    found = []
    for time, frame in enumerate(frames):
        assert not found
        found = assembly.take(plan, bytearray(frame.data), float(time))
    ((name, received, time),) = found
    assert (name, time) == ("RiderControls", 0.0)
    assert [getattr(received, key) for key in names] == pytest.approx(
        [getattr(controls, key) for key in names]
    )
    other = bytearray(b"\xf0" + bytes(7))  # a page without a role
    assert all(each.name == "RiderControls" for each in plan.parts)
    joined = assembly.take(plan, other, 5.0)
    assert all(time <= 1.0 for _, _, time in joined)  # the brakes are as old as they were


def test_pages_of_a_cyclic_message_take_turns():
    signals = [
        theirs("page", 0, 2, False, is_multiplexer=True),
        *(theirs(f"{end}_travel", 8, 16, False, scale=0.1, unit="mm") for end in ("front", "rear")),
    ]
    for page, signal in enumerate(signals[1:]):
        signal.multiplexer_ids, signal.multiplexer_signal = [page], "page"
    message, ours, _ = framed(*signals)
    database = Database("made.dbc", "", (replace(ours, cycle_time=0.01),))
    at = {key: SignalAt("Frame", key) for key in ("front_travel", "rear_travel")}
    sender = Sender(Codec(database, {"ChassisStatus": at}))
    sent = [
        (tick, message.decode(frame.data)["page"])
        for tick in range(40)
        for frame in sender.frames(ChassisStatus(0.01, 0.02), now=tick * 1e-3)
    ]
    assert sent == [(0, 0), (10, 1), (20, 0), (30, 1)]


def test_a_message_of_several_frames_is_as_old_as_its_oldest_field():
    one = Message("One", 1, 2, (Signal("rpm", 0, 16, scale=0.25, unit="rpm"),))
    two = Message("Two", 2, 1, (Signal("gear", 0, 4),))
    codec = Codec(
        Database("made.dbc", "", (one, two)),
        {
            "EngineStatus": {
                "engine_speed": SignalAt("One", "rpm", to="rad/s"),
                "gear": SignalAt("Two", "gear"),
                "spark_advance": 0.5,
                "time": math.nan,
            }
        },
    )
    status = EngineStatus(1000.0, 3, 0.5, math.nan)
    first, second = Sender(codec).frames(status)
    assembly = Assembly(codec)

    def take(frame, time):
        return assembly.take(codec.plan(frame.identifier), bytearray(frame.data), time)

    assert take(first, 1.0) == []
    ((_, joined, oldest),) = take(second, 2.0)
    assert (joined.gear, joined.spark_advance, oldest) == (3, 0.5, 1.0)
    assert joined.engine_speed == pytest.approx(1000.0, abs=0.125 * math.pi / 30)
    assert take(second, 3.0)[0][2] == 1.0
    assert take(first, 4.0)[0][2] == 3.0


def test_a_message_of_several_frames_has_no_time_of_its_own():
    one = Message("One", 1, 4, (Signal("rpm", 0, 16, unit="rpm"), Signal("t", 16, 16, unit="ms")))
    two = Message("Two", 2, 1, (Signal("gear", 0, 4),))
    at = {
        "engine_speed": SignalAt("One", "rpm", to="rad/s"),
        "gear": SignalAt("Two", "gear"),
        "spark_advance": 0.5,
        "time": SignalAt("One", "t", to="s"),
    }
    codec = Codec(Database("made.dbc", "", (one, two)), {"EngineStatus": at})
    assembly = Assembly(codec)
    # the clock wraps, as each clock does, whatever its signal is called
    for frame in Sender(codec).frames(EngineStatus(1000.0, 3, 0.5, 1e5)):
        joined = assembly.take(codec.plan(frame.identifier), bytearray(frame.data), 1.0)
    ((_, status, _),) = joined
    assert math.isnan(status.time)


def test_another_page_than_that_of_a_message_holds_nothing_of_it():
    page = Signal("page", 0, 2, is_multiplexer=True)
    speed = Signal("v", 8, 8, unit="m/s", multiplexer="page", multiplexer_ids=(1, 2))
    database = Database("made.dbc", "", (Message("Wheel", 1, 2, (page, speed)),))
    codec = Codec(database, {"RearWheelSpeed": {"speed": SignalAt("Wheel", "v", to="m/s")}})
    (frame,) = Sender(codec).frames(WheelSpeed(7.0), name="RearWheelSpeed")
    assert frame.data == b"\x01\x07"
    assembly, plan = Assembly(codec), codec.plan(1)
    for number in range(4):
        found = assembly.take(plan, bytearray((number, 7)), 1.0)
        assert found == ([("RearWheelSpeed", WheelSpeed(7.0), 1.0)] if number in (1, 2) else [])


def both(valid: str = "") -> Codec:
    """Engine and throttle body in one frame."""
    message = Message(
        "Both",
        7,
        6,
        (
            Signal("rpm", 0, 16, scale=0.25, unit="rpm"),
            Signal("gear", 16, 4),
            Signal("fault", 20, 1),
            Signal("owner", 21, 1),
            Signal("ok", 22, 1),
            Signal("pos", 24, 16, scale=0.01, unit="%"),
        ),
    )
    own = {"motor_current": math.nan, "time": math.nan}
    return Codec(
        Database("made.dbc", "", (message,)),
        {
            "EngineStatus": {
                "engine_speed": SignalAt("Both", "rpm", to="rad/s", valid=valid),
                "gear": SignalAt("Both", "gear", unknown=(15.0,)),
                "spark_advance": math.nan,
                "time": math.nan,
            },
            "ThrottleStatus": {
                "authority": SignalAt("Both", "owner", values={0: 0, 1: 1}),
                "position": SignalAt("Both", "pos", to=""),
                "faulty": SignalAt("Both", "fault"),
                **own,
            },
        },
    )


THROTTLE = ThrottleStatus(Authority.THROTTLE, 0.25, math.nan, False, math.nan)
ENGINE = EngineStatus(900.0, 4, math.nan, math.nan)


def test_a_frame_of_several_messages_is_sent_when_it_is_whole():
    codec = both()
    sender = Sender(codec)
    assert sender.frames(ENGINE) == []
    (frame,) = sender.frames(THROTTLE)
    found = Assembly(codec).take(codec.plan(7), bytearray(frame.data), 1.5)
    received = {name: (message, time) for name, message, time in found}
    engine, time = received["EngineStatus"]
    assert (engine.gear, time) == (4, 1.5)
    assert engine.engine_speed == pytest.approx(900.0, abs=0.125 * math.pi / 30)
    throttle, _ = received["ThrottleStatus"]
    assert (throttle.authority, throttle.position, throttle.faulty) == (1, 0.25, False)


def test_values_that_mean_unknown_or_not_valid_are_faults_that_name_the_signal():
    codec = both(valid="ok")
    sender = Sender(codec)
    sender.frames(THROTTLE)
    (frame,) = sender.frames(ENGINE)
    assembly, plan = Assembly(codec), codec.plan(7)
    found = assembly.take(plan, bytearray(frame.data), 1.0)
    (engine,) = (message for _, message, _ in found if isinstance(message, EngineStatus))
    assert engine.engine_speed == pytest.approx(900.0, abs=0.125 * math.pi / 30)
    assert engine.gear == 4
    for bits, signal in (((2, 0x0F), "gear"), ((2, 0x40), "engine_speed")):
        payload = bytearray(frame.data)
        payload[bits[0]] ^= payload[bits[0]] & bits[1] if signal != "gear" else 0
        payload[bits[0]] |= bits[1] if signal == "gear" else 0
        fault = assembly.take(plan, payload, 2.0)
        assert isinstance(fault, FrameFault)
        assert (fault.fault, fault.signal) == (Fault.RANGE, signal)
        assert fault.message == "EngineStatus"
    assert (fault.expected, fault.found) == ("a valid value", "not valid")


def test_an_authority_that_a_signal_cannot_show_is_shown_as_the_rest_of_it():
    codec = both()
    for held, shown in ((Authority.BOTH, Authority.THROTTLE), (Authority.SPARK, Authority.NONE)):
        sender = Sender(codec)
        sender.frames(ENGINE)
        (frame,) = sender.frames(replace(THROTTLE, authority=held))
        found = Assembly(codec).take(codec.plan(7), bytearray(frame.data), 0.0)
        assert [m.authority for _, m, _ in found if isinstance(m, ThrottleStatus)] == [shown]


def test_random_payloads_never_raise():
    """Whatever a bus carries: values or a fault that says where."""
    random = Random("payloads")
    codec = both(valid="ok")
    assembly = Assembly(codec)
    for _ in range(500):
        found = assembly.take(codec.plan(7), bytearray(random.randbytes(6)), 0.0)
        assert isinstance(found, FrameFault) or len(found) == 2
