"""Tangents of the inputs: held rows, delayed commands, and states that a recording prescribes.

The functions are part of the text of the kernel with tangents (see tangents.py).
"""

from slipbench.plant.kernel import Floats, Integers
from slipbench.plant.kernel_rows import INPUT_ROW, K_ROW, LED_ROW, WIDTH, X_ROW, Flags, keep

LED_STATES, LED_INPUTS = (0,), (0,)  # written later: states that a recording may prescribe


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


def load_inputs(w: Floats, n: int, driven: Integers, courses: Floats, r: int, has: Flags) -> None:
    """Rows of the inputs that have tangents.

    w: all rows, shape (ROWS,); n: columns. courses: their tangents, shape (driven, rows, n).
    """
    for d in range(len(driven)):
        has[driven[d]] = True
        for c in range(courses.shape[2]):
            w[INPUT_ROW + driven[d] * WIDTH + c] = courses[d, r, c]


def hold(
    ring: Floats, past: Floats, n: int, place: int, row: Floats, column: int, w: Floats
) -> None:
    """Put a command into its ring, and its tangents if it has any.

    ring: shape (2^k,); past: shape (ring * n,); row: inputs, shape (inputs,).
    """
    ring[place] = row[column]
    if len(past):
        keep(past, n, place, w, INPUT_ROW + column * WIDTH)


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
