"""The FMU as a node of a CAN network: frames carry its variables, and commands in frames act."""

import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from slipbench.fmu_bus import bind_bus, read_bus, require_bus, words
from slipbench.fmu_check import require_valid
from slipbench.identification.mismatch.callables.fmu.fmu_system import open_fmu
from slipbench.plant.fmu.bus import Bus
from slipbench.plant.fmu.explaining import OUTPUTS, file_beside
from slipbench.plant.fmu.export import write_fmu
from slipbench.plant.fmu.model import FmuModel
from slipbench.plant.motorcycle import Motorcycle
from slipbench.protocol.codec.protection import guard_of
from slipbench.protocol.codec.slot import slot
from slipbench.protocol.configuration import read_toml
from slipbench.protocol.database.database import load_database
from slipbench.protocol.database.layout import Checksum, Database, Message, Protection, Signal
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.role_map import RoleMap
from slipbench.protocol.shipped_files import file_or_shipped
from tests.plant.fmu.conftest import Slave

TICK = 1e-3  # s
OWN = file_or_shipped("motorbike_roles", "role map")
FORMAT_ERROR, TRANSMIT, TRANSMIT_FD, CONFIRM, CONFIGURATION = 1, 0x10, 0x11, 0x20, 0x40
Frames = dict[int, bytes]


class Node(Slave):
    """An instance whose terminal is connected to a master with events."""

    def begin(self) -> None:
        self.slave.instantiate(eventModeUsed=True, logMessage=self._keep)

    def event(self, received: bytes = b"", send: bool = True) -> bytes:
        """One event: the clocks tick, operations are exchanged; returns what was sent."""
        self.slave.enterEventMode()
        if received:
            self.slave.setClock([self.references["CAN.Rx_Clock"]], [True])
            self.slave.setBinary([self.references["CAN.Rx_Data"]], [received])
        sent = b""
        if send:
            self.slave.setClock([self.references["CAN.Tx_Clock"]], [True])
            sent = self.slave.getBinary([self.references["CAN.Tx_Data"]])[0]
        self.slave.updateDiscreteStates()
        self.slave.enterStepMode()
        return sent


