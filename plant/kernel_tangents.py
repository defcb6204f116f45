"""How tangents of the motorcycle move through time, beside the motorcycle itself.

A tangent is the derivative of a quantity to one uncertain number. The text of these functions is compiled
together with the equations' derivatives (see tangents.py), where `rates_tangents` is written.
"""

from collections.abc import Callable

import numpy as np

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
from slipbench.plant.kernel_inputs import (
    LED_STATES,
    command_row,
    held_slopes,
    hold,
    lead,
    load_inputs,
    prescribe,
    read_row,
)
from slipbench.plant.kernel_rows import (
    COMMAND_ROW,
    LANES,
    ROWS,
    SPARK_ROW,
    WIDTH,
    X_ROW,
    Flags,
    add_one,
    add_row,
    copy_rows,
    keep,
    show_outputs,
    start_rows,
)
from slipbench.plant.kernel_stages import (
    END,
    OUTPUT,
    STAGES,
    begin_stage,
    end_stage,
    first_stage,
    is_due,
    last_stage,
    second_stage,
    stop,
)


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
    tangents, shape (d,); courses: these tangents, shape (d, rows, n); columns, gear_columns,
    delay_columns: of each parameter, gear ratio and delay, or UNUSED; live: states that have
    tangents; wanted: equations whose tangents the rates, the outputs and either of them need, shape
    (3, equations); rows: offset of every shown output's tangents, or -1; slopes: shape
    (shown, samples, n).
    """
    n = -(-slopes.shape[2] // LANES) * LANES  # the columns behind the last one are zero
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
    first_stage,
    second_stage,
    last_stage,
    stop,
    command_row,
    prescribe,
    lead,
)
"""Functions that are compiled as they are."""
