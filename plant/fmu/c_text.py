"""Numbers as C source text."""

import math


def c_number(value: float) -> str:
    """Return the text of a number, also of one that is not finite (macros of math.h)."""
    if math.isnan(value):
        return "NAN"
    return repr(value) if math.isfinite(value) else ("INFINITY" if value > 0.0 else "-INFINITY")
