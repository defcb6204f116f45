"""A signal over time as an SVG drawing, with what was injected meanwhile."""

import math
from collections.abc import Callable, Sequence
from html import escape
from typing import Any

WIDTH, HEIGHT = 1000, 190
LEFT, RIGHT, TOP, BOTTOM = 78, 12, 26, 24  # margins
TEXT_ROWS = 3  # of labels of marks, so that neighbours do not overlap
MOST_DOTS = 120  # samples that are drawn as dots as well

Scale = Callable[[float], float]


def plot_svg(plot: dict[str, Any]) -> str:
    """SVG element of a signal of `plots`. The trace is held between frames, as a receiver holds it."""
    begin, end = plot["begin"], plot["end"]
    low, high = _range(plot["value"])
    x = _scale(begin, end, LEFT, WIDTH - RIGHT)
    y = _scale(low, high, HEIGHT - BOTTOM, TOP)
    unit = f", {plot['unit']}" if plot["unit"] else ""
    title = f'<text class="title" x="{LEFT}" y="15">{escape(plot["name"])}{escape(unit)}</text>'
    parts = [title, _grid(x, y, (begin, end), (low, high)), _marks(x, plot["marks"])]
    parts.append(_trace(x, y, plot["time"], plot["value"], end))
    if not plot["time"]:
        middle = f'x="{WIDTH / 2:g}" y="{HEIGHT / 2:g}"'
        parts.append(f"<text {middle}>no frame in this time</text>")
    return f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img">{"".join(parts)}</svg>'


def _scale(low: float, high: float, first: float, last: float) -> Scale:
    slope = (last - first) / ((high - low) or 1.0)
    return lambda value: first + (value - low) * slope


def _range(values: Sequence[float]) -> tuple[float, float]:
    """Lowest and highest value to draw, with room above and below."""
    finite = [value for value in values if math.isfinite(value)]
    low, high = min(finite, default=0.0), max(finite, default=1.0)
    room = 0.08 * (high - low) or max(abs(high) * 0.05, 0.5)
    return low - room, high + room


def _grid(x: Scale, y: Scale, times: tuple[float, float], values: tuple[float, float]) -> str:
    parts = []
    for value in ticks(*values, 4):
        at = f"{y(value):.1f}"
        parts.append(f'<line class="grid" x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{at}" y2="{at}"/>')
        label = f'x="{LEFT - 6}" y="{y(value) + 4:.1f}" text-anchor="end"'
        parts.append(f"<text {label}>{value:g}</text>")
    for time in ticks(*times, 8):
        at = f"{x(time):.1f}"
        parts.append(f'<line class="grid" x1="{at}" x2="{at}" y1="{TOP}" y2="{HEIGHT - BOTTOM}"/>')
        label = f'x="{at}" y="{HEIGHT - 8}" text-anchor="middle"'
        parts.append(f"<text {label}>{time:g} s</text>")
    return "".join(parts)


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


def _marks(x: Scale, marks: Sequence[Sequence[Any]]) -> str:
    """Bands and lines of what was injected, with its name."""
    parts = []
    for index, (since, until, text) in enumerate(marks):
        left, right = x(since), x(until)
        tall = f'y="{TOP}" height="{HEIGHT - BOTTOM - TOP}"'
        if right - left > 1:
            width = f'width="{right - left:.1f}"'
            parts.append(f'<rect class="mark" x="{left:.1f}" {width} {tall}/>')
        line = f'x1="{left:.1f}" x2="{left:.1f}" y1="{TOP}" y2="{HEIGHT - BOTTOM}"'
        parts.append(f'<line class="edge" {line}/>')
        row = TOP + 12 + 14 * (index % TEXT_ROWS)
        late = left > 0.75 * WIDTH
        side, anchor = (left - 4, "end") if late else (left + 4, "start")
        place = f'x="{side:.1f}" y="{row}" text-anchor="{anchor}"'
        parts.append(f'<text class="mark-text" {place}>{escape(text)}</text>')
    return "".join(parts)


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
