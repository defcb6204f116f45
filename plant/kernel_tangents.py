"""How tangents of the motorcycle move through time, beside the motorcycle itself.

A tangent is the derivative of a quantity to one uncertain number; a row holds those of one quantity
to all numbers, its columns. The text of these functions is compiled together with the equations'
derivatives (see tangents.py), where `rates_tangents` is written. Steps, stages and stops are those
of kernel.py; each of them is differentiated exactly.

All rows stand in one array, WIDTH apart, so that the compiler knows that no two overlap.
"""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from slipbench.plant.kernel import (
    BAD_GEAR,
    GEAR,
    HEADER,
    OUTPUTS,
    RINGS,
    SPARK,
    THROTTLE_COMMAND,
    Floats,
    Integers,
    transmission,
)

Flags = NDArray[np.bool_]

COLUMNS = 64
"""Most columns of one run."""
UNUSED = COLUMNS
"""Column of parameters that are no column: what is written there is never read."""
WIDTH = 72
"""Distance of rows; no power of two, which would put all rows into a few lines of the cache."""
LED_STATES, LED_INPUTS = (0,), (0,)  # written later: states that a recording may prescribe
START, MIDDLE, END, STOP, OUTPUT = range(5)
"""Stages of a step: the three of the rule, a stop of the throttle, and the output."""
STAGES = 5
X_ROW, Z_ROW, K_ROW, FIRST_ROW, SUM_ROW = 0, 0, 0, 0, 0  # written later: state, stage, rates
INPUT_ROW, LED_ROW, COMMAND_ROW, SPARK_ROW, ROWS = 0, 0, 0, 0, 0


def arriving_slopes(
    throttle: float,
    air_delay: float,
    stage: float,
    step: float,
    count: int,
    history: Floats,
    history_rate: Floats,
) -> tuple[float, float, float, int, int, float, float, float, float]:
    """`equations.arriving` with its derivatives.

    Returns the value, its derivatives to throttle and air_delay, two places in the history, and the
    derivatives to position and rate at the first and at the second of them.
    throttle: 0..1; air_delay, step: s; history, history_rate: shape (ring,).
    """
    capacity = len(history)
    furthest = 2.0 - capacity
    back = max(stage - air_delay / step, furthest)
    slope = -1.0 / step if back > furthest else 0.0
    i = count & (capacity - 1)
    if back >= 0.0:
        if stage == 0.0:
            return throttle, 1.0, 0.0, i, i, 0.0, 0.0, 0.0, 0.0
        share = back / stage
        curve = throttle - history[i] - history_rate[i] * step * stage
        value = history[i] + history_rate[i] * step * back + curve * share**2
        to_back = history_rate[i] * step + 2.0 * curve * share / stage
        rate = step * back - step * stage * share**2
        return value, share**2, to_back * slope, i, i, 1.0 - share**2, rate, 0.0, 0.0
    whole = math.floor(back)
    f = back - whole
    i = (count + int(whole)) & (capacity - 1)
    j = (i + 1) & (capacity - 1)
    rise = history[j] - history[i]
    bend = (1.0 - f) * (history_rate[i] * step - rise) - f * (history_rate[j] * step - rise)
    value = history[i] + f * rise + f * (1.0 - f) * bend
    to_bend = 2.0 * rise - (history_rate[i] + history_rate[j]) * step
    to_back = rise + (1.0 - 2.0 * f) * bend + f * (1.0 - f) * to_bend
    to_rise = f + f * (1.0 - f) * (2.0 * f - 1.0)
    first = f * (1.0 - f) * (1.0 - f) * step
    second = -f * (1.0 - f) * f * step
    return value, 0.0, to_back * slope, i, j, 1.0 - to_rise, first, to_rise, second


def rates_tangents(
    w: Floats,
    n: int,
    x: Floats,
    u: Floats,
    throttle_command: float,
    spark: float,
    p: Floats,
    step: float,
    count: int,
    stage: float,
    history: Floats,
    history_rate: Floats,
    past: Floats,
    past_rate: Floats,
    columns: Integers,
    gear_column: int,
    driven: Flags,
    wanted: Flags,
    k: Floats,
    y: Floats,
) -> None:
    """Rates k and outputs y at the states x, and their tangents. Generated for each set of effects.

    The tangents of x are the rows from Z_ROW of w, those of k come from K_ROW on. past, past_rate:
    tangents of the history. driven: which inputs have tangents; wanted: which equations' are
    needed.
    x, k: shape (states,), SI; w: all rows, shape (ROWS,).
    """
    raise NotImplementedError


