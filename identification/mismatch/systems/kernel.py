"""Generate the text of one compiled kernel from the equations of a model file, effects included.

An effect is passed as numbers: code, place, index of the other quantity, parameters. So one kernel
serves every combination of effects and is compiled once per model file (plant/compiled.py keeps it
on disk). Integration uses the classical fourth-order Runge-Kutta method; within a row an input is
held or interpolated linearly.

A held input jumps between rows. Memories of effects are therefore updated twice there: at the end
of a row with the input of that row, and at the begin of the next row with the new input and zero
elapsed time. Otherwise a memory would follow the new input during the step before the jump, or
would miss a value from which the input jumps back.
"""

import inspect
import math
from collections.abc import Iterable, Iterator
from itertools import count
from types import ModuleType

from slipbench.identification.mismatch.systems.board import LAYOUT, STATES_OF_ONE
from slipbench.identification.mismatch.systems.effects.library import CODES, LIBRARY
from slipbench.identification.mismatch.systems.effects.seam_effect import SeamEffect
from slipbench.identification.mismatch.systems.equations import Equations, rate_name
from slipbench.identification.mismatch.systems.expression import LATE, PREFIX, Delay
from slipbench.identification.mismatch.systems.kernel_parts import (
    END,
    FIRST,
    KEEP,
    LINE,
    PAST,
    ROW,
    STEP,
    WITHIN,
)
from slipbench.identification.mismatch.systems.stop_parts import functions, in_run
from slipbench.plant.compiled import FLAGS, inlined, load, made_once, text_of

FINE, NOT_FINITE = 0.0, 1.0
CURVE, PERIODIC_CURVE = -1, -3
"""Codes of free curves; all other codes are those of library effects."""
ONE_TURN = 2.0 * math.pi
OWN = -2
"""Index of a curve's regressor where it is the quantity at the curve's own place."""
TYPES = (
    "from slipbench.identification.mismatch.systems.board import ADVANCE, AT"
    f"  # a record of {LAYOUT.itemsize} bytes"
)
MOMENT = "fraction, elapsed, when, "
COMMON = f"{MOMENT}board, tables, rings, count, step"
ALL = f"{COMMON}, push, values, busy"
"""Further arguments of `rates`: disturbances and values of all places, flags of places in use."""
LINES = ", delay_rings, delay_ends"
"""Further arguments where an equation has a delay: the past of each delayed quantity."""

VIEWS = "x, dx, q, spill = board.x, board.dx, board.q, board.spill"
RUN = """def advance(x0, u, slopes, held, push, p, boards, tables, ring, step, substeps, out):
    board = boards[0]
    n = board.effects
    size = len(x0)
    states = size + {most} * n
    x = np.zeros(states)
    x[:size] = x0{at_first}
    stage, k, total = board.x[:states], board.dx[:states], np.zeros(states)
    stage[:] = x
    now, q = np.zeros(u.shape[1]), board.q
    rings, values = np.zeros((n, 2, ring)), np.zeros(push.shape[1]){delays}
    busy = np.zeros(push.shape[1], np.bool_)
    for i in range(n):
        busy[board.where[i]] = True
    count = 0
    for r in range(len(u)):
        before = u[r - 1] if r > 0 else u[0]
        for turn in range(4 * substeps + 1):
            s, part = turn // 4, turn % 4
            last = turn == 4 * substeps
            fraction = 0.0 if part == 0 else (1.0 if part == 3 else 0.5)
            if last:
                s, fraction = substeps - 1, 1.0
            for i in range(len(now)):
                line = before[i] + (u[r, i] - before[i]) * (s + fraction) / substeps
                now[i] = u[r, i] if held[i] else line
                q[1 + i] = slopes[r, i]
            q[0] = (r * substeps + s + fraction) * step
            when, elapsed = {within}, fraction * step
            if last:
                when = {end}
            elif part == 0 and s > 0:
                when, elapsed = {step}, step
            elif part == 0:
                when = {row} if r > 0 else {first}
            rates(now, p, {rest})
            if last:
                break
            if when == {first}:
                x[:] = stage{at_begin}
            weight = 1.0 if part == 0 or part == 3 else 2.0
            for i in range(states):
                total[i] = weight * k[i] + (0.0 if part == 0 else total[i])
            if part == 3:
                for i in range(states):
                    x[i] += step / 6.0 * total[i]
                    stage[i] = x[i]{at_end}
                if s < substeps - 1:
                    count += 1
            else:
                ahead = step if part == 2 else 0.5 * step
                for i in range(states):
                    stage[i] = x[i] + ahead * k[i]{at_stage}
        count += 1
        for i in range(len(values)):
            out[r, i] = values[i]
        for i in range(size):
            out[r, len(values) + i] = x[i]
            if not math.isfinite(x[i]):
                return {bad}
    return {fine}
"""


