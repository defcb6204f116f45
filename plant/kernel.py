"""How the motorcycle moves through time: third-order Runge-Kutta steps with kept history.

The text of these functions is compiled together with the equations (see composition.py), where
`rates` is written. Kutta's third-order rule evaluates three times in a step, at its start, middle
and end; docs/decisions/plant-integrator.md states why. Commands are held between rows; a delayed
command that changes inside a step enters that step with its exact area and first moment. The hard
stops of the throttle do not bounce.
"""

import math

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# The state is one array: count of steps, the states, then four rings of equal length.
HEADER = 1
RINGS = 4
THROTTLE_COMMAND, SPARK, GEAR, CLUTCH = 0, 1, 2, 3
BAD_GEAR = -1.0
OUTPUTS = 0  # written later: how many there are


Numbers = tuple[float, ...]


def rates(
    x: Numbers,
    u: Numbers,
    led: Numbers,
    command: float,
    spark: float,
    p: Numbers,
    step: float,
    count: int,
    stage: float,
    history: Floats,
    history_rate: Floats,
) -> tuple[Numbers, Numbers]:
    """Rates of the states x, and outputs, in SI. Generated for each set of effects.

    led: slopes of the states that a recording prescribes, NaN for free ones. command, spark: those
    that act now. history, history_rate: rings of throttle positions and rates, shape (ring,).
    """
    raise NotImplementedError


def along(x: Numbers, h: float, k: Numbers) -> Numbers:
    """States x + h k. Generated for the number of states, as are the functions below."""
    raise NotImplementedError


def past_middle(x: Numbers, h: float, k1: Numbers, k2: Numbers) -> Numbers:
    """States x + h (2 k2 - k1)."""
    raise NotImplementedError


def mean_rate(k1: Numbers, k2: Numbers, k3: Numbers) -> Numbers:
    """Mean rate (k1 + 4 k2 + k3) / 6."""
    raise NotImplementedError


def with_throttle(x: Numbers, position: float, rate: float) -> Numbers:
    """States with another position and rate of the throttle plate."""
    raise NotImplementedError


def read_states(x: Floats) -> Numbers:
    """States as numbers. x: shape (states,)."""
    raise NotImplementedError


def read_parameters(p: Floats) -> Numbers:
    """Parameters as numbers. p: shape (parameters,)."""
    raise NotImplementedError


def read_inputs(row: Floats, ratio: float, clutch: float) -> Numbers:
    """A row of inputs, shape (inputs,), as numbers, with the overall ratio for the gear."""
    raise NotImplementedError


def slopes(row: Floats, x: Numbers, duration: float) -> Numbers:
    """Slopes that take prescribed states to the row's values, shape (inputs,); NaN for free states.

    duration: s.
    """
    raise NotImplementedError


def write(row: Floats, numbers: Numbers) -> None:
    """Write numbers into a row, shape (n,)."""
    raise NotImplementedError


def write_states(x: Floats, numbers: Numbers) -> None:
    """Write the states into x, shape (states,)."""
    raise NotImplementedError


def held_value(ring: Floats, count: int, delay_steps: float) -> tuple[float, float]:
    """Mean of a delayed, held command over step `count`, and its rise over the step.

    ring: past commands, shape (2^k,); delay_steps: delay in steps.

    A straight line of this mean and this rise over the step has the area and the first moment of
    the jump, wherever in the step the jump falls.
    """
    mask = len(ring) - 1
    whole = int(delay_steps)
    f = delay_steps - whole
    new = ring[(count - whole) & mask]
    jump = new - ring[(count - whole - 1) & mask]
    return new - f * jump, 6.0 * f * (1.0 - f) * jump


def transmission(row: Floats, ratios: Floats) -> tuple[float, float]:
    """Overall ratio and clutch engagement (0..1); neutral opens the clutch; no such gear: BAD_GEAR.

    row: inputs, shape (inputs,); ratios: of the gears, shape (gears,).
    """
    gear = int(row[GEAR])
    if gear < 0 or gear > len(ratios):
        return BAD_GEAR, 0.0
    return ratios[max(gear, 1) - 1], row[CLUTCH] if gear > 0 else 0.0


def off_the_stop(position: float, rate: float, push: float, step: float) -> tuple[float, float]:
    """Position and rate of a plate that passed a stop in this step; the impact is inelastic.

    push: its acceleration at rest on the stop. The plate loses its speed at the stop and, where the
    acceleration points inwards, leaves it from then on. The stop was passed where the parabola with
    this acceleration through the end of the step crosses it, so that a plate that was about to turn
    back is stopped at the right instant.
    """
    edge = 0.0 if position < 0.0 else 1.0
    inwards = 1.0 - 2.0 * edge
    force = inwards * push
    if force <= 0.0:
        return edge, 0.0
    depth, speed = inwards * (edge - position), -inwards * rate
    root = math.sqrt(speed * speed + 2.0 * force * depth)
    since = min(2.0 * depth / (speed + root) if speed > 0.0 else (root - speed) / force, step)
    return edge + 0.5 * push * since * since, push * since