def read_row(u: Floats, row: Floats, ratio: float, clutch: float) -> None:
    """Write the held inputs into u. Generated.

    u, row: shape (inputs,), SI.
    """
    raise NotImplementedError


def held_slopes(ring: Floats, count: int, delay_steps: float) -> tuple[float, float, float, float]:
    """`kernel.held_value` with its derivatives to the delay. Generated.

    ring: shape (2^k,); delay_steps: in steps.
    """
    raise NotImplementedError


def stop_slopes(
    position: float, rate: float, push: float, step: float
) -> tuple[float, float, float, float, float, float, float, float]:
    """`kernel.off_the_stop`, then the derivatives of both results. Generated."""
    raise NotImplementedError


def add_one(w: Floats, place: int, slope: float) -> None:
    """Add a parameter's derivative at its column.

    w: all rows, shape (ROWS,); place: of the row and its column.
    """
    w[place] += slope


def add_row(w: Floats, n: int, to: int, slope: float, row: int) -> None:
    """Add a row times a slope to another.

    w: all rows, shape (ROWS,); n: columns.
    """
    for c in range(n):
        w[to + c] += slope * w[row + c]


def copy_rows(w: Floats, n: int, live: Integers, to: int, block: int) -> None:
    """Copy the rows of states from one block to another.

    w: all rows, shape (ROWS,); n: columns. live: numbers of states, shape (l,).
    """
    for i in live:
        a, b = i * WIDTH, i * WIDTH + n
        new, old = w[to + a : to + b], w[block + a : block + b]
        for c in range(n):
            new[c] = old[c]


def keep(past: Floats, n: int, place: int, w: Floats, row: int) -> None:
    """Keep a row in a ring.

    past: shape (ring * n,); w: all rows, shape (ROWS,).
    """
    kept, now = past[place * n : place * n + n], w[row : row + n]
    for c in range(n):
        kept[c] = now[c]


def show(to: Floats, row: Floats) -> None:
    """Write a row where it is to be seen.

    to, row: shape (n,).
    """
    for c in range(len(to)):
        to[c] = row[c]


def first_stage(w: Floats, n: int, live: Integers, h: float) -> None:
    """Tangents of x + h k / 2 after the first stage.

    w: all rows, shape (ROWS,); n: columns. live: numbers of states, shape (l,); h: step, s.
    """
    for i in live:
        a, b = i * WIDTH, i * WIDTH + n
        x, z = w[X_ROW + a : X_ROW + b], w[Z_ROW + a : Z_ROW + b]
        k, first = w[K_ROW + a : K_ROW + b], w[FIRST_ROW + a : FIRST_ROW + b]
        for c in range(n):
            first[c] = k[c]
            z[c] = x[c] + 0.5 * h * k[c]


def second_stage(w: Floats, n: int, live: Integers, h: float) -> None:
    """Tangents of x + h (2 k2 - k1) after the second stage, and of k1 + 4 k2.

    w: all rows, shape (ROWS,); n: columns. live: numbers of states, shape (l,); h: step, s.
    """
    for i in live:
        a, b = i * WIDTH, i * WIDTH + n
        x, z = w[X_ROW + a : X_ROW + b], w[Z_ROW + a : Z_ROW + b]
        k, first = w[K_ROW + a : K_ROW + b], w[FIRST_ROW + a : FIRST_ROW + b]
        total = w[SUM_ROW + a : SUM_ROW + b]
        for c in range(n):
            total[c] = first[c] + 4.0 * k[c]
            z[c] = x[c] + h * (2.0 * k[c] - first[c])


def last_stage(w: Floats, n: int, live: Integers, h: float) -> None:
    """Tangents of x + h (k1 + 4 k2 + k3) / 6 at the end of a step.

    w: all rows, shape (ROWS,); n: columns. live: numbers of states, shape (l,); h: step, s.
    """
    for i in live:
        a, b = i * WIDTH, i * WIDTH + n
        x, k = w[X_ROW + a : X_ROW + b], w[K_ROW + a : K_ROW + b]
        total = w[SUM_ROW + a : SUM_ROW + b]
        for c in range(n):
            x[c] += h / 6.0 * (total[c] + k[c])