def operations(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield code and arguments of each operation."""
    while data:
        code, length = struct.unpack_from("<II", data)
        yield code, data[8:length]
        data = data[length:]


def frames(data: bytes) -> Frames:
    """Payload of each transmitted frame by its identifier."""
    found = {}
    for code, arguments in operations(data):
        if code in (TRANSMIT, TRANSMIT_FD):
            head = 8 if code == TRANSMIT else 9
            identifier = struct.unpack_from("<I", arguments)[0]
            assert struct.unpack_from("<H", arguments, head - 2)[0] == len(arguments) - head
            found[identifier] = arguments[head:]
    return found


def transmit(message: Message, payload: bytes) -> bytes:
    flags = bytes((message.extended, 0, 0) if message.fd else (message.extended, 0))
    arguments = struct.pack("<I", message.identifier) + flags + struct.pack("<H", len(payload))
    return operation(TRANSMIT_FD if message.fd else TRANSMIT, arguments + payload)


def operation(code: int, arguments: bytes) -> bytes:
    return struct.pack("<II", code, 8 + len(arguments)) + arguments


def payload(
    database: Database, name: str, values: Mapping[str, float], counter: int = 0
) -> bytearray:
    """Payload of values in SI by signal, protected."""
    message = database.by_name[name]
    words = [0, 0]
    for signal, value in values.items():
        at = slot(database, message, signal, float)
        words[at.big] |= at.pack(value)
    little, big = (
        word.to_bytes(message.length, order)
        for word, order in zip(words, ("little", "big"), strict=True)
    )
    made = bytearray(a | b for a, b in zip(little, big, strict=True))
    guard = guard_of(message)
    if guard is not None:
        guard.protect(made, counter)
    return made


def value(database: Database, name: str, signal: str, data: bytes) -> tuple[float, float]:
    """Value of a signal in SI, and one raw step of it."""
    at = slot(database, database.by_name[name], signal, float)
    raw = at.read((int.from_bytes(data, "little"), int.from_bytes(data, "big")))
    assert raw is not None
    return at.value(raw), abs(at.scale)


@pytest.fixture(scope="session")
def database() -> Database:
    return load_database(OWN.parent / "motorbike.dbc")


@pytest.fixture(scope="session")
def own(headers: Path, model: FmuModel, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The demonstration motorcycle on its own database."""
    path = tmp_path_factory.mktemp("bus") / "own.fmu"
    write_fmu(path, model, 3, headers, read_bus(OWN, model.motorcycle).bus)
    return path


@pytest.fixture
def node(own: Path, tmp_path: Path) -> Iterator[Node]:
    one = Node(own, tmp_path / "node")
    one.initialize()
    yield one
    one.slave.freeInstance()


def command(database: Database, throttle: float, spark: float = 0.0, counter: int = 0) -> bytes:
    values = {"throttle_command": throttle, "spark_command": spark}
    made = payload(database, "EcuStatus", values, counter)
    return transmit(database.by_name["EcuStatus"], bytes(made))


def test_it_is_valid_and_describes_the_terminal(own: Path) -> None:
    require_valid(own)


def test_explain_reads_it_as_one_without_frames(own: Path, model: FmuModel) -> None:
    """Nothing is connected to the bus then: its clocks do not tick."""
    beside = own.with_suffix(".toml")
    beside.write_text(file_beside(model, {"body_mass": 5.0}), encoding="utf-8")
    plan = open_fmu(beside).plan
    assert {port.name for port in plan.outputs} >= set(OUTPUTS)


def test_frames_carry_the_outputs_at_their_cycle_times(node: Node, database: Database) -> None:
    """In each frame the value of the variable at that moment, rounded as the database does."""
    count = dict.fromkeys(("ThrottleStatus", "OpticalSpeed", "EngineStatus"), 0)
    shown = {
        "ThrottleStatus": ("position", "throttle"),
        "OpticalSpeed": ("speed", "optical_speed"),
        "EngineStatus": ("engine_speed", "engine_speed"),
    }
    for k in range(60):
        sent = frames(node.event())
        for name, (signal, variable) in shown.items():
            message = database.by_name[name]
            cycle = round((message.cycle_time or 0.0) / TICK)
            assert (message.identifier in sent) == (k % cycle == 0)
            if message.identifier in sent:
                data = sent[message.identifier]
                guard = guard_of(message)
                assert guard is not None
                assert guard.intact(bytearray(data))
                assert guard.counter(data) == count[name] % guard.period
                count[name] += 1
                found, step = value(database, name, signal, data)
                assert found == pytest.approx(node.get(variable), abs=0.51 * step)
                time, step = value(database, name, "time", data)
                assert time == pytest.approx(k * TICK, abs=0.51 * step)
        node.step(k * TICK, TICK)


def test_commands_in_frames_act_as_those_at_inputs(
    node: Node, own: Path, database: Database, tmp_path: Path, model: FmuModel
) -> None:
    other = Slave(own, tmp_path / "other")
    other.initialize()
    for k in range(100):
        throttle = round(model.command + 0.05 * np.sin(0.1 * k), 4)
        spark = np.deg2rad(round(50.0 * np.sin(0.2 * k)) * 0.02)
        node.event(command(database, throttle, spark, k % 15))
        other.set("throttle_command", throttle)
        other.set("spark", spark)
        for one in (node, other):
            one.step(k * TICK, TICK)
        for name in ("throttle", "engine_speed", "slip"):
            assert node.get(name) == pytest.approx(other.get(name), rel=1e-12)
    other.slave.freeInstance()


def test_the_bit_rate_is_sent_once(
    headers: Path, model: FmuModel, tmp_path: Path, database: Database
) -> None:
    bus = replace(read_bus(OWN, model.motorcycle).bus, bitrate=500_000)
    write_fmu(tmp_path / "rate.fmu", model, 3, headers, bus)
    one = Node(tmp_path / "rate.fmu", tmp_path / "rate")
    one.initialize()
    first = [a for code, a in operations(one.event()) if code == CONFIGURATION]
    assert first == [bytes([1]) + struct.pack("<I", 500_000)]
    one.step(0.0, TICK)
    assert CONFIGURATION not in dict(operations(one.event()))
    one.slave.freeInstance()


def test_a_frame_with_a_wrong_checksum_or_length_is_ignored_and_said(
    node: Node, database: Database
) -> None:
    before = node.get("throttle_command")
    message = database.by_name["EcuStatus"]
    data = payload(database, "EcuStatus", {"throttle_command": 0.5, "spark_command": 0.0})
    wrong = bytes([data[0] ^ 1]) + bytes(data[1:])
    node.event(transmit(message, wrong))
    assert "EcuStatus is ignored: wrong checksum" in node.said[-1]
    node.event(transmit(message, bytes(data[:6])), send=False)
    assert "EcuStatus is ignored: it has 6 bytes of 8" in node.said[-1]
    assert node.get("throttle_command") == before


def test_other_frames_and_operations_are_ignored(node: Node, database: Database) -> None:
    before = node.get("throttle_command")
    unknown = operation(CONFIRM, struct.pack("<I", 32)) + operation(0x99, b"abc")
    foreign = transmit(replace(database.by_name["EcuStatus"], identifier=0x700), bytes(8))
    extended = transmit(replace(database.by_name["EcuStatus"], extended=True), bytes(8))
    node.event(unknown + foreign + extended)
    assert node.get("throttle_command") == before
    assert not node.said


@pytest.mark.parametrize("rest", [b"\x10", operation(TRANSMIT, b"\0" * 8)[:-1], b"\x10" + bytes(7)])
def test_what_cannot_be_read_is_sent_back(node: Node, database: Database, rest: bytes) -> None:
    sent = node.event(command(database, 0.3) + rest)
    errors = [a for code, a in operations(sent) if code == FORMAT_ERROR]
    assert errors == [struct.pack("<H", len(rest)) + rest]
    assert node.get("throttle_command") == pytest.approx(0.3)
    assert "cannot be read" in node.said[0]


def test_frames_that_errors_leave_no_room_for_are_said(node: Node) -> None:
    """The errors wait for the next tick, and one of them nearly fills the buffer."""
    node.event(b"\x10" + bytes(4100), send=False)
    node.event()
    assert "is lost: the buffer is full" in node.said[-1]


def test_a_value_beyond_its_range_stops_it_by_name(node: Node, database: Database) -> None:
    data = payload(database, "EcuStatus", {"throttle_command": 1.0, "spark_command": 0.0})
    guard = guard_of(database.by_name["EcuStatus"])
    assert guard is not None
    data[2] = data[3] = 0xFF  # all bits of the throttle: 163.83 %
    guard.protect(data, 0)
    with pytest.raises(Exception, match="rror"):
        node.event(transmit(database.by_name["EcuStatus"], bytes(data)))
    assert "CAN signal EcuStatus.throttle_command" in node.said[-1]


def test_a_tick_that_is_left_out_or_misplaced_is_said(node: Node) -> None:
    node.event()
    node.step(0.0, 3 * TICK)
    node.event()
    assert "was not active at 0.001 s: frames are lost" in node.said[-1]
    node.step(3 * TICK, 0.25 * TICK)
    with pytest.raises(Exception, match="rror"):
        node.event()
    assert "is active at 0.00325 s: it ticks every 0.001 s" in node.said[-1]


def test_a_restored_state_sends_the_same_frames(node: Node) -> None:
    node.event()
    node.step(0.0, TICK)
    kept = node.slave.getFMUState()

    def go_on() -> list[bytes]:
        sent = []
        for k in range(1, 20):
            sent.append(node.event())
            node.step(k * TICK, TICK)
        return sent

    first = go_on()
    node.slave.setFMUState(kept)
    assert go_on() == first


def odd_database() -> Database:
    """Every byte order, width, number and protection that a frame may have."""

    def message(number: int, protection: Protection | None, **more: Any) -> Message:
        return Message(
            f"M{number}",
            0x100 + number,
            64 if more.get("fd") else 8,
            (
                Signal("crc", 0, 8),
                Signal("counter", 8, 4),
                Signal("more", 20, 4),
                *more.pop("signals"),
            ),
            cycle_time=TICK,
            protection=protection,
            **more,
        )

    speed = {"unit": "rpm", "scale": 0.25}
    crc8 = Checksum("crc", "crc8", 0x1D, 0x3C, 0xA5)
    kinds = [
        (None, [Signal("speed", 39, 20, little_endian=False, **speed)]),
        (Protection(1, 0x1234), [Signal("speed", 25, 17, **speed)]),
        (
            Protection(2, data_ids=bytes(range(3, 19))),
            [Signal("speed", 24, 32, is_float=True, unit="rad/s")],
        ),
        (
            Protection(5, 0xBEEF),
            [Signal("speed", 31, 32, little_endian=False, is_float=True, unit="rad/s")],
        ),
        (
            Protection(0, counter="counter", period=11),
            [Signal("speed", 40, 16, unit="rpm", offset=-100)],
        ),
        (
            Protection(0, counter="more", checksum=Checksum("crc", "xor", start=7)),
            [Signal("speed", 39, 20, little_endian=False, signed=True, **speed)],
        ),
        (
            Protection(0, checksum=Checksum("crc", "sum", final_xor=0xFF)),
            [Signal("speed", 24, 18, **speed)],
        ),
        (Protection(0, counter="counter", checksum=crc8), [Signal("speed", 24, 20, **speed)]),
    ]
    small = [message(k, rule, signals=signals) for k, (rule, signals) in enumerate(kinds)]
    double = Signal("speed", 192, 64, is_float=True, unit="rad/s")
    big = message(20, Protection(5, 7), signals=[double], fd=True, extended=True)
    return Database("odd", "", (*small, big))


@pytest.fixture(scope="module")
def odd(headers: Path, model: FmuModel, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An FMU that sends its engine speed in every frame of the odd database."""
    database = odd_database()
    frames = []
    for message in database.messages:
        roles = RoleMap(
            title="",
            roles={"engine_speed": {"signals": (f"{message.name}.speed",)}},  # type: ignore[dict-item]
        )
        bound = bind_bus(roles, database, model.motorcycle, "odd")
        frames += [f for f in bound.bus.frames if f.name == message.name]
    path = tmp_path_factory.mktemp("odd") / "odd.fmu"
    write_fmu(path, model, 3, headers, Bus("CAN", tuple(frames)))
    return path


def test_every_layout_and_protection_is_that_of_the_database(odd: Path, tmp_path: Path) -> None:
    node = Node(odd, tmp_path / "odd")
    node.initialize()
    database = odd_database()
    for k in range(20):
        sent = frames(node.event())
        assert len(sent) == len(database.messages)
        for message in database.messages:
            data, guard = sent[message.identifier], guard_of(message)
            if guard is not None:
                assert guard.intact(bytearray(data)), message.name
                if guard.period:
                    assert guard.counter(data) == k % guard.period, message.name
            found, step = value(database, message.name, "speed", data)
            step = 1e-3 if message.signal("speed").is_float else step
            assert found == pytest.approx(node.get("engine_speed"), abs=0.51 * step), message.name
        node.step(k * TICK, TICK)
    node.slave.freeInstance()


def bound(
    messages: Sequence[Message], roles: Mapping[str, Mapping[str, Any]], bike: Motorcycle
) -> Any:
    given = RoleMap.model_validate({"title": "", "roles": roles})
    return bind_bus(given, Database("d", "", tuple(messages)), bike, "roles.toml")


def test_requests_command_it_only_where_nothing_echoes_them(demonstration: Motorcycle) -> None:
    percent = {"length": 14, "unit": "%", "scale": 0.01}
    asked = Message("Asked", 1, 8, (Signal("t", 0, **percent),), cycle_time=TICK)
    echo = Message("Echo", 2, 8, (Signal("t", 0, **percent),), cycle_time=TICK)
    request, applied = {"signals": ["Asked.t"]}, {"signals": ["Echo.t"]}
    alone = bound([asked], {"throttle_request": request}, demonstration)
    assert [f.name for f in alone.bus.frames] == ["Asked"]
    both = bound(
        [asked, echo], {"throttle_request": request, "throttle_command": applied}, demonstration
    )
    assert [f.name for f in both.bus.frames] == ["Echo"]
    assert list(both.left_out) == ["Asked"]


def test_a_wheel_speed_is_the_wheels_at_its_radius(demonstration: Motorcycle) -> None:
    speed = Signal("v", 0, 16, unit="km/h", scale=0.01)
    message = Message("Wheel", 1, 8, (speed,), cycle_time=TICK)
    found = bound([message], {"rear_wheel_speed": {"signals": ["Wheel.v"]}}, demonstration)
    (signal,) = found.bus.frames[0].signals
    assert signal.variable == "rear_speed"
    radius = demonstration.rear_wheel.radius
    assert signal.scale * radius == pytest.approx(0.01 / 3.6)


def test_what_is_not_on_the_bus_is_said(demonstration: Motorcycle) -> None:
    said = "\n".join(words(read_bus(OWN, demonstration)))
    assert "sends: ThrottleStatus (throttle, time); OpticalSpeed (optical_speed, time)" in said
    assert "reads: EcuStatus (throttle_command, spark)" in said
    assert "since they hold tooth times: RearTeeth, FrontTeeth" in said
    assert "EngineStatus.spark_advance" in said
    assert "crc" not in said


@pytest.mark.parametrize(
    ("change", "sentence"),
    [({"cycle_time": None}, "states no cycle time"), ({"name": "Other"}, "no message 'Engine'")],
)
def test_a_database_that_does_not_suit_is_refused(
    demonstration: Motorcycle, change: dict[str, Any], sentence: str
) -> None:
    message = Message("Engine", 1, 8, (Signal("n", 0, 16, unit="rpm"),), cycle_time=TICK)
    with pytest.raises(InputError, match=sentence):
        bound(
            [replace(message, **change)], {"engine_speed": {"signals": ["Engine.n"]}}, demonstration
        )


def test_a_role_map_without_the_motorcycle_is_refused(demonstration: Motorcycle) -> None:
    message = Message("Heat", 1, 8, (Signal("t", 0, 16, unit="degC"),), cycle_time=TICK)
    with pytest.raises(InputError, match="no message of the role map has a role of the motorcycle"):
        bound([message], {"coolant_temperature": {"signals": ["Heat.t"]}}, demonstration)


def test_fmi_2_has_no_clocks() -> None:
    require_bus(3, OWN)
    require_bus(2, None)
    with pytest.raises(InputError, match=r"FMI 2\.0"):
        require_bus(2, OWN)


def test_a_database_needs_a_role_map() -> None:
    with pytest.raises(InputError, match="--bus FILE"):
        require_bus(3, None, OWN)


def test_a_cycle_time_that_the_step_does_not_divide_is_refused(
    headers: Path, model: FmuModel, tmp_path: Path
) -> None:
    bus = read_bus(OWN, model.motorcycle).bus
    odd = replace(bus, frames=(replace(bus.frames[-1], period=1.1e-3),))
    with pytest.raises(
        ValueError, match=r"every 1\.1 ms: no multiple of the internal step, 0\.25 ms"
    ):
        write_fmu(tmp_path / "one.fmu", model, 3, headers, odd)


def test_the_shipped_role_map_is_that_of_the_tests() -> None:
    assert read_toml(OWN, RoleMap).database == "motorbike.dbc"