@made_once
def compose(equations: Equations) -> ModuleType:
    """Return the compiled kernel: a module with `advance`."""
    return load(kernel_text(equations, effects_module().__name__))


@made_once
def effects_module() -> ModuleType:
    """Return the compiled effects and curves of all systems: a module with `at`."""
    act = called(place_text("at", LIBRARY), "AT")
    return load("\n".join((TYPES, *effects_texts(LIBRARY), act)))


def called(text: str, signature: str) -> str:
    """Return the text of a function that Python calls. signature: name of the type in board.py."""
    return f"@njit({signature}, {FLAGS}, cache=True, nogil=True)\n{text}\n"


def effects_texts(kinds: Iterable[type[SeamEffect]]) -> list[str]:
    """Return the texts of the functions that `place_text` calls."""
    acts = [inlined(text_of(k.act, f"act_{k.name}")) for k in kinds if k.act is not None]
    return [*acts, inlined(KEEP), inlined(PAST), inlined(LINE)]


def kernel_text(equations: Equations, effects: str) -> str:
    """Return the text of a system's kernel. effects: name of the module of compiled effects."""
    parts = [TYPES, f"from {effects} import at"]
    if equations.delays:
        parts += [inlined(KEEP), inlined(PAST)]
    parts.append(inlined("\n".join(_rates_lines(equations))))
    arguments = _arguments_of_rates(equations)
    run_arguments = arguments.replace("push", "push[r]")
    if equations.stops:
        parts += map(inlined, functions(arguments.removeprefix(MOMENT), VIEWS))
    run = RUN.format(
        most=STATES_OF_ONE,
        rest=run_arguments,
        bad=NOT_FINITE,
        fine=FINE,
        within=WITHIN,
        first=FIRST,
        row=ROW,
        step=STEP,
        end=END,
        delays=_past_arrays(equations),
        **in_run(
            equations.stops,
            equations.states,
            equations.parameters,
            run_arguments.removeprefix(MOMENT),
        ),
    )
    return "\n".join([*parts, called(run, "ADVANCE")])


def _arguments_of_rates(e: Equations) -> str:
    return ALL + (LINES if e.delays else "")


def _past_arrays(e: Equations) -> str:
    """Return the line that allocates the past of delayed quantities; empty without delays."""
    total = sum(len(delays) for _, delays in e.delays)
    arrays = f"np.zeros(({total}, 2, ring)), np.zeros(({total}, 1))"
    return f"\n    {LINES.removeprefix(', ')} = {arrays}" if total else ""


def first_input(e: Equations) -> int:
    """Return the index of the first input among the quantities that effects and curves may use.

    The order: time, the rate of each input, seams, rates of states, inputs, states.
    """
    return 1 + len(e.inputs) + len(e.seams) + len(e.states)


def place_text(name: str, kinds: Iterable[type[SeamEffect]]) -> str:
    """Return the text of a function that applies the effects and curves at a place to its quantity.

    kinds: effects that it can apply.
    """
    return "\n".join(_place_lines(name, kinds))


def _place_lines(name: str, kinds: Iterable[type[SeamEffect]]) -> Iterator[str]:
    yield f"def {name}(j, value, own, {COMMON}):"
    yield f"    {VIEWS}"
    yield "    code, where, other = board.code, board.where, board.other"
    yield "    par, memory = board.par, board.memory"
    yield "    for i in range(board.effects):"
    yield "        if where[i] != j:"
    yield "            continue"
    yield f"        b = board.states + {STATES_OF_ONE} * i"
    yield "        z = q[other[i]] if other[i] >= 0 else 0.0"
    yield f"        if when == {FIRST}:"
    yield "            memory[i, :] = value"
    yield "        if code[i] < 0:"
    yield f"            along = value if other[i] == {OWN} else z"
    yield f"            if code[i] == {PERIODIC_CURVE}:"
    yield f"                along -= {ONE_TURN!r} * math.floor(along / {ONE_TURN!r})"
    yield "            value += line(tables[i], along)"
    yield "            continue"
    word = "if"
    for kind in kinds:
        if kind.act is not None:
            yield f"        {word} code[i] == {CODES[kind.name]}:"
            yield from (f"            {line}" for line in _branch(kind))
            word = "elif"
    yield "    return value"


