"""The one function of the kernel that an FMU calls.

Its text is compiled together with the equations, as that of kernel.py is.
"""

from slipbench.plant.kernel import (
    HEADER,
    RINGS,
    Floats,
    Integers,
    proceed,
    rates,
    read_inputs,
    read_parameters,
    read_states,
    slopes,
    transmission,
    write,
)


def present(
    state: Floats,
    table: Floats,
    parameters: Floats,
    ratios: Floats,
    step: float,
    states: int,
    now: Floats,
) -> None:
    """Fill `now`, shape (outputs,), with the outputs at a state whose commands are constant.

    table: one row of inputs, shape (1, inputs); step: s.
    """
    ring = (len(state) - HEADER - states) // RINGS
    first = HEADER + states
    x = read_states(state[HEADER:first])
    ratio, clutch = transmission(table[0], ratios)
    _k, y = rates(
        x,
        read_inputs(table[0], ratio, clutch),
        slopes(table[0], x, step),
        state[first + 2 * ring],
        state[first + 3 * ring],
        read_parameters(parameters),
        step,
        int(state[0]),
        0.0,
        state[first : first + ring],
        state[first + ring : first + 2 * ring],
    )
    write(now, y)


def slipbench_run(
    state: Floats,
    table: Floats,
    parameters: Floats,
    ratios: Floats,
    step: float,
    steps: int,
    states: int,
    delays: Floats,
    shown: Integers,
    out: Floats,
    now: Floats,
) -> None:
    """Move a state, shape (size,), by so many steps, in place; none: only fill the outputs `now`.

    table: one row of inputs, shape (1, inputs); delays: in steps; out: shape (1, 0), shown: (0,).
    """
    if steps == 0:
        present(state, table, parameters, ratios, step, states, now)
    else:
        proceed(
            state, table, parameters, ratios, step, steps, steps, states, delays, shown, out, now
        )
