"""A signal over time as an SVG drawing, with what was injected meanwhile."""

import math
from collections.abc import Callable, Iterator, Sequence
from html import escape
from typing import Any

WIDTH, TALL = 1000, 140  # of a drawing, and of its field
LEFT, RIGHT, BOTTOM = 78, 12, 24  # margins
TITLE, ROW = 24, 14  # height of the title, and of a row of labels
MOST_ROWS = 4  # of labels of marks, so that neighbours do not overlap
MOST_DOTS = 120  # samples that are drawn as dots as well

Scale = Callable[[float], float]


def plot_svg(plot: dict[str, Any]) -> str:
    """SVG element of a signal of `plots`. The trace is held between frames, as a receiver holds it."""
    begin, end, marks = plot["begin"], plot["end"], plot["marks"]
    low, high = _range(plot["value"])
    top = TITLE + ROW * min(len(marks), MOST_ROWS)
    bottom = top + TALL
    x, y = _scale(begin, end, LEFT, WIDTH - RIGHT), _scale(low, high, bottom, top)
    unit = f", {plot['unit']}" if plot["unit"] else ""
    parts = [
        f'<text class="title" x="{LEFT}" y="15">{escape(plot["name"])}{escape(unit)}</text>',
        *_values(y, ticks(low, high, 4)),
        *_times(x, ticks(begin, end, 8), top, bottom),
        *_marks(x, marks, top, bottom),
        _trace(x, y, plot["time"], plot["value"], end),
    ]
    if not plot["time"]:
        middle = f'x="{WIDTH / 2:g}" y="{top + TALL / 2:g}"'
        parts.append(f"<text {middle}>no frame in this time</text>")
    return f'<svg viewBox="0 0 {WIDTH} {bottom + BOTTOM}" role="img">{"".join(parts)}</svg>'


def _scale(low: float, high: float, first: float, last: float) -> Scale:
    slope = (last - first) / ((high - low) or 1.0)
    return lambda value: first + (value - low) * slope


def _range(values: Sequence[float]) -> tuple[float, float]:
    """Lowest and highest value to draw, with room above and below."""
    finite = [value for value in values if math.isfinite(value)]
    low, high = min(finite, default=0.0), max(finite, default=1.0)
    room = 0.08 * (high - low) or max(abs(high) * 0.05, 0.5)
    return low - room, high + room


def _values(y: Scale, values: Sequence[float]) -> Iterator[str]:
    for value in values:
        at = f"{y(value):.1f}"
        yield f'<line class="grid" x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{at}" y2="{at}"/>'
        place = f'x="{LEFT - 6}" y="{y(value) + 4:.1f}" text-anchor="end"'
        yield f"<text {place}>{value:g}</text>"


def _times(x: Scale, times: Sequence[float], top: float, bottom: float) -> Iterator[str]:
    for time in times:
        at = f"{x(time):.1f}"
        yield f'<line class="grid" x1="{at}" x2="{at}" y1="{top}" y2="{bottom}"/>'
        yield f'<text x="{at}" y="{bottom + 16}" text-anchor="middle">{time:g} s</text>'


def ticks(low: float, high: float, about: int) -> list[float]:
    """Round numbers from `low` to `high`, about `about` of them."""
    if not high > low:
        return [low]
    rough = (high - low) / about
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(factor * power for factor in (1, 2, 5, 10) if factor * power >= rough)
    first = math.ceil(low / step)
    number = math.floor(high / step) - first + 1
    return [round((first + index) * step, 12) for index in range(number)]


def _marks(x: Scale, marks: Sequence[Sequence[Any]], top: float, bottom: float) -> Iterator[str]:
    """Bands and lines of what was injected, each with its name in a row above the field."""
    for index, (since, until, text) in enumerate(marks):
        left, right = x(since), x(until)
        row = TITLE + ROW * (index % MOST_ROWS)
        if right - left > 1:
            size = f'width="{right - left:.1f}" height="{bottom - top}"'
            yield f'<rect class="mark" x="{left:.1f}" y="{top}" {size}/>'
        ends = f'y1="{row}" y2="{bottom}"'
        yield f'<line class="edge" x1="{left:.1f}" x2="{left:.1f}" {ends}/>'
        side, anchor = (left - 4, "end") if left > 0.75 * WIDTH else (left + 4, "start")
        place = f'x="{side:.1f}" y="{row + 11}" text-anchor="{anchor}"'
        yield f'<text class="mark-text" {place}>{escape(text)}</text>'


def _trace(x: Scale, y: Scale, times: Sequence[float], values: Sequence[float], end: float) -> str:
    samples = [(x(t), y(v)) for t, v in zip(times, values, strict=True) if math.isfinite(v)]
    if not samples:
        return ""
    path = f"M{samples[0][0]:.1f} {samples[0][1]:.1f}"
    path += "".join(f"H{across:.1f}V{up:.1f}" for across, up in samples[1:])
    path += f"H{x(end):.1f}"
    dots = (
        "".join(
            f'<circle class="sample" cx="{across:.1f}" cy="{up:.1f}" r="1.8"/>'
            for across, up in samples
        )
        if len(samples) <= MOST_DOTS
        else ""
    )
    return f'<path class="trace" d="{path}"/>{dots}'
