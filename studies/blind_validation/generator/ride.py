"""One ride: classic Runge-Kutta steps of an eighth of a millisecond, with the throttle's history.

Hysteresis (gear play, play of the air) moves once a step; the plate stops dead at its ends.
"""

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from slipbench.studies.blind_validation.generator import physics as p
from slipbench.studies.blind_validation.generator.fault_parameters import MotionFaults
from slipbench.studies.blind_validation.generator.machine import Machine
from slipbench.studies.blind_validation.generator.physics import Floats
from slipbench.studies.blind_validation.generator.road import Road

STEP = 0.125e-3  # s
EVERY = 4  # steps between rows of the trajectory
HISTORY = 4096  # steps
SEEN_COLUMNS = 9


@dataclass(frozen=True)
class Course:
    """Time series of a simulated run, one row each 0.5 ms. time: s, since the ECU's first tick."""

    time: Floats
    plate: Floats
    crank_speed: Floats
    wheel: Floats
    wheel_speed: Floats
    front: Floats
    front_speed: Floats
    optical: Floats
    speed: Floats


@dataclass(frozen=True)
class Commands:
    """Commands that the ECU applies, held from tick to tick. period: s, of its ticks, true time."""

    throttle: Floats
    spark: Floats
    period: float


def ride(
    machine: Machine,
    missing: MotionFaults,
    formula: int,
    commands: Commands,
    road: Road,
    start: Floats,
    origin: float,
) -> Course:
    """Ride from a steady state through all commands. origin: s, where time and way count from."""
    steps = int(commands.throttle.size * commands.period / STEP)
    table = _ride(
        machine,
        missing,
        formula,
        commands.throttle,
        commands.spark,
        commands.period,
        road.wind,
        road.shove,
        road.bump,
        road.period,
        road.scatter,
        start,
        steps,
        origin,
    )
    time: Floats = np.asarray(STEP * EVERY * np.arange(1, len(table) + 1), np.float64)
    return Course(time, *table.T[: SEEN_COLUMNS - 1])


@njit(cache=True, error_model="numpy")
def _mean(table: Floats, time: float, period: float) -> float:
    """Mean of a held command over one integration step."""
    last = table.size - 1
    first = min(max(math.floor(time / period), 0), last)
    next_ = min(max(math.floor((time + STEP) / period), 0), last)
    share = (time + STEP - next_ * period) / STEP if next_ > first else 1.0
    return float(table[first] + share * (table[next_] - table[first]))


@njit(cache=True, error_model="numpy")
def _between(table: Floats, time: float, period: float) -> float:
    """Linear interpolation between samples."""
    place = min(max(time / period, 0.0), table.size - 1.001)
    i = int(place)
    return float(table[i] + (place - i) * (table[i + 1] - table[i]))


@njit(cache=True, error_model="numpy")
def _played(value: float, held: float, play: float) -> float:
    """Output of a backlash that follows a value."""
    return min(max(held, value - 0.5 * play), value + 0.5 * play)


@njit(cache=True, error_model="numpy")
def _ago(history: Floats, count: int, steps: float) -> float:
    """Throttle a number of steps before the current step; positive: the past."""
    if steps <= 0.0:
        return float(history[count % HISTORY])
    steps = min(steps, HISTORY - 2.0)
    whole = int(steps)
    f = steps - whole
    new, old = history[(count - whole) % HISTORY], history[(count - whole - 1) % HISTORY]
    return float(new + f * (old - new))


@njit(cache=True, error_model="numpy")
def _ride(
    m: Machine,
    e: MotionFaults,
    formula: int,
    throttle: Floats,
    spark: Floats,
    tick: float,
    wind: Floats,
    shove: Floats,
    bump: Floats,
    road_period: float,
    scatter: Floats,
    start: Floats,
    steps: int,
    origin: float,
) -> Floats:
    x, k, y = start.copy(), np.zeros((4, p.STATES)), np.zeros(p.STATES)
    u = np.zeros(7)
    history = np.full(HISTORY, x[p.PLATE])
    flank, held_air = throttle[0], x[p.PLATE]
    table = np.empty((steps // EVERY, SEEN_COLUMNS - 1))
    for n in range(steps):
        t0 = n * STEP
        strokes = int(x[p.CRANK] / np.pi)
        u[p.SCATTER] = scatter[strokes % scatter.size]
        command = _mean(throttle, t0 - m.servo_delay, tick)
        flank = _played(command, flank, e.play)
        advance = _mean(spark, t0 - m.spark_delay, tick)
        delay = (
            m.air_delay + e.air_delay + e.crank_turns * 2.0 * np.pi / max(x[p.CRANK_SPEED], 30.0)
        )
        held_air = _played(_ago(history, n, delay / STEP), held_air, e.air_play)
        for stage in range(4):
            ahead = 0.5 * ((stage + 1) // 2)
            t = t0 + ahead * STEP
            for i in range(p.STATES):
                y[i] = x[i] + (ahead * STEP * k[stage - 1, i] if stage > 0 else 0.0)
            u[p.COMMAND] = flank
            u[p.SPARK_COMMAND] = advance
            u[p.WIND] = _between(wind, t, road_period)
            u[p.SHOVE] = _between(shove, t, road_period)
            u[p.BUMP] = _between(bump, t, road_period)
            u[p.DELAYED] = held_air if e.air_play > 0.0 else _ago(history, n, delay / STEP - ahead)
            p.rates(t - origin, y, k[stage], u, formula, m, e)
        for i in range(p.STATES):
            x[i] += STEP / 6.0 * (k[0, i] + 2.0 * k[1, i] + 2.0 * k[2, i] + k[3, i])
        if x[p.PLATE] < 0.0:
            x[p.PLATE], x[p.PLATE_RATE] = 0.0, max(x[p.PLATE_RATE], 0.0)
        if x[p.PLATE] > 1.0:
            x[p.PLATE], x[p.PLATE_RATE] = 1.0, min(x[p.PLATE_RATE], 0.0)
        if t0 < origin:
            x[p.WAY] = 0.0
        history[(n + 1) % HISTORY] = x[p.PLATE]
        if (n + 1) % EVERY == 0:
            optical_speed = (
                x[p.SEEN] if e.optical_lag > 0.0 else p.optical_speed(x, k[0, p.SPEED], e)
            )
            row = table[(n + 1) // EVERY - 1]
            row[0], row[1], row[2], row[3] = (
                x[p.PLATE],
                x[p.CRANK_SPEED],
                x[p.WHEEL],
                x[p.WHEEL_SPEED],
            )
            row[4], row[6], row[7] = x[p.FRONT], optical_speed, x[p.SPEED]
            row[5] = x[p.SPEED] / (m.front_radius * (1.0 + e.front_growth * x[p.SPEED] ** 2))
    return table
