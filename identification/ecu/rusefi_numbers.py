"""Numbers in a script as rusEFI's Lua reads them.

Its numbers are single precision, and its parser knows no exponent: it reads the digits after the
point as a whole number and divides by a power of ten, both in single precision (strtof_rusefi in
lua.cpp). A whole number below 2^24 is exact there, so a fraction has at most seven digits that count.
"""

import math
import re

import numpy as np

from slipbench.identification.ecu.rusefi import SINGLE_DIGITS

MOST_DIGITS = 37  # after the point: 10^37 is finite in single precision
FRACTION = re.compile(r"\d*\.\d+")


def literal(value: float) -> str:
    """Text of a number for a script, in brackets where it is negative. Raises ValueError for NaN."""
    if not math.isfinite(value):
        raise ValueError(f"a script cannot hold {value}")
    text = _unsigned(abs(value))
    return f"({'-' if value < 0.0 else ''}{text})" if value < 0.0 else text


def parsed(text: str) -> float:
    """Value that rusEFI reads from an unsigned decimal text, rounded as there at each step."""
    whole, _, digits = text.partition(".")
    number = np.float32(0.0)
    for digit in digits:
        number = np.float32(10) * number + np.float32(int(digit))
    before = np.float32(0.0)
    for digit in whole:
        before = np.float32(10) * before + np.float32(int(digit))
    return float(before + number / _divisor(len(digits)))


def _divisor(digits: int) -> np.float32:
    """Power of ten as the parser has it: beyond 10^10 it is rounded at each digit."""
    divisor = np.float32(1.0)
    for _ in range(digits):
        divisor = np.float32(10) * divisor
    return divisor


def as_read(script: str) -> str:
    """A script whose decimal fractions are replaced by the values that rusEFI reads from them."""
    return FRACTION.sub(lambda found: repr_of(parsed(found[0])), script)


def repr_of(value: float) -> str:
    """Text from which every other Lua reads exactly this value."""
    return value.hex()


def _unsigned(value: float) -> str:
    """Text that the parser reads as the nearest number.

    It has the most digits of which the parser reads the whole number exactly, or one more: that is
    rounded, but to less than what a missing digit may cost.
    """
    whole = math.floor(value)
    fraction = value - whole
    if fraction == 0.0:
        return f"{whole}.0"
    digits = 1
    while digits < MOST_DIGITS and round(fraction * 10 ** (digits + 1)) < SINGLE_DIGITS:
        digits += 1
    texts = (_with(whole, fraction, d) for d in (digits, min(digits + 1, MOST_DIGITS)))
    return min(texts, key=lambda text: abs(parsed(text) - value))


def _with(whole: int, fraction: float, digits: int) -> str:
    """Text with so many digits: the fraction times the parser's divisor, so that its rounding cancels."""
    scaled = round(fraction * float(_divisor(digits)))
    if scaled >= 10**digits:
        return f"{whole + 1}.0"
    return f"{whole}.{scaled:0{digits}d}".rstrip("0") + ("0" if scaled == 0 else "")
