"""A trend in words."""

from slipbench.identification.report.words import p_value
from slipbench.identification.season.change_points import BESIDE, LEVEL, ChangePoint
from slipbench.identification.season.numbers import with_interval
from slipbench.identification.season.points import DATE, TIME
from slipbench.identification.season.trend import Trend

ENOUGH = 8  # points from which on a step of six deviations is found in half of the cases


def lines(of: Trend) -> list[str]:
    """The trend as lines for a terminal: points, line, changes, what is left out."""
    points, unit = of.points, _unit(of)
    made = [f"{points.parameter} over {points.over}{f', in {unit}' if unit else ''}:", ""]
    width = max(len(points.place(i)) for i in range(points.x.size))
    for i, (value, deviation) in enumerate(zip(points.value, points.deviation, strict=True)):
        low, high = value - 1.96 * deviation, value + 1.96 * deviation
        text = with_interval(value, low, high) if deviation else with_interval(value, None, None)
        made.append(f"  {points.place(i):<{width}}  {text:<24}  {points.runs[i]}")
    made += ["", _line(of), *(_change(of, one) for one in of.changes)]
    if not of.changes:
        made.append(_no_change(of))
    made += [f"left out: {text}" for text in points.left_out]
    if points.mixed:
        made.append(
            f"note: the runs differ in {', '.join(points.mixed)}, and a change may come from that:"
            " --where keeps them apart"
        )
    return made


def _unit(of: Trend) -> str:
    return "" if of.points.unit in ("1", "SI") else of.points.unit


def _line(of: Trend) -> str:
    """Sentence on the linear trend."""
    points = of.points
    span = f"from {points.place(0)} to {points.place(points.x.size - 1)}"
    change, low, high = of.change
    number = with_interval(change, low, high)
    sign = "+" if change > 0 else ""
    how = f"{sign}{number}{' ' + _unit(of) if _unit(of) else ''} {span}, {p_value(of.p_value)}"
    scatter = ""
    if points.deviation.any() and of.scatter > 0:
        size = f"{of.scatter:.2g}"
        scatter = (
            f" The runs scatter by {size} more than their intervals say; it is in the interval."
        )
    if of.significant:
        verb = "rises" if change > 0 else "falls"
        return f"Linear trend: {points.parameter} {verb}, {how}.{scatter}"
    return f"Linear trend: none that is significant, {how}.{scatter}"


def _change(of: Trend, one: ChangePoint) -> str:
    """Sentence on a sudden change."""
    points, last = of.points, one.after - 1
    unit = f" {_unit(of)}" if _unit(of) else ""
    verb = "rises" if one.rises else "falls"
    where = (
        f"between {points.place(last)} and {points.place(one.after)}"
        if points.over in (DATE, TIME)
        else f"{points.over} {points.x[last]:.6g} to {points.x[one.after]:.6g}"
    )
    return (
        f"Change point: {points.parameter} {verb} from {with_interval(*one.before)} to"
        f" {with_interval(*one.afterwards)}{unit} between {_first(points.runs[last], -1)} and"
        f" {_first(points.runs[one.after], 0)} ({where}; {p_value(one.p_value)} over all places)."
        f"{_elsewhere(of, one)}"
    )


def _elsewhere(of: Trend, one: ChangePoint) -> str:
    """Sentence on other places that are nearly as likely."""
    if not one.also:
        return ""
    every = (one.after, *one.also)
    first, last = of.points.place(min(every) - 1), of.points.place(max(every))
    return f" Other places from {first} to {last} fit hardly worse."


def _first(names: str, at: int) -> str:
    return names.split(", ")[at]


def _no_change(of: Trend) -> str:
    count = of.points.x.size
    text = (
        f"Change points: none beside the linear trend, at {100 * LEVEL:.0f} % for the whole series."
    )
    if count < 2 * BESIDE + 1:
        return f"Change points: not tested, {count} points are too few."
    if count < ENOUGH:
        return f"{text} With {count} points only very large steps are found."
    return text
