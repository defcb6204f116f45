"""Page of the robustness study, Markdown."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import binomtest

from slipbench.identification.closed_loop_simulation.compare import CAUGHT, HARD, WET
from slipbench.identification.closed_loop_simulation.markdown import table
from slipbench.identification.closed_loop_simulation.robustness import BAND, OPEN_LOOP, Outcome
from slipbench.protocol.recording.channel import FloatArray

WORST = 10  # rides listed
SCENARIO_TEXT = {
    "wet patch": f"{100 * HARD:g} % throttle above cruising; half the grip for 20 m",
    "wet road": f"half the grip; the rider opens by {100 * WET:g} % within 0.3 s",
}


@dataclass(frozen=True)
class Study:
    """vehicle: name; draws: asked; seed; limit: slip; rows: what was ridden; command: to repeat."""

    vehicle: str
    draws: int
    seed: int
    limit: float
    rows: Sequence[Outcome]
    command: str


def page(study: Study) -> str:
    """Text of the page."""
    parts = [_head(study)]
    parts += [_scenario(study, name) for name in SCENARIO_TEXT]
    parts.append(_worst(study))
    return "\n\n".join(parts) + "\n"


def _head(study: Study) -> str:
    ridden = len({row.number for row in study.rows})
    cut = f" The study was interrupted: {ridden} of {study.draws}." if ridden < study.draws else ""
    return f"""# Slip controllers on drawn motorcycles

Made by `{study.command}`. {ridden} motorcycles, seed {study.seed}.{cut} Each parameter of the vehicle
file `{study.vehicle}` is drawn within its stated 95 % deviation; to each motorcycle come one or two
effects of the library that neither the file nor the design contains, from their smallest size of
interest to one and a half times the typical one. Effects that change only recorded channels are left
out, as the loop has sensors of its own. The controllers are those of the
[comparison](controllers.md), designed on recordings of one motorcycle; none was designed again.

A controller may only reduce torque, above a slip of {100 * CAUGHT:g} %. *Within*: the slip never exceeds
{100 * study.limit:g} %, with the 95 % interval of the share (Wilson). *Settling*: time from the first to
the last moment with slip more than {100 * BAND:g} % above the setpoint. The simulation is the one of the
comparison: teeth and noise of the sensors, 1 ms."""


def _scenario(study: Study, scenario: str) -> str:
    mine = [row for row in study.rows if row.scenario == scenario]
    head = (
        "controller",
        "rides",
        f"within {100 * study.limit:g} %",
        "peak slip, median / %",
        "90 % quantile / %",
        "largest / %",
        "settling, median / ms",
        "90 % quantile / ms",
        "not settled",
        "worst motorcycle",
    )
    names = list(dict.fromkeys(row.controller for row in mine))
    rows = [_row([r for r in mine if r.controller == name], study.limit) for name in names]
    impossible = len({row.number for row in mine if not row.possible})
    left = (
        f"\n\nMotorcycles that cannot hold the speed of this scenario, not counted: {impossible}."
        if impossible
        else ""
    )
    title = f"## {scenario.capitalize()}\n\n{SCENARIO_TEXT[scenario].capitalize()}.{left}"
    return f"{title}\n\n{table(head, [row for row in rows if row])}"


def _row(rows: Sequence[Outcome], limit: float) -> tuple[str, ...]:
    """Cells of a controller; none where no ride was possible."""
    rows = [row for row in rows if row.possible]
    if not rows:
        return ()
    within = sum(row.peak <= limit for row in rows)
    interval = binomtest(within, len(rows)).proportion_ci(method="wilson")
    peaks = np.array([row.peak for row in rows])
    times = np.array([row.settling for row in rows])
    worst = max(rows, key=lambda row: row.peak)
    return (
        rows[0].controller.replace("_", " "),
        str(len(rows)),
        f"{100 * within / len(rows):.0f} % ({100 * interval.low:.0f} to {100 * interval.high:.0f})",
        *(f"{100 * quantile(peaks, q):.1f}" for q in (0.5, 0.9, 1.0)),
        *(_milliseconds(quantile(times, q)) for q in (0.5, 0.9)),
        str(int(np.isinf(times).sum())),
        f"{worst.number} ({', '.join(worst.effects)})",
    )


def quantile(values: FloatArray, share: float) -> float:
    """Smallest of the values, shape (n,), that at least this share does not exceed; inf is allowed."""
    ordered = np.sort(values)
    return float(ordered[max(math.ceil(share * ordered.size) - 1, 0)])


def _milliseconds(seconds: float) -> str:
    return f"{1e3 * seconds:.0f}" if math.isfinite(seconds) else "not settled"


def _worst(study: Study) -> str:
    rows = [r for r in study.rows if r.possible and r.controller != OPEN_LOOP]
    worst = sorted(rows, key=lambda row: -row.peak)[:WORST]
    cells = [
        (
            r.controller.replace("_", " "),
            r.scenario,
            str(r.number),
            ", ".join(r.effects),
            f"{100 * r.peak:.1f}",
            _milliseconds(r.settling),
        )
        for r in worst
    ]
    head = ("controller", "scenario", "motorcycle", "effects", "peak slip / %", "settling / ms")
    return (
        f"## Worst rides under control\n\n{table(head, cells)}\n\nOne motorcycle again:"
        f" `--seed {study.seed} --first NUMBER --draws 1`."
    )
