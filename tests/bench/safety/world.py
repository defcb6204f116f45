"""A bus on which anything may happen, with the real gateway at one end.

A script of bytes, two for each tick, says what goes wrong: controls move, sensors jump, freeze or
fall silent, frames are damaged, repeated, foreign; the clock stands, goes back or leaps; the bus
refuses; what the gateway believes to see is not a number. `Judge` looks on from the wire.

It does not imitate a motorcycle: nothing that is sent answers to the throttle but the devices'
grant. Frames arrive at once, in order; bit timing and arbitration are for the virtual bus.
"""

import io
import math
import pickle
from collections.abc import Iterator
from dataclasses import dataclass, field, fields, is_dataclass, replace
from functools import cache, lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import can
import numpy as np

from slipbench import dbc
from slipbench.bench.gateway import gateway as gateway_module
from slipbench.bench.gateway.gateway import Gateway
from slipbench.bench.loop.ring import Ring
from slipbench.bench.safety.trial import ENDED, Plan, plan_of
from slipbench.bench.safety.vehicle_monitor import VehicleMonitor, Wheels
from slipbench.bench.safety.vehicle_state import VehicleState
from slipbench.bench.trials.excitation import Excitation
from slipbench.protocol.binding.binding import Binding
from slipbench.protocol.codec.codec import Codec
from slipbench.protocol.codec.faults import FrameFault
from slipbench.protocol.codec.messages import (
    ActuatorCommand,
    Authority,
    BenchMessage,
    EcuStatus,
    EncoderStatus,
    EngineStatus,
    Intervals,
    OpticalSpeed,
    Phase,
    RiderControls,
    ThrottleStatus,
    ToothIntervals,
)
from slipbench.protocol.codec.protection import Guard
from slipbench.protocol.database.database import load_database
from slipbench.protocol.trial_file import Command
from tests.bench.conditions import trial_file
from tests.bench.safety.judge import Judge
from tests.protocol.binding.foreign import foreign_binding

MILLISECOND = 1_000_000  # ns
START = 1_790_000_000 * 1000 * MILLISECOND  # a time of day: floats of it are coarse
WHEELS = Wheels(0.32, 0.30, 16)
NAMES = (
    "EcuStatus",
    "ThrottleStatus",
    "EngineStatus",
    "RiderControls",
    "OpticalSpeed",
    "RearTeeth",
    "FrontTeeth",
)
GAPS = (0, -1, -1_000_000_000, 2_000_000, 5_000_000, 5_002_000, 100_000_000, 10_000_000_000)  # ns
STRANGE = (math.nan, math.inf, -math.inf)
MOST_TICKS = 24


class Remembering(Codec):
    """The real codec, which is a pure function: what it has worked out once it need not again.

    Every message of the bench lies in one frame here, and is named by the bench's name.
    """

    def __init__(self, binding: Binding) -> None:
        super().__init__(binding.database, binding.placement)
        self.encode = lru_cache(1 << 15)(super().encode)  # type: ignore[method-assign]
        self._known = lru_cache(1 << 16)(super().decode)
        self.identifiers = [plan.message.identifier for plan in self.plans.values()]

    def decode(
        self, identifier: int, data: bytes | bytearray, extended: bool = False
    ) -> BenchMessage | FrameFault:
        return self._known(identifier, bytes(data), extended)

    def name(self, identifier: int, extended: bool = False) -> str | None:
        plan = self.plan(identifier, extended)
        return None if plan is None else plan.parts[0].name


class Known(Binding):
    """A binding whose codec is made once."""

    def codec(self) -> Codec:
        return codec()


def guard_of(name: str) -> Guard | None:
    plan = codec().plan(codec().identifier(name))
    return plan.guard if plan else None


def period_of(name: str) -> int:
    guard = guard_of(name)
    return (guard.period if guard else 0) or 1


NUMBER = [0]  # of the binding in use; 0: the bench's own database


def use_binding(number: int) -> None:
    """Let the worlds that are made from now on speak the database of this number (see foreign.py)."""
    NUMBER[0] = number


@cache
def binding_of(number: int) -> Known:
    if number == 0:
        return Known(load_database(dbc.MOTORBIKE))
    with TemporaryDirectory() as folder:
        found = foreign_binding(number, Path(folder))
    return Known(**{each.name: getattr(found, each.name) for each in fields(found)})


@cache
def codec_of(number: int) -> Remembering:
    return Remembering(binding_of(number))


