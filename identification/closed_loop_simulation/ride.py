"""Closed-loop simulation of one ride: motorcycle, encoders and controller, every 1 ms.

As on CAN, an encoder sends three teeth per frame, or fewer after 5 ms; the optical sensor sends a
noisy sample every 4 ms. A tick uses the frames received so far, and its command acts from the next
tick on.
"""

from dataclasses import dataclass

import numpy as np

from slipbench.controllers.slip_controller import SlipController
from slipbench.controllers.slip_estimator import EstimatorState, SlipEstimator
from slipbench.identification.closed_loop_simulation.scenario import Scenario
from slipbench.plant.channels import DEFAULT_CHANNELS
from slipbench.plant.encoder import ToothedDisc, begin, passing_teeth, toothed_disc
from slipbench.plant.equilibrium import equilibrium
from slipbench.plant.motorcycle import Motorcycle
from slipbench.plant.signals import Floats, Inputs, Outputs
from slipbench.plant.simulation import Simulation

TICK = 0.001  # s
WARM_UP = 5.0  # s; slip error from tooth-pitch errors is then 0.001 % (0.03 % after 2 s)
OPTICAL = DEFAULT_CHANNELS["optical_speed"]
TOGETHER = 3  # teeth in a frame
WAIT = 0.005  # s, after which a frame with fewer teeth is sent


@dataclass(frozen=True, eq=False)
class Ridden:
    """time: s since control began; slip: true; estimated: slip as the controller has it; target;
    throttle, spark: offsets from rest; speed: m/s; distance: m. All of shape (n,)."""

    time: Floats
    slip: Floats
    estimated: Floats
    target: Floats
    throttle: Floats
    spark: Floats
    speed: Floats
    distance: Floats


class _Wheels:
    """Encoders and optical sensor, and the slip estimator that receives their frames."""

    def __init__(self, motorcycle: Motorcycle, estimator: SlipEstimator, seed: int) -> None:
        self._random = np.random.default_rng(seed)
        self._estimator, self._state = estimator, estimator.initial()
        self._discs: dict[str, ToothedDisc] = {
            side: toothed_disc(
                getattr(motorcycle, f"{side}_encoder"), motorcycle.effects, f"{side}_encoder"
            )
            for side in ("rear", "front")
        }
        self._pickups: dict[str, Floats] = {}
        self._waiting: dict[str, list[tuple[float, float]]] = {"rear": [], "front": []}
        self._sent_at = {"rear": 0.0, "front": 0.0}
        self._next_optical = 0.0

    def receive(self, out: Outputs, learning: bool) -> EstimatorState:
        for side in ("rear", "front"):
            self._turn(side, out, learning)
        now = float(out.time[-1])
        if now >= self._next_optical:
            self._next_optical = now + OPTICAL.period - 1e-9
            speed = float(out.optical_speed[-1]) + OPTICAL.noise * self._random.standard_normal()
            speed = OPTICAL.quantum * round(speed / OPTICAL.quantum)
            self._state = self._estimator.optical(self._state, now, speed)
        return self._state

    def _turn(self, side: str, out: Outputs, learning: bool) -> None:
        angle, speed = getattr(out, f"{side}_angle"), getattr(out, f"{side}_speed")
        disc = self._discs[side]
        if side not in self._pickups:
            self._pickups[side] = begin(float(out.time[0]), float(angle[0]), float(speed[0]))
            return
        self._pickups[side], teeth = passing_teeth(
            disc, self._pickups[side], out.time, angle, speed
        )
        self._waiting[side] += [
            (float(tick) * disc.resolution, float(number))
            for tick, number in zip(teeth.ticks, teeth.numbers, strict=True)
        ]
        self._send(side, float(out.time[-1]), learning)

    def _send(self, side: str, now: float, learning: bool) -> None:
        waiting = self._waiting[side]
        if len(waiting) < TOGETHER and now - self._sent_at[side] < WAIT:
            return
        take = self._estimator.rear_tooth if side == "rear" else self._estimator.front_tooth
        for time, number in waiting:
            self._state = take(self._state, time, number, learning)
        self._sent_at[side] = now
        waiting.clear()


def ride(
    motorcycle: Motorcycle,
    scenario: Scenario,
    controller: SlipController | None,
    seed: int = 1,
    warm_up: float = WARM_UP,
) -> Ridden:
    """Simulated ride of a scenario; without a controller throttle and spark stay constant.

    seed: of the noise of the optical sensor; warm_up: s, in which tooth-pitch errors are learned.
    """
    simulation = Simulation(motorcycle)
    state, rest = equilibrium(simulation, scenario.gear, scenario.engine_speed)
    estimator = SlipEstimator(
        int(motorcycle.rear_encoder.teeth),
        motorcycle.rear_wheel.radius,
        motorcycle.front_wheel.radius,
        report=WAIT + 0.0015,
    )
    wheels = _Wheels(motorcycle, estimator, seed)
    inputs = Inputs.held(1, gear=float(scenario.gear), throttle_command=rest)
    warm, ticks = round(warm_up / TICK), round(scenario.duration / TICK)
    rows = np.empty((ticks, 8))
    began, control, throttle, spark = 0.0, None, 0.0, 0.0
    for k in range(warm + ticks):
        t = (k - warm) * TICK
        if k >= warm:
            position = rows[k - warm - 1, 7] if k > warm else 0.0
            inputs.grip[0], inputs.load[0] = scenario.grip(position), scenario.load(position)
            inputs.throttle_command[0] = min(max(rest + scenario.throttle(t) + throttle, 0.0), 1.0)
            inputs.spark[0] = spark
        state, out = simulation.advance(state, inputs)
        known = wheels.receive(out, learning=k < warm)
        measured = estimator.slip(known, float(out.time[-1]))
        if k < warm:
            began = float(out.distance[-1])
            continue
        target = scenario.target(t)
        if controller is not None:
            if control is None:
                control = controller.start(0.0, 0.0, measured.value, measured.speed)
            throttle, spark, control = controller.update(
                control, target, measured.value, measured.speed, TICK
            )
        rows[k - warm] = (
            t,
            out.slip[-1],
            measured.value,
            target,
            throttle,
            spark,
            out.speed[-1],
            out.distance[-1] - began,
        )
    return Ridden(*rows.T.copy())
