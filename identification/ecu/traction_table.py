"""The static part of a controller as a table of rusEFI's own traction control.

Its tables give the throttle drop (%) or the timing drop (deg) over speed and slip ratio. They hold
whole numbers, and slip in steps of 1 %. Older firmware adds the number of the table to throttle and
timing, so that a reduction is negative; newer firmware subtracts it, and takes positive numbers alone
(the sign changed in the course of 2026). With the wrong sign older firmware opens the throttle when the
wheel spins.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from slipbench.identification.ecu.exported_law import ExportedLaw
from slipbench.identification.ecu.rusefi import (
    FASTEST_BIN,
    LARGEST_DROP,
    LARGEST_RETARD,
    SLIP_STEP,
    TABLE_SIZE,
)
from slipbench.identification.ecu.static_gain import static_gain
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.channel import FloatArray

KMH = 3.6
SIGNS = {"added": -1.0, "subtracted": 1.0}
SPEEDS = tuple(np.linspace(50.0, 250.0, TABLE_SIZE).tolist())  # km/h, where gains do not change
HEAD = '<?xml version="1.0" encoding="UTF-8" standalone="no"?>'
NAMESPACE = "http://www.EFIAnalytics.com/:table"


@dataclass(frozen=True, eq=False)
class TractionTable:
    """name: of rusEFI's table; ratio: (6,); speed: (6,) km/h; drop: (6, 6) % or deg, positive."""

    name: str
    ratio: FloatArray
    speed: FloatArray
    drop: FloatArray

    def at(self, ratio: float, speed: float) -> float:
        """Drop between the points of the table, as rusEFI interpolates; constant outside."""
        rows = [float(np.interp(speed, self.speed, row)) for row in self.drop]
        return float(np.interp(ratio, self.ratio, rows))


def traction_table(law: ExportedLaw) -> TractionTable:
    """Table of the static part. Raises InputError where that part does not reduce.

    Of mixed control it has the throttle: in steady state its spark is at the optimum.
    """
    tree = law.tree
    throttle = law.file.actuator != "spark"
    low = (tree["mixed"]["throttle"] if tree["mixed"] else tree["limits"])["low"]
    unit = 100.0 if throttle else math.degrees(1.0)
    rows = _gains(law)
    least = min(gain for _, gain in rows)
    if not least > 0.0:
        raise InputError(
            "the static part of this controller does not reduce torque when the slip grows",
            expected="a static gain above 0",
            found=f"{least:g}",
            remedy="use the script without a table",
        )
    full = math.floor(min(-low * unit, LARGEST_DROP if throttle else LARGEST_RETARD) + 1e-9)
    ratio = _ratios(law.target, -low / least)
    speed, gains = _by_speed(rows)
    drop = np.outer(np.maximum(ratio - 1.0 - law.target, 0.0), gains * unit)
    name = "tractionControlEtbDrop" if throttle else "tractionControlTimingDrop"
    return TractionTable(name, ratio, speed, np.minimum(np.round(drop), float(full)))


def write_table(table: TractionTable, path: Path, convention: str) -> None:
    """Write a TunerStudio .table file. convention: "added" or "subtracted", by the firmware."""
    numbers = SIGNS[convention] * table.drop + 0.0  # no -0
    size = TABLE_SIZE
    lines = [
        HEAD,
        f"<tableData xmlns={quoteattr(NAMESPACE)}>",
        '<bibliography author="slipbench"/>',
        '<versionInfo fileFormat="1.0"/>',
        f'<table cols="{size}" rows="{size}">',
        f'<xAxis cols="{size}" name="vehicleSpeedKph">',
        *(f" {x:.1f}" for x in table.speed),
        "</xAxis>",
        f'<yAxis name="wheelSlipRatio" rows="{size}">',
        *(f" {y:.2f}" for y in table.ratio),
        "</yAxis>",
        f'<zValues cols="{size}" rows="{size}">',
        *(" " + " ".join(f"{z:.1f}" for z in row) for row in numbers),
        "</zValues>",
        "</table>",
        "</tableData>",
    ]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _gains(law: ExportedLaw) -> list[tuple[float, float]]:
    """Speeds (m/s) and static gains there."""
    tree = law.tree
    if tree["schedule"]:
        return [(row["speed"], static_gain(row["gains"])) for row in tree["schedule"]]
    return [(0.0, static_gain(tree["mixed"]["law"] if tree["mixed"] else tree["law"]))]


def _ratios(target: float, error: float) -> FloatArray:
    """Slip ratios up to where the drop is largest, in steps that the table has.

    The first one is at the target or below it: rusEFI holds its drop, zero, for every lower slip.
    """
    first = math.floor(round(target / SLIP_STEP, 6))
    last = max(math.ceil((target + error) / SLIP_STEP), first + TABLE_SIZE - 1)
    return 1.0 + SLIP_STEP * np.round(np.linspace(first, last, TABLE_SIZE))


def _by_speed(rows: Sequence[tuple[float, float]]) -> tuple[FloatArray, FloatArray]:
    """Speeds of the table (km/h) and the gains there."""
    speeds, gains = np.array(rows, dtype=np.float64).T
    ends = (KMH * speeds[0], KMH * speeds[-1]) if len(rows) > 1 else (SPEEDS[0], SPEEDS[-1])
    low, high = (min(max(end, 0.0), FASTEST_BIN) for end in ends)
    if high - low < TABLE_SIZE:
        low, high = SPEEDS[0], SPEEDS[-1]
    chosen: FloatArray = np.round(np.linspace(float(low), float(high), TABLE_SIZE))
    return chosen, np.asarray(np.interp(chosen / KMH, speeds, gains))