def codec() -> Remembering:
    return codec_of(NUMBER[0])


@cache
def plan(actuator: str) -> Plan:
    """A trial so short that a script lives through all of it."""
    trial = trial_file()
    limits = trial.limits.model_copy(update={"throttle_rate": 20.0, "stale": 0.004})
    point = trial.operating_point.model_copy(update={"steady_for": 0.003})
    trial = trial.model_copy(
        update={
            "settling": 0.004,
            "hand_back": 0.008,
            "armed_for_at_most": 0.5,
            "ready_within": 0.5,
            "operating_point": point,
            "limits": limits,
            "command": Command.model_construct(period=0.001, silence=0.005),
        }
    )
    amplitude = 0.02 if actuator == "throttle" else 0.03
    table = amplitude * np.sin(2 * np.pi * np.arange(14) / 13)
    return plan_of(trial, Excitation(actuator, table, 0.001))


@dataclass
class Wire:
    """The gateway's bus: what the world put there, and what the gateway sent."""

    waiting: list[can.Message] = field(default_factory=list)
    sent: list[can.Message] = field(default_factory=list)
    refuses: bool = False
    state: can.BusState = can.BusState.ACTIVE  # of its controller, which never leaves this bus

    def recv(self, _timeout: float) -> can.Message | None:
        return self.waiting.pop(0) if self.waiting else None

    def send(self, message: can.Message) -> None:
        if self.refuses:
            raise can.CanOperationError("refused")
        self.sent.append(message)
        self.waiting.append(message)  # the gateway hears itself


class SeeingThings(VehicleMonitor):
    """A monitor of which one number may be anything, for a tick."""

    strange: tuple[str, float] | None = None

    def state(self, now: float, **state: bool) -> VehicleState:
        sight = super().state(now, **state)
        if self.strange is None:
            return sight
        path, value = self.strange
        status, _, name = path.partition(".")
        inner = replace(getattr(sight, status), **{name: value}) if name else value
        return replace(sight, **{status: inner})


def numbers(sight: Any, path: str = "") -> Iterator[str]:
    """Name every float that a sight holds."""
    for each in fields(sight):
        value = getattr(sight, each.name)
        if is_dataclass(value):
            yield from numbers(value, f"{each.name}.")
        elif isinstance(value, float):
            yield path + each.name


FLOATS = tuple(numbers(VehicleState()))