def _branch(kind: type[SeamEffect]) -> Iterator[str]:
    names = [p.name for p in kind.parameters()]
    expressions = {
        "value": "value",
        "other": "z",
        "memory": "memory[i, 0]",
        "second": "memory[i, 1]",
        "third": "memory[i, 2]",
        "fourth": "memory[i, 3]",
        "step": "step",
        "elapsed": "elapsed",
        "rate_of": "own",
    }
    expressions |= {name: f"par[i, {k}]" for k, name in enumerate(names)}
    expressions |= {name: f"x[b + {k}]" for k, name in enumerate(kind.states)}
    yield from _starts(kind)
    assert kind.act is not None
    arguments = inspect.signature(kind.act).parameters
    if kind.delay_parameter:
        yield "keep(rings[i], memory[i], count, when, value)"
        delay = expressions[kind.delay_parameter]
        expressions["past"] = f"past(rings[i], count, fraction, value, {delay} / step)"
    passed = ", ".join(expressions[a] for a in arguments)
    call = f"act_{kind.name}({passed})"
    if kind.remembers:
        memories = [f"kept_{k}" for k in range(kind.remembers)]
        yield f"value, {', '.join(memories)} = {call}"
        yield f"if when != {WITHIN}:"
        yield from (f"    memory[i, {k}] = {name}" for k, name in enumerate(memories))
    elif kind.gives:
        yield f"value, given = {call}"
        yield "if other[i] >= 0:"
        yield "    spill[other[i] - board.first_state] += given"
    elif kind.states:
        yield f"value, {', '.join(f'dx[b + {k}]' for k in range(len(kind.states)))} = {call}"
    else:
        yield f"value = {call}"


def _starts(kind: type[SeamEffect]) -> Iterator[str]:
    """Yield lines that set initial states and memories where they differ from the defaults."""
    if kind.remembers:
        lines = [f"memory[i, {k}] = {s}" for k, s in enumerate(kind.starts) if s != "value"]
    else:
        lines = [f"x[b + {k}] = value" for k, s in enumerate(kind.starts) if s == "value"]
    if lines:
        yield f"if when == {FIRST}:"
        yield from (f"    {line}" for line in lines)


def _rates_lines(e: Equations) -> Iterator[str]:
    """Yield the lines of `rates`: it sets the rates of all states and the values of all places."""
    first = first_input(e)
    delayed = _delay_lines(e)
    yield f"def rates(u, p, {_arguments_of_rates(e)}):"
    yield f"    {VIEWS}"
    yield f"    for i in range({len(e.states)}):"
    yield "        spill[i] = 0.0"
    for k, name in enumerate(e.parameters):
        yield f"    {PREFIX}{name} = p[{k}]"
    for k, name in enumerate(e.states):
        yield f"    {PREFIX}{name} = x[{k}]"
        yield f"    q[{first + len(e.inputs) + k}] = x[{k}]"
    for k in range(len(e.inputs)):
        yield f"    q[{first + k}] = u[{k}]"
    numbers = iter(range(len(e.places)))
    for k, name in enumerate(e.inputs):
        yield from _at(next(numbers), f"{PREFIX}{name}", f"u[{k}]")
        yield f"    q[{first + k}] = {PREFIX}{name}"
    for name, text in e.seams:
        yield from delayed.get(name, ())
        yield from _at(number := next(numbers), f"{PREFIX}{name}", text)
        yield f"    q[{1 + number}] = {PREFIX}{name}"
    for k, text in enumerate(e.rates):
        yield from delayed.get(rate_name(e.states[k]), ())
        yield from _at(number := next(numbers), f"dx[{k}]", text, own=f"x[{k}]")
        yield f"    q[{1 + number}] = dx[{k}]"
    for name, text in e.outputs:
        yield from delayed.get(name, ())
        yield from _at(next(numbers), "shown", text)
    yield f"    for i in range({len(e.states)}):"
    yield "        dx[i] += spill[i]"


def _delay_lines(e: Equations) -> dict[str, list[str]]:
    """Return the lines that evaluate the delayed quantities of each place's equation, by place."""
    numbers = count()
    return {
        place: [
            line
            for k, d in enumerate(delays)
            for line in _delay_update(f"{LATE}{k}", d, next(numbers))
        ]
        for place, delays in e.delays
    }


def _delay_update(name: str, delay: Delay, number: int) -> Iterator[str]:
    """Yield the lines of one delayed quantity; a comparison gives the number 0 or 1."""
    time = f"{PREFIX}{delay.time}" if isinstance(delay.time, str) else repr(delay.time)
    ring = f"delay_rings[{number}]"
    yield f"    {name} = 0.0 + ({delay.text})"
    yield f"    keep({ring}, delay_ends[{number}], count, when, {name})"
    yield f"    {name} = past({ring}, count, fraction, {name}, {time} / step)"


def _at(place: int, name: str, text: str, own: str = "np.nan") -> Iterator[str]:
    """Yield the lines that evaluate a quantity; a place without effects costs no call.

    The equation is in parentheses: otherwise the last branch of a conditional, or the last side of
    a comparison, would include the added disturbance.
    """
    yield f"    {name} = ({text}) + push[{place}]"
    yield f"    if busy[{place}]:"
    yield f"        {name} = at({place}, {name}, {own}, {COMMON})"
    yield f"    values[{place}] = {name}"