def advance(
    state: Floats,
    table: Floats,
    parameters: Floats,
    ratios: Floats,
    step: float,
    steps_per_row: int,
    every: int,
    states: int,
    delays: Floats,
    shown: Integers,
    out: Floats,
) -> Floats:
    """State after all rows of the table, shape (size,); fills `out`, one row per `every` steps.

    table: inputs, shape (rows, inputs); step: s; delays: of throttle command and spark, in steps;
    shown: which outputs go into the columns of out, shape (samples, shown). The first entry of the
    returned state is -1 where a gear does not exist.
    """
    new = state.copy()
    now = np.empty(OUTPUTS)
    proceed(
        new, table, parameters, ratios, step, steps_per_row, every, states, delays, shown, out, now
    )
    return new


def proceed(
    state: Floats,
    table: Floats,
    parameters: Floats,
    ratios: Floats,
    step: float,
    steps_per_row: int,
    every: int,
    states: int,
    delays: Floats,
    shown: Integers,
    out: Floats,
    now: Floats,
) -> None:
    """Move a state, shape (size,), through all rows of the table, in place: see `advance`.

    now: room for all outputs of one instant, shape (outputs,). Nothing is allocated, so this is also
    what a program without Python calls.
    """
    ring = (len(state) - HEADER - states) // RINGS
    first = HEADER + states
    history = state[first : first + ring]
    history_rate = state[first + ring : first + 2 * ring]
    commands = state[first + 2 * ring : first + 3 * ring]
    sparks = state[first + 3 * ring : first + 4 * ring]
    p = read_parameters(parameters)
    x = read_states(state[HEADER:first])
    count = int(state[0])
    mask = ring - 1
    taken = 0
    sample = 0
    k1 = x
    c_end, s_end = 0.0, 0.0
    for r in range(len(table)):
        ratio, clutch = transmission(table[r], ratios)
        if ratio == BAD_GEAR:
            state[0] = BAD_GEAR
            return
        u = read_inputs(table[r], ratio, clutch)
        led = slopes(table[r], x, steps_per_row * step)
        if led[0] == led[0]:
            x = with_throttle(x, x[0], led[0])
        known = False  # whether k1 holds the rates at x under the inputs of the step's end
        for _ in range(steps_per_row):
            commands[count & mask] = table[r, THROTTLE_COMMAND]
            sparks[count & mask] = table[r, SPARK]
            c, dc = held_value(commands, count, delays[0])
            s, ds = held_value(sparks, count, delays[1])
            a, da = 0.5 * dc, 0.5 * ds

            if not (known and c - a == c_end and s - da == s_end):
                k1, _y = rates(x, u, led, c - a, s - da, p, step, count, 0.0, history, history_rate)
            z = along(x, 0.5 * step, k1)
            k2, _y = rates(z, u, led, c, s, p, step, count, 0.5, history, history_rate)
            z = past_middle(x, step, k1, k2)
            k3, _y = rates(z, u, led, c + a, s + da, p, step, count, 1.0, history, history_rate)
            x = along(x, step, mean_rate(k1, k2, k3))
            if x[0] < 0.0 or x[0] > 1.0:
                z = with_throttle(x, min(max(x[0], 0.0), 1.0), 0.0)
                k, _y = rates(z, u, led, c + a, s + da, p, step, count, 1.0, history, history_rate)
                position, rate = off_the_stop(x[0], x[1], k[1], step)
                x = with_throttle(x, position, rate)

            count += 1
            history[count & mask] = x[0]
            history_rate[count & mask] = x[1]
            c_end, s_end = c + a, s + da
            taken += 1
            known = taken == every
            if known:
                taken = 0
                k1, y = rates(x, u, led, c_end, s_end, p, step, count, 0.0, history, history_rate)
                write(now, y)
                for i in range(len(shown)):
                    out[sample, i] = now[shown[i]]
                sample += 1
    state[0] = count
    write_states(state[HEADER:first], x)


def evaluate(x: Floats, y: Floats, parameters: Floats, row: Floats, step: float) -> Floats:
    """Rates at x without any delay, shape (states,), in SI; fills the outputs y.

    row: inputs, with the overall ratio for the gear.
    """
    nothing = np.empty(0)
    u = read_inputs(row, row[GEAR], row[CLUTCH])
    led = slopes(row, read_states(x), 1.0)
    p = read_parameters(parameters)
    command, spark = row[THROTTLE_COMMAND], row[SPARK]
    now = len(nothing)  # a 0 that is written in the call would be a type of its own
    k, outputs = rates(read_states(x), u, led, command, spark, p, step, now, 0.0, nothing, nothing)
    write(y, outputs)
    dx = np.empty(len(x))
    write_states(dx, k)
    return dx