class World:
    """The devices, the gateway, and what is wrong with either."""

    def __init__(self, actuator: str) -> None:
        """Everything as it should be, nobody near the button."""
        self.plan = plan(actuator)
        self.wire = Wire()
        original = gateway_module.VehicleMonitor
        gateway_module.VehicleMonitor = SeeingThings
        try:
            self.gateway = Gateway(
                self.plan, self.wire, binding_of(NUMBER[0]), Ring.local(8), WHEELS
            )
        finally:
            gateway_module.VehicleMonitor = original
        self.gateway._record = _nowhere  # the recorder is another test's subject
        self.judge = Judge(self.plan, codec(), WHEELS)
        self.due, self.number = START, 0
        self.button, self.grip, self.faulty, self.valid = False, 0.09, False, True
        self.brakes, self.clutch = [0.0, 0.0], 0.0
        self.gear, self.engine_speed, self.speed = 2, 1466.0, 53.0
        self.teeth = {"RearTeeth": 0.0023495, "FrontTeeth": 0.002223}  # s, of 53.5 and 53 m/s
        self.counters = dict.fromkeys(NAMES, 0)
        self.wrong: dict[str, set[str]] = {
            "dropped": set(),
            "stuck": set(),
            "damaged": set(),
            "frozen": set(),
        }
        self.grants: Authority | None = None
        self.asked = ActuatorCommand(Authority.NONE, 0.0, 0.0, 0.0)
        self.attends = False
        self.ticks = self.frames = 0

    def tick(self, ahead: int = MILLISECOND) -> None:
        """Let the devices speak, the gateway answer, and the judge look at it."""
        self.due += ahead
        self.number += 1
        self.ticks += 1
        for name in NAMES:
            if name not in self.wrong["dropped"]:
                self.say(name, self.message(name))
        monitor = self.gateway._monitor
        self.judge.sees_strangely(monitor.strange)
        self.frames += len(self.wire.waiting)
        if self.attends:
            self.gateway.attend(self.due)
        self.attends = False
        self.gateway.tick(self.number, self.due)
        self.judge.look(self.wire.sent, self.due, self.wire.refuses)
        for frame in self.wire.sent:
            decoded = codec().decode(frame.arbitration_id, frame.data)
            self.asked = decoded if isinstance(decoded, ActuatorCommand) else self.asked
        self.wire.sent.clear()
        monitor.strange = None

    def message(self, name: str) -> Any:
        """What this device has to say."""
        held = self.asked.authority if self.grants is None else self.grants
        time = 0.001 * self.number % 1.0
        throttle = self.asked.throttle if held & Authority.THROTTLE else self.grip
        match name:
            case "EcuStatus":
                return EcuStatus(held, min(max(throttle, 0.0), 1.0), 0.0, time)
            case "ThrottleStatus":
                return ThrottleStatus(held, 0.09, 0.0, self.faulty, time)
            case "EngineStatus":
                return EngineStatus(self.engine_speed, self.gear, 0.5, time)
            case "RiderControls":
                return RiderControls(self.button, self.grip, *self.brakes, self.clutch)
            case "OpticalSpeed":
                return OpticalSpeed(self.speed, self.valid, time)
        return ToothIntervals(Intervals.SHORT, 3 * self.number % 256, (self.teeth[name],) * 3)

    def say(self, name: str, message: Any) -> None:
        """Put a device's frame onto the bus, as damaged as it is to be."""
        wrong = self.wrong
        if name in wrong["frozen"] and hasattr(message, "time"):
            message = replace(message, time=0.5)
        elif name in wrong["frozen"] and isinstance(message, ToothIntervals):
            message = replace(message, tooth_count=7)
        if name not in wrong["stuck"]:
            self.counters[name] = (self.counters[name] + 1) % period_of(name)
        identifier, data = codec().encode(message, counter=self.counters[name], name=name)
        if name in wrong["damaged"]:
            data = data[:-1] + bytes([data[-1] ^ 0x10])
        self.put(identifier, data)

    def put(self, identifier: int, data: bytes, **kind: bool) -> None:
        """Put any frame onto the bus; the judge hears it too."""
        frame = can.Message(
            arbitration_id=identifier, data=data, **{"is_extended_id": False, **kind}
        )
        self.wire.waiting.append(frame)
        self.judge.hear(frame, self.due * 1e-9)


class _Pickler(pickle.Pickler):
    """Writes the name of a shared object instead of the object. names: by id()."""

    def __init__(self, file: io.BytesIO, names: dict[int, str]) -> None:
        super().__init__(file, pickle.HIGHEST_PROTOCOL)
        self._names = names

    def persistent_id(self, item: object) -> str | None:
        return self._names.get(id(item))


class _Unpickler(pickle.Unpickler):
    """Reads the shared object for each name."""

    def __init__(self, file: io.BytesIO, shared: dict[str, Any]) -> None:
        super().__init__(file)
        self._shared = shared

    def persistent_load(self, name: str) -> Any:
        return self._shared[name]


class Beginning:
    """A world to begin from, as often as one likes; what never changes is shared."""

    def __init__(self, world: World) -> None:
        self._shared = {
            "plan": world.plan,
            "codec": world.gateway._codec,
            "ring": world.gateway._ring,
        }
        names = {id(item): name for name, item in self._shared.items()}
        buffer = io.BytesIO()
        _Pickler(buffer, names).dump(world)
        self._state = buffer.getvalue()

    def world(self) -> World:
        world: World = _Unpickler(io.BytesIO(self._state), self._shared).load()
        world.ticks = world.frames = 0
        return world


def _nowhere(*_: object) -> None:
    pass


# What a byte does


def play(world: World, script: bytes) -> World:
    """Live through a script of (what, how) pairs, a tick each, from where the world stands."""
    for what, how in zip(script[::2], script[1::2], strict=False):
        if world.ticks >= MOST_TICKS:
            break
        ahead = GAPS[how % len(GAPS)] if what % 32 == 24 else MILLISECOND
        act(world, what % 32, how)
        world.tick(ahead)
        if what % 32 == 30:
            for _ in range(how % 12):
                world.tick()
    return world


def act(world: World, what: int, how: int) -> None:
    """Do what one pair of bytes says; the first seven values do nothing."""
    move(world, what, how)
    damage(world, what, how)
    shake(world, what, how)


