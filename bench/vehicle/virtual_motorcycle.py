"""Virtual motorcycle: ECU, throttle body, encoders, optical sensor and rider on any CAN bus.

The only file of the bench that uses the vehicle dynamics. It sends the messages of the database as the
real devices do, each with its own clock, and returns authority to the rider when no command arrives
(watchdog timeout).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import can
import numpy as np

from slipbench.bench.bus.faults import NO_FAULTS, FaultPlan
from slipbench.bench.bus.frame import Frame
from slipbench.bench.bus.opening import as_sequence
from slipbench.bench.loop.clock import SECOND
from slipbench.bench.safety.vehicle_monitor import Wheels
from slipbench.bench.vehicle.devices import DeviceClock, Grant
from slipbench.bench.vehicle.disturbances import ON_THE_ROAD, DisturbanceLevels, Disturbances
from slipbench.bench.vehicle.instruments import Instruments, Motion, Timing
from slipbench.bench.vehicle.nodes import ALL_NODES, NODE_OF, carriers
from slipbench.bench.vehicle.port import Port
from slipbench.bench.vehicle.real_devices import RealDevices
from slipbench.bench.vehicle.rider import Rider
from slipbench.bench.vehicle.road import Road
from slipbench.plant.channels import ChannelTiming
from slipbench.plant.encoder import ToothedDisc, begin, passing_teeth, toothed_disc
from slipbench.plant.equilibrium import equilibrium
from slipbench.plant.errors import VehicleFileError
from slipbench.plant.motorcycle import Motorcycle
from slipbench.plant.sensing import (
    Memories,
    Misdates,
    SensorEffect,
    clock_of,
    measure,
    sensor_effects,
)
from slipbench.plant.signals import Floats
from slipbench.plant.simulation import Inputs, Outputs, Simulation
from slipbench.plant.vehicle_file import Vehicle, load_vehicle
from slipbench.protocol.codec.assembly import Assembly, Joined
from slipbench.protocol.codec.codec import Codec, Sender
from slipbench.protocol.codec.codec import Frame as WireFrame
from slipbench.protocol.codec.faults import FrameFault
from slipbench.protocol.codec.messages import (
    ActuatorCommand,
    Authority,
    RiderControls,
    ThrottleStatus,
    TrialStatus,
)
from slipbench.protocol.codec.wire import FramePlan
from slipbench.protocol.errors import InputError
from slipbench.protocol.trial_file import TrialFile

STEP = 0.001  # s, cycle of the devices
CONTINUOUS = ("throttle_position", "engine_speed", "optical_speed")  # simulated between frames too
PER_FRAME = ("throttle_command", "spark_command", "spark_applied")  # computed for each frame only


def read_vehicle(path: Path) -> Vehicle:
    """Read a vehicle file. Raises InputError where it is not valid."""
    try:
        return load_vehicle(path)
    except VehicleFileError as fault:
        raise InputError(str(fault)) from fault


def wheels_of(vehicle: Vehicle) -> Wheels:
    """Wheel radii (m) and number of teeth, from which the gateway computes wheel speeds."""
    motorcycle = vehicle.motorcycle
    rear, front = motorcycle.rear_wheel.radius, motorcycle.front_wheel.radius
    return Wheels(rear, front, int(motorcycle.rear_encoder.teeth))


def equilibrium_throttle(scenario: "Scenario") -> float:
    """Throttle opening (0..1) that holds the operating point of the trial."""
    return scenario.equilibrium(Simulation(scenario.vehicle.motorcycle))[1]


@dataclass(frozen=True)
class Scenario:
    """What is simulated: a vehicle, a trial (operating point, rider, seed), and disturbances.

    nodes   nodes of the bus that are simulated; the others are real devices (`bench/vehicle/nodes.py`)
    faults  faults of the simulated nodes (`bench/vehicle/node_faults.py`)
    """

    vehicle: Vehicle
    trial: TrialFile
    disturbances: DisturbanceLevels = ON_THE_ROAD
    nodes: frozenset[str] = ALL_NODES
    faults: FaultPlan = NO_FAULTS

    def equilibrium(self, simulation: Simulation) -> tuple[Floats, float]:
        """Steady state of the operating point, and the throttle opening (0..1) that holds it.

        The state has the shape (n,) and SI units. Raises InputError where there is none.
        """
        point = self.trial.operating_point
        try:
            return equilibrium(simulation, point.gear, point.engine_speed)
        except (ValueError, IndexError) as fault:
            raise InputError(
                "the vehicle has no steady state at the operating point of the trial",
                where=self.trial.name,
                found=str(fault),
                remedy="change operating_point in the trial, or the vehicle file",
            ) from fault


class End(NamedTuple):
    """Outputs of the simulation at the end of a step, SI."""

    time: float
    speed: float
    acceleration: float
    throttle_rate: float
    rear_angle: float
    rear_speed: float
    front_angle: float
    front_speed: float


END = np.array([Outputs.names.index(name) for name in End._fields])


class Sensor:
    """Measurement of one channel by the sensor effects of the vehicle."""

    def __init__(self, motorcycle: Motorcycle, channel: str, *stages: str) -> None:
        """Start in the initial state, with the effects of these stages."""
        self._effects = sensor_effects(motorcycle.effects, channel, *stages)
        self._memories: Memories = ()

    def sample(self, times: Floats, values: Floats) -> float:
        """Last measured value. times: s, true time, shape (n,); values: SI, shape (n,)."""
        if self._effects:
            self._memories, values = measure(self._effects, self._memories, times, values)
        return float(values[-1])

    def frame_value(self, now: float, value: float) -> float:
        """Measured value of one frame. now: s, true time; value: true value, SI."""
        return self.sample(np.array([now]), np.array([value])) if self._effects else value


class VirtualMotorcycle:
    """Simulation in steps of a millisecond; it sends the messages of all devices."""

    def __init__(
        self, scenario: Scenario, bus: can.BusABC | Sequence[can.BusABC], codec: Codec
    ) -> None:
        """Start at the operating point of the trial, with authority at the rider.

        bus: one, or as many as the codec has, in the order of `Codec.buses`
        """
        trial, motorcycle = scenario.trial, scenario.vehicle.motorcycle
        self._silence = trial.command.silence
        self._gear = trial.operating_point.gear
        self._codec, self._sender = codec, Sender(codec)
        nodes = carriers(codec, scenario.nodes)
        self._ports = [
            Port(each, codec, nodes, scenario.faults, number)
            for (number, _), each in zip(enumerate(codec.buses), as_sequence(bus), strict=True)
        ]
        self._nodes, self._real = scenario.nodes, RealDevices(scenario.nodes, codec)
        self._assembly = Assembly(codec)
        self._simulation = Simulation(motorcycle)
        self._state, grip = scenario.equilibrium(self._simulation)
        self._rider = Rider(trial.rider, grip)
        _check_channels(scenario.vehicle)
        self._instruments = Instruments(_timings(scenario.vehicle), codec, self._rider, trial.seed)
        self._sensors = {channel: Sensor(motorcycle, channel, "signal") for channel in CONTINUOUS}
        self._disturbances = Disturbances(scenario.disturbances, trial.seed)
        self._inputs = Inputs.held(1, gear=float(self._gear), throttle_command=grip)
        self._row = self._inputs.table[0]
        self._grant = Grant(latches=codec.requests_authority)
        self._counters: dict[str, int | None] = {}  # of the last frames of a command
        self._discs = {
            "rear": toothed_disc(motorcycle.rear_encoder, motorcycle.effects, "rear_encoder"),
            "front": toothed_disc(motorcycle.front_encoder, motorcycle.effects, "front_encoder"),
        }
        self._pickups: dict[str, Floats] = {}
        self._radii = motorcycle.rear_wheel.radius, motorcycle.front_wheel.radius
        self._road = Road(trial.road)
        self._distance = 0.0  # m, from the button
        self._start: int | None = None
        self._elapsed = 0
        self._present = 0.0  # s, of the tick; after a late tick the simulation is behind it
        self._throttle_rate = 0.0
        self.watchdog_timeouts: list[float] = []  # s, when authority returned to the rider

    @property
    def waited_for(self) -> tuple[str, ...]:
        """Nodes left to real devices that have not sent yet."""
        return self._real.waited_for

    def listen(self) -> None:
        """Read the frames that have arrived, and send nothing.

        Raises InputError where another device sends for a node that is simulated here.
        """
        for bus, port in enumerate(self._ports):
            for frame in port.receive(0.0):
                self._read(frame, bus, 0.0, devices_only=True)

    def tick(self, number: int, due: int) -> bool:
        """Simulate up to millisecond `number`, inclusive, due at `due` ns; always True.

        Raises InputError where a real device is silent or late, or sends for a simulated node.
        """
        if self._start is None:
            self._start = due - round((number + 1) * STEP * SECOND)
        self._present = (number + 1) * STEP
        while self._elapsed <= number:
            self._elapsed += 1
            self._advance(self._elapsed * STEP)
        self._real.check(self._present)
        return True

    def _advance(self, now: float) -> None:
        """Simulate the millisecond that ends at `now`, s since the start.

        The motorcycle moves under the commands of the millisecond before. Then the devices read the
        frames that arrived meanwhile, and apply and report these commands from `now` on.
        """
        motion = self._move(now)
        self._receive(now)
        grant = self._grant.with_watchdog(now, self._silence)
        if grant.latched and not self._grant.latched:
            self.watchdog_timeouts.append(now)
        self._grant = grant
        for name, message in self._instruments.messages_due(
            self._elapsed - 1, now, motion, self._applied(now)
        ):
            if NODE_OF[name] in self._nodes:
                for frame in self._sender.frames(message, name=name, now=now):
                    self._send(frame)

    def _applied(self, now: float) -> Grant:
        """What the devices apply and report at `now` (s): where the ECU is real, what it reports."""
        if "ecu" in self._nodes:
            return self._grant
        command = self._real.command(now, self._silence)
        return Grant() if command is None else Grant(command, now)

    def _receive(self, now: float) -> None:
        for bus, port in enumerate(self._ports):
            for frame in port.receive(now):
                self._read(frame, bus, now)
        if not self._codec.has("TrialStatus"):
            self._rider.watch(self._grant.authority, now)

    def _read(self, frame: Frame, bus: int, now: float, *, devices_only: bool = False) -> None:
        """Let the devices read a frame at `now` (s). bus: its number."""
        plan = self._codec.plan(frame.identifier, frame.extended, bus)
        if plan is None:
            return
        payload = plan.check(frame.data)
        if isinstance(payload, FrameFault):
            self._real_fault(plan, payload)
            return
        counter = None if plan.guard is None else plan.guard.counter(payload)
        found = self._assembly.take(plan, payload, now)
        if isinstance(found, FrameFault):
            self._real_fault(plan, found)
            return
        carrier = plan.message.name
        commands = "ActuatorCommand" in [part.name for part in plan.parts]
        moved = not commands or devices_only or self._in_sequence(carrier, counter)
        for part in plan.parts:
            if part.name in NODE_OF:
                self._read_device(part.name, found, counter)
        for _name, message, _ in found:
            match message:
                case ActuatorCommand() if moved and not devices_only:
                    self._grant = self._grant.receive(message, now)
                case TrialStatus() if not devices_only:
                    self._rider.read_phase(message.phase, now)

    def _real_fault(self, plan: FramePlan, fault: FrameFault) -> None:
        for part in plan.parts:
            if part.name in NODE_OF:
                self._real.receive(part.name, fault, None, self._present)

    def _read_device(self, name: str, found: list[Joined], counter: int | None) -> None:
        """Read what another device sends of message `name`, at the present."""
        message = next((each for key, each, _ in found if key == name), None)
        if self._real.receive(name, message, counter, self._present):
            match message:
                case RiderControls():
                    self._rider.follow(message, self._present)
                case ThrottleStatus():
                    self._inputs.measured_throttle[0] = message.position

    def _in_sequence(self, carrier: str, counter: int | None) -> bool:
        """Whether the counter of a command advanced; a frozen counter is not a valid command."""
        moved = counter is None or counter != self._counters.get(carrier)
        self._counters[carrier] = counter
        return moved

    def _move(self, now: float) -> Motion:
        """True motion after one millisecond under the commands and the disturbances."""
        row = self._row
        row[Inputs.throttle_command.index], row[Inputs.spark.index] = self._commands(now)
        row[Inputs.clutch.index] = 1.0 - self._rider.clutch
        force, torque = self._disturbances.draw(STEP)
        row[Inputs.road_force.index], row[Inputs.engine_disturbance.index] = force, torque
        row[Inputs.grip.index], row[Inputs.load.index] = self._road.factors(self._distance)
        self._state, out = self._simulation.advance(self._state, self._inputs)
        end = End(*out.table[-1].take(END).tolist())
        if self._rider.pressed:
            self._distance += end.speed * STEP
        times = now + (out.time - end.time)
        self._pass_teeth("rear", times, out.rear_angle, out.rear_speed)
        self._pass_teeth("front", times, out.front_angle, out.front_speed)
        return self._motion(times, out, end)

    def _commands(self, now: float) -> tuple[float, float]:
        """Opening (0..1) commanded to the servo and spark offset (rad) at `now` (s)."""
        if "ecu" in self._nodes:
            authority, command = self._grant.authority, self._grant.command
            throttle = command.throttle if authority & Authority.THROTTLE else self._rider.grip
            return throttle, command.spark if authority & Authority.SPARK else 0.0
        status = self._real.command(now, self._silence)
        return (self._rider.grip, 0.0) if status is None else (status.throttle, status.spark)

    def _pass_teeth(self, wheel: str, times: Floats, angle: Floats, speed: Floats) -> None:
        disc = self._discs[wheel]
        if wheel not in self._pickups:
            self._pickups[wheel] = begin(float(times[0]), float(angle[0]), float(speed[0]))
            return
        self._pickups[wheel], passed = passing_teeth(
            disc, self._pickups[wheel], times, angle, speed
        )
        seconds = [float(tick) * disc.resolution for tick in passed.ticks]
        self._instruments.teeth(wheel, seconds, _teeth(disc))

    def _motion(self, times: Floats, out: Outputs, end: End) -> Motion:
        acceleration = (end.throttle_rate - self._throttle_rate) / STEP
        self._throttle_rate = end.throttle_rate
        return Motion(
            throttle=self._sensors["throttle_position"].sample(times, out.throttle),
            throttle_acceleration=acceleration,
            engine_speed=self._sensors["engine_speed"].sample(times, out.engine_speed),
            gear=self._gear,
            optical_speed=self._sensors["optical_speed"].sample(times, out.optical_speed),
            acceleration=end.acceleration,
            rear_angle=end.rear_angle,
            front_angle=end.front_angle,
            rear_speed=end.rear_speed * self._radii[0],
            front_speed=end.front_speed * self._radii[1],
        )

    def _send(self, frame: WireFrame) -> None:
        self._ports[frame.bus].send(frame, self._elapsed * STEP)


def _teeth(disc: ToothedDisc) -> int:
    return int(disc.angles.size)


def _timings(vehicle: Vehicle) -> Mapping[str, Timing]:
    """Timing of each channel of the vehicle file."""
    return {name: _timing(vehicle, name, channel) for name, channel in vehicle.channels.items()}


def _timing(vehicle: Vehicle, name: str, channel: ChannelTiming) -> Timing:
    stages = ("frame",) if name in CONTINUOUS else ("signal", "frame")
    return Timing(
        DeviceClock(*clock_of(vehicle.motorcycle.effects, channel)),
        channel.latency,
        channel.noise,
        Sensor(vehicle.motorcycle, name, *stages).frame_value,
    )


def _check_channels(vehicle: Vehicle) -> None:
    """Reject effects on channels that the virtual motorcycle does not send, or on unknown clocks."""
    clocks = {channel.clock for channel in vehicle.channels.values()}
    for effect in vehicle.motorcycle.effects:
        known = (
            (*CONTINUOUS, *PER_FRAME) if isinstance(effect, SensorEffect) else tuple(sorted(clocks))
        )
        if isinstance(effect, (SensorEffect, Misdates)) and effect.subject not in known:
            raise InputError(
                "an effect acts on a channel or clock that the virtual motorcycle does not have",
                where=f"{vehicle.name}: effects.{effect.name}",
                expected=", ".join(known),
                found=effect.subject,
                remedy="use one of these channels or clocks",
            )
