"""Time from the rider's button to the first command with authority, repeated, in real time.

The gateway's loop and the virtual motorcycle are processes of their own on the virtual bus. Counted
are the bus's own time stamps: the end of the frame that reports the button, and the end of the
first command with authority. Beside it, turn by turn, a loop that does not listen between its
ticks: there a period of waiting is in it.
"""

import multiprocessing
import os
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np

from slipbench import dbc
from slipbench.bench.bus.opening import BusAddress, open_bus
from slipbench.bench.gateway.gateway import Gateway
from slipbench.bench.loop.button_wait import button_wait
from slipbench.bench.loop.clock import MILLISECOND, MonotonicClock
from slipbench.bench.loop.loop import Wait, run_periodic
from slipbench.bench.loop.realtime_process import realtime_process
from slipbench.bench.loop.ring import Ring, Slot
from slipbench.bench.trials.preparation import Prepared, prepare
from slipbench.bench.vehicle.live_vehicle import vehicle_process
from slipbench.bench.vehicle.virtual_motorcycle import wheels_of
from slipbench.protocol.codec.codec import Codec
from slipbench.protocol.codec.messages import ActuatorCommand, Authority, Phase, RiderControls
from timing.quantiles import Row

TRIAL = Path(__file__).parents[2] / "examples" / "trials" / "throttle_sweep.toml"
TIMES = 120
AFTER = 20  # ticks with authority before the trial is stopped: what counts is past
PAUSE = 50_000_000  # ns between two trials: then the devices are free again
PATIENCE = 20_000  # ticks for one trigger
ON_ITS_WAY = 60.0  # s that the motorcycle has to start


def measure(times: int = TIMES) -> list[Row]:
    """Press the button `times` times in each mode, on one simulated motorcycle."""
    prepared = quick(prepare(TRIAL, dbc.MOTORBIKE))
    address = BusAddress("slipbench", f"trigger-{os.getpid()}")
    spawning = multiprocessing.get_context("spawn")
    ours, theirs = spawning.Pipe()
    with vehicle_process(prepared.scenario, prepared.binding, [address]):
        process = spawning.Process(target=_trigger, args=(prepared, address, times, theirs))
        process.start()
        theirs.close()  # so that a process that dies is an end, and no wait
        found = ours.recv()
        process.join()
    ways = {"button to first excitation frame": 0, "  if it waited for the next tick": 1}
    return [Row(name, np.array(found[way]), times - len(found[way])) for name, way in ways.items()]


def quick(prepared: Prepared) -> Prepared:
    """Shorten the trial before and after the button; the excitation is unchanged."""
    from dataclasses import replace

    trial = prepared.trial.model_copy(
        update={
            "operating_point": prepared.trial.operating_point.model_copy(
                update={"steady_for": 0.02}
            ),
            "rider": prepared.trial.rider.model_copy(update={"presses_button_after": 0.0503}),
        }
    )
    scenario = replace(prepared.scenario, trial=trial)
    return replace(prepared, plan=replace(prepared.plan, trial=trial), scenario=scenario)


def _trigger(prepared: Prepared, address: BusAddress, times: int, pipe: Connection) -> None:
    wheels, clock = wheels_of(prepared.scenario.vehicle), MonotonicClock()
    found: tuple[list[int], list[int]] = [], []
    with open_bus(address, receive_own_messages=True) as bus, realtime_process():
        if bus.recv(ON_ITS_WAY) is None:
            raise RuntimeError(f"no motorcycle on the bus within {ON_ITS_WAY:g} s")
        for turn in range(2 * times):
            clock.sleep_until_ns(clock.now_ns() + PAUSE)
            while bus.recv(0) is not None:  # echoes of the trial before
                pass
            ring = Ring.local()
            gateway = Gateway(prepared.plan, bus, prepared.binding, ring, wheels)
            wait = None if turn % 2 else button_wait(gateway, [bus], clock)
            slots = _one(gateway, ring, clock, wait)
            if (taken := delay(slots, Codec(prepared.database))) is not None:
                found[turn % 2].append(taken)
    pipe.send(found)


def _one(gateway: Gateway, ring: Ring, clock: MonotonicClock, wait: Wait | None) -> list[Slot]:
    """Run a trial until some ticks after its first excitation; returns its last frames."""
    slots: list[Slot] = []
    excited = 0

    def tick(number: int, due: int) -> bool:
        nonlocal excited
        excited += gateway.state.phase == Phase.EXCITING
        if excited == AFTER:
            gateway.stop(due)
        goes_on = gateway.tick(number, due)
        if number % 200 == 0 and not excited:
            slots[:] = [*slots[-2000:], *ring.drain()]
        return goes_on

    run_periodic(tick, MILLISECOND, clock, PATIENCE, wait=wait)
    return [*slots, *ring.drain()]


def delay(slots: list[Slot], codec: Codec) -> int | None:
    """Time from the button's frame to the first with authority, ns; None: it did not come."""
    pressed: int | None = None
    for slot in slots:
        message = codec.decode(slot.identifier, slot.data)
        if isinstance(message, RiderControls):
            pressed = (pressed or slot.time_ns) if message.button else None
        elif isinstance(message, ActuatorCommand) and message.authority != Authority.NONE:
            return None if pressed is None else slot.time_ns - pressed
    return None
