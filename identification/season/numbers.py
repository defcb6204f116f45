"""Numbers with their intervals, as text: as many digits as the interval is worth."""

import math


def digits(value: float, low: float | None, high: float | None) -> int:
    """Decimals to show, so that the half width of the interval has two digits; without one, four."""
    width = (high - low) / 2 if low is not None and high is not None else 0.0
    if not math.isfinite(width) or width <= 0:
        return _decimals(abs(value), 4)
    return _decimals(width, 2)


def _decimals(size: float, significant: int) -> int:
    if not math.isfinite(size) or size <= 0:
        return significant - 1
    return max(significant - 1 - math.floor(math.log10(size)), 0)


def shown(value: float, decimals: int) -> str:
    """A number with decimals; one that is too small or too large for them with an exponent.

    value: in any unit, which is the caller's to write
    """
    if decimals > 7 or abs(value) >= 1e7:
        return f"{value:.3g}"
    return f"{round(value, decimals) + 0.0:.{decimals}f}"  # no -0.00


def with_interval(value: float, low: float | None, high: float | None) -> str:
    """A number with its 95 % interval, such as "7.71 (7.65 to 7.78)"; both in one unit."""
    decimals = digits(value, low, high)
    text = shown(value, decimals)
    if low is None or high is None:
        return text
    return f"{text} ({shown(low, decimals)} to {shown(high, decimals)})"
