"""The page that compares controllers, as Markdown with figures beside it."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from slipbench.identification.closed_loop_simulation.compare import (
    CAUGHT,
    HARD,
    OVER,
    SEEDS,
    WET,
    Compared,
)
from slipbench.identification.closed_loop_simulation.figures import scenario_figure
from slipbench.identification.closed_loop_simulation.ride import Ridden
from slipbench.identification.report import drawing as d

SHOWN = ("slip step", "wet patch", "crest", "launch", "wet road")


def write_page(
    found: Sequence[Compared],
    rides: Mapping[str, Mapping[str, Ridden]],
    page: Path,
    bandwidth: float,
    command: str,
) -> None:
    """Write the page and its figures. bandwidth: w_c of the throttle servo, Hz."""
    folder = page.parent / "figures"
    folder.mkdir(parents=True, exist_ok=True)
    for name in SHOWN:
        d.png(scenario_figure(rides[name]), folder / f"control_{name.replace(' ', '_')}.png")
    parts = [_head(command), _following(found, bandwidth), _hard(found), _robust(found)]
    parts += [
        f"## {name.capitalize()}\n\n![{name}](figures/control_{name.replace(' ', '_')}.png)"
        for name in SHOWN
    ]
    page.write_text("\n\n".join(parts) + "\n", encoding="utf-8")


def _head(command: str) -> str:
    return (
        "# Controllers compared\n\n"
        f"Made by `{command}`. The demonstration motorcycle is ridden in simulation with its "
        "teeth, told three at a time as on the bus, the optical sensor with its noise every 4 ms, "
        "and a controller every millisecond; the controllers come from `slipbench design` on "
        "recorded sweeps. Where the rider drives hard a controller may only take away, above a "
        f"slip of {100 * CAUGHT:g} %: on the wet patch (half of the grip for 20 m) and the crest "
        f"(half of the load for 15 m) with {100 * HARD:g} % of opening beyond cruising, rolling on "
        f"within 0.3 s and launching in second gear from 26 m/s with {100 * OVER:g} %, and on a "
        f"road with half of the grip with {100 * WET:g} %."
    )


def _following(found: Sequence[Compared], bandwidth: float) -> str:
    rows = [
        (
            _shown(c),
            f"{c.bandwidth:.1f} ({c.reach[0]:.1f} to {c.reach[1]:.1f})",
            f"{c.bandwidth / bandwidth:.2f}",
            f"{100 * c.overshoot:.0f}",
            f"{1e3 * c.settling:.0f}" if math.isfinite(c.settling) else "never",
            f"{100 * c.noise:.0f}",
            _degrees(c.retard["slip step"]),
            _degrees(c.retard["slip tracking"]),
        )
        for c in found
        if math.isfinite(c.bandwidth)
    ]
    head = (
        "controller",
        "follows to / Hz",
        "of w_c",
        "overshoot / %",
        "settling / ms",
        "noise / % of a step",
        "mean retard, steps / deg",
        "mean retard, sweep / deg",
    )
    return (
        "## Following a target\n\nSteps of 0.12 % of slip, which nine degrees of spark just make: "
        f"the mean of {10 * len(SEEDS)} up and of as many down, the worse of the two; noise is how "
        "far one step is from that mean. A sweep of the target tells how far the slip follows "
        f"(-3 dB). {len(SEEDS)} rides of either, each with another noise of the sensors: the mean, "
        "and of the bandwidth the least and the greatest.\n\n" + _table(head, rows) + _spent(found)
    )


def _spent(found: Sequence[Compared]) -> str:
    """Say what share of the spark's retard a mixed controller spends."""
    retard = {c.name: c.retard for c in found}
    if not {"spark", "mixed"} <= retard.keys():
        return ""
    told = ", ".join(
        f"{100 * retard['mixed'][s] / retard['spark'][s]:.1f} % in {named}"
        for s, named in (
            ("slip step", "steps"),
            ("slip tracking", "the sweep"),
            ("wet patch", "the wet patch"),
            ("crest", "the crest"),
            ("launch", "the launch"),
            ("wet road", "the wet road"),
        )
        if retard["spark"][s] > 0.0
    )
    return (
        f"\n\nOf the spark's mean retard, mixed control spends {told}. Through the spark alone a "
        "slip below that at rest is a retard that stays."
    )


def _shown(compared: Compared) -> str:
    return compared.name.replace("_", " ")


def _hard(found: Sequence[Compared]) -> str:
    names = ("wet patch", "crest", "rolling on", "launch", "wet road")
    rows = [
        (
            _shown(c),
            *(f"{100 * c.peaks[n]:.1f}" for n in names),
            f"{1e3 * c.lost:.0f}",
            *(_degrees(c.retard[n]) for n in ("wet patch", "wet road")),
        )
        for c in found
    ]
    head = (
        "controller",
        *(f"peak slip, {n} / %" for n in names),
        "time lost / ms",
        "mean retard, wet patch / deg",
        "mean retard, wet road / deg",
    )
    return (
        "## Driving hard\n\n"
        + _table(head, rows)
        + "\n\nTime lost: on the wet road in 4 s, behind "
        "the quickest of seven constant slips that any of the controllers held."
    )


def _robust(found: Sequence[Compared]) -> str:
    rows = [
        (
            _shown(c),
            f"{c.parameters[0]} of {c.parameters[1]}",
            f"{c.effects[0]} of {c.effects[1]}",
            ", ".join(c.unstable) or "none",
        )
        for c in found
        if c.parameters[1]
    ]
    head = (
        "controller",
        "stable at +-20 % of a parameter",
        "stable with an unknown effect",
        "not calm with",
    )
    return "## Robustness\n\n" + _table(head, rows)


def _degrees(radians: float) -> str:
    return f"{math.degrees(radians):.2f}"


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])
