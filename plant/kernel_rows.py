"""Rows of tangents in one array, and what is done with a row: add, copy, keep.

A row holds the derivatives of one quantity to all uncertain numbers, its columns. All rows stand in one
array, WIDTH apart, so that the compiler knows that no two overlap. The functions are part of the text of
the kernel with tangents (see tangents.py), which writes the offsets of the rows.
"""

import numpy as np
from numpy.typing import NDArray

from slipbench.plant.kernel import Floats, Integers

Flags = NDArray[np.bool_]

COLUMNS = 64
"""Most columns of one run."""
UNUSED = COLUMNS
"""Column of parameters that are no column: what is written there is never read."""
WIDTH = 72
"""Distance of rows; no power of two, which would put all rows into a few lines of the cache."""
LANES = 8
"""Columns that the processor computes at once: rows are worked on in whole multiples."""
X_ROW, Z_ROW, K_ROW, FIRST_ROW, SUM_ROW = 0, 0, 0, 0, 0  # written later: state, stage, rates
INPUT_ROW, LED_ROW, COMMAND_ROW, SPARK_ROW, ROWS = 0, 0, 0, 0, 0


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
        row = i * WIDTH
        for c in range(row, row + n):
            w[to + c] = w[block + c]


def keep(past: Floats, n: int, place: int, w: Floats, row: int) -> None:
    """Keep a row in a ring.

    past: shape (ring * n,); w: all rows, shape (ROWS,).
    """
    for c in range(n):
        past[place * n + c] = w[row + c]


def start_rows(
    w: Floats, n: int, live: Integers, starts: Floats, past: Floats, past_rate: Floats
) -> None:
    """Rows of the initial states, and a history of the throttle's.

    w: all rows, shape (ROWS,); n: columns. starts: shape (states, n); past, past_rate: shape (ring * n,).
    """
    for i in live:
        for c in range(starts.shape[1]):
            w[X_ROW + i * WIDTH + c] = starts[i, c]
    for place in range(len(past) // max(n, 1)):
        keep(past, n, place, w, X_ROW)
        keep(past_rate, n, place, w, X_ROW + WIDTH)


def show_outputs(
    sample: int, shown: Integers, rows: Integers, y: Floats, out: Floats, w: Floats, slopes: Floats
) -> None:
    """Write a sample of the outputs and their tangents.

    out: shape (samples, shown); slopes: shape (shown, samples, n).
    """
    for i in range(len(shown)):
        out[sample, i] = y[shown[i]]
        if rows[i] >= 0:
            for c in range(slopes.shape[2]):
                slopes[i, sample, c] = w[rows[i] + c]