def stop(w: Floats, n: int, slopes: tuple[float, ...]) -> None:
    """Tangents of position and rate of a plate that passed its stop.

    w: all rows, shape (ROWS,); n: columns. slopes: what `stop_slopes` returns.
    """
    for c in range(n):
        a, b, d = w[X_ROW + c], w[X_ROW + WIDTH + c], w[K_ROW + WIDTH + c]
        w[X_ROW + c] = slopes[2] * a + slopes[3] * b + slopes[4] * d
        w[X_ROW + WIDTH + c] = slopes[5] * a + slopes[6] * b + slopes[7] * d


def command_row(
    w: Floats,
    n: int,
    row: int,
    past: Floats,
    count: int,
    delay_steps: float,
    rise: float,
    column: int,
    slope: float,
) -> None:
    """Tangents of a delayed command: `rise` of the rise over a step beside its mean.

    past: tangents of the command, empty where it has none; column, slope: of the delay.
    w: all rows, shape (ROWS,); past: shape (ring * n,).
    """
    for c in range(n):
        w[row + c] = 0.0
    if len(past):
        whole = int(delay_steps)
        f = delay_steps - whole
        old = f - rise * 6.0 * f * (1.0 - f)
        mask = len(past) // n - 1
        i, j = ((count - whole) & mask) * n, ((count - whole - 1) & mask) * n
        for c in range(n):
            w[row + c] = (1.0 - old) * past[i + c] + old * past[j + c]
    w[row + column] += slope


def prescribe(w: Floats, n: int, k: Floats, led: Floats) -> None:
    """Put the slopes of what a recording prescribes in the place of the rates.

    w: all rows, shape (ROWS,); n: columns. k: shape (states,), SI; led: shape (4,), SI/s, NaN: free.
    """
    for j in range(len(LED_STATES)):
        if led[j] == led[j]:
            i = LED_STATES[j]
            k[i] = led[j]
            for c in range(n):
                w[K_ROW + i * WIDTH + c] = w[LED_ROW + j * WIDTH + c]
    if led[0] == led[0]:
        k[1] = 0.0
        for c in range(n):
            w[K_ROW + WIDTH + c] = 0.0


def lead(w: Floats, n: int, x: Floats, led: Floats, row: Floats, duration: float) -> None:
    """Slopes of what a recording prescribes over the row of inputs; NaN: free.

    w: all rows, shape (ROWS,); n: columns. x: shape (states,), SI; led: shape (4,), SI/s; duration: s.
    """
    for j in range(len(LED_STATES)):
        i, column = LED_STATES[j], LED_INPUTS[j]
        led[j] = (row[column] - x[i]) / duration
        if led[j] == led[j]:
            for c in range(n):
                rise = w[INPUT_ROW + column * WIDTH + c] - w[X_ROW + i * WIDTH + c]
                w[LED_ROW + j * WIDTH + c] = rise / duration
    if led[0] == led[0]:
        x[1] = led[0]
        for c in range(n):
            w[X_ROW + WIDTH + c] = w[LED_ROW + c]


