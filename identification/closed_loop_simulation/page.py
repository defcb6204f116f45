"""Page of the controller comparison, Markdown with figures."""

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
from slipbench.identification.closed_loop_simulation.factors import factors
from slipbench.identification.closed_loop_simulation.figures import scenario_figure
from slipbench.identification.closed_loop_simulation.markdown import table
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
    parts = [_head(command), _tracking(found, bandwidth), _hard(found), _robust(found), factors()]
    parts += [
        f"## {name.capitalize()}\n\n![{name}](figures/control_{name.replace(' ', '_')}.png)"
        for name in SHOWN
    ]
    page.write_text("\n\n".join(parts) + "\n", encoding="utf-8")


def _head(command: str) -> str:
    return (
        "# Controllers compared\n\n"
        f"Made by `{command}`: closed-loop simulation of the demonstration motorcycle. Encoder teeth "
        "are sent three per frame as on the bus, the optical sensor sends a noisy sample every 4 ms, "
        "and the controller runs every millisecond. The controllers come from `slipbench design` on "
        "recorded sweeps. In the scenarios with high throttle a controller may only reduce torque, "
        f"above a slip of {100 * CAUGHT:g} %: wet patch (half the grip for 20 m) and crest "
        f"(half the load for 15 m) with {100 * HARD:g} % throttle above cruising; rolling on "
        f"(within 0.3 s) and launch (second gear, from 26 m/s) with {100 * OVER:g} %; wet road "
        f"(half the grip) with {100 * WET:g} %."
    )


def _tracking(found: Sequence[Compared], bandwidth: float) -> str:
    rows = [
        (
            _shown(c),
            f"{c.bandwidth:.1f} ({c.bandwidths[0]:.1f} to {c.bandwidths[1]:.1f})",
            f"{c.bandwidth / bandwidth:.2f}",
            f"{100 * c.overshoot:.0f}",
            f"{1e3 * c.settling:.0f}" if math.isfinite(c.settling) else "did not settle",
            f"{100 * c.noise:.0f}",
            _degrees(c.retard["slip step"]),
            _degrees(c.retard["slip tracking"]),
        )
        for c in found
        if math.isfinite(c.bandwidth)
    ]
    head = (
        "controller",
        "tracking bandwidth / Hz",
        "relative to w_c",
        "overshoot / %",
        "settling time / ms",
        "noise / % of the step",
        "mean retard, steps / deg",
        "mean retard, sweep / deg",
    )
    return (
        "## Setpoint tracking\n\nSteps of 0.12 % slip, the largest that nine degrees of spark "
        f"achieve. Overshoot and settling time: of the mean of {10 * len(SEEDS)} upward and as many "
        "downward steps, the larger of the two. Noise: deviation of single steps from that mean. "
        "Tracking bandwidth (-3 dB): from a sweep of the setpoint. Each test is simulated "
        f"{len(SEEDS)} times with different sensor noise: mean, for the bandwidth with minimum and "
        "maximum.\n\n" + table(head, rows) + _spent(found)
    )


def _spent(found: Sequence[Compared]) -> str:
    """Sentence on the spark retard of mixed control relative to spark control."""
    retard = {c.name: c.retard for c in found}
    if not {"spark", "mixed"} <= retard.keys():
        return ""
    shares = ", ".join(
        f"{100 * retard['mixed'][s] / retard['spark'][s]:.1f} % ({named})"
        for s, named in (
            ("slip step", "steps"),
            ("slip tracking", "sweep"),
            ("wet patch", "wet patch"),
            ("crest", "crest"),
            ("launch", "launch"),
            ("wet road", "wet road"),
        )
        if retard["spark"][s] > 0.0
    )
    return (
        f"\n\nMean retard of mixed control relative to spark control: {shares}. With the spark alone, a "
        "setpoint below the steady-state slip needs a permanent retard."
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
        "## High throttle\n\n"
        + table(head, rows)
        + "\n\nTime lost: on the wet road within 4 s, relative to the fastest of seven constant slip "
        "setpoints over all controllers."
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
        "stable with a parameter changed by ±20 %",
        "stable with an unmodelled effect",
        "unstable with",
    )
    return "## Robustness\n\n" + table(head, rows)


def _degrees(radians: float) -> str:
    return f"{math.degrees(radians):.2f}"