def move(world: World, what: int, how: int) -> None:
    """What the rider and the motorcycle do; 7: the bench listens before its tick."""
    match what:
        case 7:
            world.attends = True
        case 8:
            world.button = bool(how & 1)
        case 9:
            world.grip = how % 101 / 100
        case 10 | 11:
            world.brakes[what - 10] = how * 2e4
        case 12:
            world.clutch = how % 101 / 100
        case 13:
            world.gear = how % 9
        case 14:
            world.engine_speed = how * 10.0
        case 15:
            world.speed = how * 0.6 - 10.0
        case 16:
            world.teeth[("RearTeeth", "FrontTeeth")[how % 2]] = max(how, 1) * 0.00002


def damage(world: World, what: int, how: int) -> None:
    """What goes wrong with frames."""
    name = NAMES[how % len(NAMES)]
    match what:
        case 17:
            side = ("RearEncoderStatus", "FrontEncoderStatus")[how % 2]
            status = EncoderStatus(3 * world.number % 8192, 1.0, 16, bool(how & 2))
            world.put(*codec().encode(status, name=side))
        case 18 | 19 | 20 | 21:
            world.wrong[("dropped", "stuck", "damaged", "frozen")[what - 18]] ^= {name}
        case 22:
            jump(world, name, how)
        case 23:
            foreign(world, how)
        case 31:
            for names in world.wrong.values():
                names.clear()
            world.wire.refuses, world.grants, world.valid = False, None, True


def shake(world: World, what: int, how: int) -> None:
    """What goes wrong with the bus, the gateway's sight and the devices; 24 and 30 are `play`'s."""
    match what:
        case 25:
            world.wire.refuses = bool(how & 1)
        case 26:
            world.gateway._monitor.strange = FLOATS[how % len(FLOATS)], STRANGE[how % 3]
        case 27:
            world.grants = Authority(how % 4) if how < 128 else None
        case 28:
            world.faulty = bool(how & 1)
        case 29:
            world.valid = bool(how & 1)


def jump(world: World, name: str, seed: int) -> None:
    """One frame of `name` with any content, rightly protected: a sensor that jumps."""
    random = np.random.default_rng((seed, world.number))
    identifier, data = codec().encode(world.message(name), name=name)
    payload = bytearray(data[:2] + random.bytes(len(data) - 2))
    world.counters[name] = (world.counters[name] + 1) % period_of(name)
    guard = guard_of(name)
    if guard is not None:
        guard.protect(payload, world.counters[name])
    world.put(identifier, bytes(payload))


def foreign(world: World, seed: int) -> None:
    """A frame of somebody else, of any kind: garbage, remote, extended, or another bench's."""
    random = np.random.default_rng((seed, world.number, 1))
    data = random.bytes(seed % 9)
    kind = ("is_error_frame", "is_remote_frame", "is_extended_id", "")[seed % 4]
    identifier = int(random.choice([*codec().identifiers, 2047, seed]))
    if seed > 250:
        asks = ActuatorCommand(Authority.BOTH, 1.0, 0.5, 0.0)
        identifier, data = codec().encode(asks, counter=seed % 15)
        kind = ""
    world.put(identifier, data, **({kind: True} if kind else {}))


def beginnings() -> tuple[Beginning, ...]:
    """Places to begin at: armed, excited and settling, of a throttle and of a spark trial."""
    return _beginnings(NUMBER[0])


@cache
def _beginnings(_number: int) -> tuple[Beginning, ...]:
    found = []
    for actuator in ("throttle", "spark"):
        world = World(actuator)
        for _ in range(8):
            world.tick()
        assert world.gateway.state.phase == Phase.ARMED
        found.append(Beginning(world))
        world.button = True
        for _ in range(3):
            world.tick()
        assert world.gateway.state.phase == Phase.EXCITING
        found.append(Beginning(world))
        for _ in range(12):
            world.tick()
        assert world.gateway.state.phase == Phase.SETTLING
        found.append(Beginning(world))
        world.judge.expect_held()
    return tuple(found)


def live(script: bytes) -> World:
    """Live a whole script; its first byte says where to begin. Raises where a law is broken."""
    places = beginnings()
    return play(places[script[0] % len(places)].world(), script[1:])


def ending(world: World) -> str:
    """How a sequence ended: its phase, or the reason of its trip."""
    state = world.gateway.state
    name = state.trip.reason.name if state.trip else state.phase.name
    return name.lower() if state.phase in ENDED else f"still {name.lower()}"