def start_rows(
    w: Floats, n: int, live: Integers, starts: Floats, past: Floats, past_rate: Floats
) -> None:
    """Rows of the initial states, and a history of the throttle's.

    w: all rows, shape (ROWS,); n: columns. starts: shape (states, n); past, past_rate: shape (ring * n,).
    """
    for i in live:
        show(w[X_ROW + i * WIDTH : X_ROW + i * WIDTH + n], starts[i])
    for place in range(len(past) // max(n, 1)):
        keep(past, n, place, w, X_ROW)
        keep(past_rate, n, place, w, X_ROW + WIDTH)


def load_inputs(w: Floats, n: int, driven: Integers, courses: Floats, r: int, has: Flags) -> None:
    """Rows of the inputs that have tangents.

    w: all rows, shape (ROWS,); n: columns. courses: shape (driven, rows, n).
    """
    for d in range(len(driven)):
        has[driven[d]] = True
        start = INPUT_ROW + driven[d] * WIDTH
        show(w[start : start + n], courses[d, r])


def hold(
    ring: Floats, past: Floats, n: int, place: int, row: Floats, column: int, w: Floats
) -> None:
    """Put a command into its ring, and its tangents if it has any.

    ring: shape (2^k,); past: shape (ring * n,); row: inputs, shape (inputs,).
    """
    ring[place] = row[column]
    if len(past):
        keep(past, n, place, w, INPUT_ROW + column * WIDTH)


def is_due(stage: int, kept: bool, position: float, shown: bool) -> bool:
    """Whether rates are needed: at a step's start unless they are known, and at a stop."""
    if stage == START:
        return not kept
    if stage == STOP:
        return position < 0.0 or position > 1.0
    return stage < STOP or shown


def begin_stage(w: Floats, n: int, live: Integers, x: Floats, z: Floats, stage: int) -> None:
    """Take the states themselves for those of the stage, on the stop at the STOP.

    w: all rows, shape (ROWS,); n: columns. x, z: shape (states,), SI.
    """
    if stage == START or stage >= STOP:
        for i in range(len(x)):
            z[i] = x[i]
        copy_rows(w, n, live, Z_ROW, X_ROW)
    if stage == STOP:
        z[0], z[1] = min(max(x[0], 0.0), 1.0), 0.0
        for c in range(n):
            w[Z_ROW + c] = 0.0
            w[Z_ROW + WIDTH + c] = 0.0


def end_stage(
    w: Floats,
    n: int,
    live: Integers,
    x: Floats,
    z: Floats,
    k: Floats,
    first: Floats,
    total: Floats,
    step: float,
    stage: int,
) -> None:
    """States of the next stage from the rates of this one.

    w: all rows, shape (ROWS,); n: columns. x, z, k, first, total: shape (states,), SI; step: s.
    """
    if stage == START:
        for i in range(len(x)):
            first[i] = k[i]
            z[i] = x[i] + 0.5 * step * k[i]
        first_stage(w, n, live, step)
    elif stage == MIDDLE:
        for i in range(len(x)):
            total[i] = first[i] + 4.0 * k[i]
            z[i] = x[i] + step * (2.0 * k[i] - first[i])
        second_stage(w, n, live, step)
    elif stage == END:
        for i in range(len(x)):
            x[i] = x[i] + step * ((total[i] + k[i]) / 6.0)
        last_stage(w, n, live, step)
    elif stage == STOP:
        slopes = stop_slopes(x[0], x[1], k[1], step)
        x[0], x[1] = slopes[0], slopes[1]
        stop(w, n, slopes)


def show_outputs(
    sample: int, shown: Integers, rows: Integers, y: Floats, out: Floats, w: Floats, slopes: Floats
) -> None:
    """Write a sample of the outputs and their tangents.

    out: shape (samples, shown); slopes: shape (shown, samples, n).
    """
    for i in range(len(shown)):
        out[sample, i] = y[shown[i]]
        if rows[i] >= 0:
            show(slopes[i, sample], w[rows[i] : rows[i] + slopes.shape[2]])


def advance_tangents(
    state: Floats,
    table: Floats,
    p: Floats,
    ratios: Floats,
    step: float,
    steps_per_row: int,
    every: int,
    states: int,
    delays: Floats,
    shown: Integers,
    out: Floats,
    starts: Floats,
    driven: Integers,
    courses: Floats,
    columns: Integers,
    gear_columns: Integers,
    delay_columns: Integers,
    live: Integers,
    wanted: Flags,
    rows: Integers,
    slopes: Floats,
) -> float:
    """Fill the outputs, as `kernel.advance` does, and their tangents; BAD_GEAR for no such gear.

    starts: tangents of the state, shape (states, n), n at most COLUMNS; driven: inputs that have
    tangents, shape (d,), and these in courses, shape (d, rows, n); columns, gear_columns,
    delay_columns: of each parameter, gear ratio and delay, or UNUSED; live: states that have
    tangents; wanted: equations whose tangents the rates, the outputs and either of them need, shape
    (3, equations); rows: offset of every shown output's tangents, or -1; slopes: shape
    (shown, samples, n).
    """
    n = slopes.shape[2]
    ring = (len(state) - HEADER - states) // RINGS
    first = HEADER + states
    mask = ring - 1
    history = state[first : first + ring].copy()
    history_rate = state[first + ring : first + 2 * ring].copy()
    commands = state[first + 2 * ring : first + 3 * ring].copy()
    sparks = state[first + 3 * ring : first + 4 * ring].copy()
    x, z = state[HEADER:first].copy(), state[HEADER:first].copy()
    k, k1, total = np.empty(states), np.empty(states), np.empty(states)
    y, led, u = np.empty(OUTPUTS), np.empty(len(LED_STATES)), np.empty(table.shape[1])
    w, has = np.zeros(ROWS), np.zeros(table.shape[1], np.bool_)
    past, past_rate = np.empty(ring * n), np.empty(ring * n)
    start_rows(w, n, live, starts, past, past_rate)
    past_command = np.zeros(ring * n if THROTTLE_COMMAND in driven else 0)
    past_spark = np.zeros(ring * n if SPARK in driven else 0)
    count, taken, sample = int(state[0]), 0, 0
    c_end, s_end = 0.0, 0.0
    for r in range(len(table)):
        ratio, clutch = transmission(table[r], ratios)
        if ratio == BAD_GEAR:
            return BAD_GEAR
        gear = gear_columns[max(int(table[r, GEAR]), 1) - 1]
        read_row(u, table[r], ratio, clutch)
        load_inputs(w, n, driven, courses, r, has)
        lead(w, n, x, led, table[r], steps_per_row * step)
        known = False  # whether k holds the rates at x under the inputs of the step's end
        for s in range(steps_per_row):
            hold(commands, past_command, n, count & mask, table[r], THROTTLE_COMMAND, w)
            hold(sparks, past_spark, n, count & mask, table[r], SPARK, w)
            c, dc, c_slope, dc_slope = held_slopes(commands, count, delays[0])
            a, da, a_slope, da_slope = held_slopes(sparks, count, delays[1])
            known = known and c - 0.5 * dc == c_end and a - 0.5 * da == s_end
            c_end, s_end = c + 0.5 * dc, a + 0.5 * da
            for stage in range(STAGES):
                share = min(0.5 * stage, 1.0) - 0.5
                needed = 0
                if stage == OUTPUT:
                    count += 1
                    history[count & mask] = x[0]
                    history_rate[count & mask] = x[1]
                    keep(past, n, count & mask, w, X_ROW)
                    keep(past_rate, n, count & mask, w, X_ROW + WIDTH)
                    taken += 1
                    needed = 2 if s + 1 < steps_per_row else 1
                due = is_due(stage, known, x[0], taken == every)
                if due:
                    begin_stage(w, n, live, x, z, stage)
                    if stage <= END:
                        slope = (c_slope + share * dc_slope) / step
                        column = delay_columns[0]
                        command_row(
                            w, n, COMMAND_ROW, past_command, count, delays[0], share, column, slope
                        )
                        slope = (a_slope + share * da_slope) / step
                        column = delay_columns[1]
                        command_row(
                            w, n, SPARK_ROW, past_spark, count, delays[1], share, column, slope
                        )
                    rates_tangents(
                        w,
                        n,
                        z,
                        u,
                        c + share * dc,
                        a + share * da,
                        p,
                        step,
                        count,
                        0.0 if stage == OUTPUT else share + 0.5,
                        history,
                        history_rate,
                        past,
                        past_rate,
                        columns,
                        gear,
                        has,
                        wanted[needed],
                        k,
                        y,
                    )
                    if stage == OUTPUT:
                        show_outputs(sample, shown, rows, y, out, w, slopes)
                        sample += 1
                        taken = 0
                    prescribe(w, n, k, led)
                if due or stage <= END:
                    end_stage(w, n, live, x, z, k, k1, total, step, stage)
                known = stage == OUTPUT and due
    return 0.0


SMALL: dict[Callable[..., None], str] = {
    add_one: "void(f8[::1],i8,f8)",
    add_row: "void(f8[::1],i8,i8,f8,i8)",
}
"""With their signatures."""
PARTS = (
    start_rows,
    load_inputs,
    hold,
    is_due,
    begin_stage,
    end_stage,
    show_outputs,
    copy_rows,
    keep,
    show,
    first_stage,
    second_stage,
    last_stage,
    stop,
    command_row,
    prescribe,
    lead,
)
"""Functions that are compiled as they are."""
