"""Stages of a step with tangents: the three of the rule, a stop of the throttle, and the output.

Steps, stages and stops are those of kernel.py; each of them is differentiated exactly. The functions are part
of the text of the kernel with tangents (see tangents.py).
"""

from slipbench.plant.kernel import Floats, Integers
from slipbench.plant.kernel_rows import FIRST_ROW, K_ROW, SUM_ROW, WIDTH, X_ROW, Z_ROW, copy_rows

START, MIDDLE, END, STOP, OUTPUT = range(5)
STAGES = 5


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


def first_stage(w: Floats, n: int, live: Integers, h: float) -> None:
    """Tangents of x + h k / 2 after the first stage.

    w: all rows, shape (ROWS,); n: columns. live: numbers of states, shape (l,); h: step, s.
    """
    for i in live:
        row = i * WIDTH
        for c in range(row, row + n):
            k = w[K_ROW + c]
            w[FIRST_ROW + c] = k
            w[Z_ROW + c] = w[X_ROW + c] + 0.5 * h * k


def second_stage(w: Floats, n: int, live: Integers, h: float) -> None:
    """Tangents of x + h (2 k2 - k1) after the second stage, and of k1 + 4 k2.

    w: all rows, shape (ROWS,); n: columns. live: numbers of states, shape (l,); h: step, s.
    """
    for i in live:
        row = i * WIDTH
        for c in range(row, row + n):
            first, k = w[FIRST_ROW + c], w[K_ROW + c]
            w[SUM_ROW + c] = first + 4.0 * k
            w[Z_ROW + c] = w[X_ROW + c] + h * (2.0 * k - first)


def last_stage(w: Floats, n: int, live: Integers, h: float) -> None:
    """Tangents of x + h (k1 + 4 k2 + k3) / 6 at the end of a step.

    w: all rows, shape (ROWS,); n: columns. live: numbers of states, shape (l,); h: step, s.
    """
    for i in live:
        row = i * WIDTH
        for c in range(row, row + n):
            w[X_ROW + c] += h / 6.0 * (w[SUM_ROW + c] + w[K_ROW + c])


def stop(w: Floats, n: int, slopes: tuple[float, ...]) -> None:
    """Tangents of position and rate of a plate that passed its stop.

    w: all rows, shape (ROWS,); n: columns. slopes: what `stop_slopes` returns.
    """
    for c in range(n):
        a, b, d = w[X_ROW + c], w[X_ROW + WIDTH + c], w[K_ROW + WIDTH + c]
        w[X_ROW + c] = slopes[2] * a + slopes[3] * b + slopes[4] * d
        w[X_ROW + WIDTH + c] = slopes[5] * a + slopes[6] * b + slopes[7] * d


def stop_slopes(
    position: float, rate: float, push: float, step: float
) -> tuple[float, float, float, float, float, float, float, float]:
    """`kernel.off_the_stop`, then the derivatives of both results. Generated."""
    raise NotImplementedError
