"""Timing report of a replay, on the terminal and in a file."""

from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from slipbench.bench.replay.replay_controls import Controls
from slipbench.bench.replay.replay_process import Ready, Report
from slipbench.protocol.errors import InputError

QUANTILES = {"p50": 50.0, "p99": 99.0, "p99_9": 99.9, "max": 100.0}


def position(controls: Controls, span: int) -> str:
    """Position, speed and pause of a running replay, for its line on the terminal.

    span: ns from the log's first frame to its last.
    """
    paused = ", paused" if controls.paused else ""
    return (
        f"{controls.position * 1e-9:.1f} s of {span * 1e-9:.1f} s, speed {controls.speed:g}{paused}"
    )


def timing(ready: Ready, report: Report) -> dict[str, Any]:
    """Timing of a replay as a table; times in s, each speed with the position where it began."""
    lateness = report.replayed.of_sent_frames
    return {
        "frames": ready.frames,
        "sent": report.replayed.sent,
        "passes": report.replayed.passes,
        "speeds": [
            {"from": position * 1e-9, "speed": speed} for position, speed in report.replayed.speeds
        ],
        "recorded_duration": ready.span * 1e-9,
        "took": report.took * 1e-9,
        "queue_full": report.replayed.refused,
        "channels": dict(ready.buses),
        "lateness": {
            name: float(np.percentile(lateness, share)) * 1e-9 for name, share in QUANTILES.items()
        }
        if lateness.size
        else {},
        "refused": list(report.refused),
        "warnings": list(ready.warnings),
    }


def summary(table: dict[str, Any]) -> str:
    """Timing of a replay as a few lines of text."""
    lateness = ", ".join(
        f"{name} {value * 1e6:.1f} us" for name, value in table["lateness"].items()
    )
    lines = [
        f"{table['sent']} frames replayed of a log of {table['frames']}, in {table['took']:.3f} s "
        f"(recorded in {table['recorded_duration']:.3f} s, speed {_speeds(table['speeds'])})",
        f"lateness {lateness.replace('p99_9', 'p99.9')}" if lateness else "no frame was sent",
    ]
    if table["queue_full"]:
        lines.append(f"{table['queue_full']} frames waited because the transmit queue was full")
    return "\n".join([*lines, *table["refused"], *table["warnings"]])


def _speeds(changes: list[dict[str, float]]) -> str:
    """Speeds in words: "1" or "1, from 12.3 s on 2"."""
    first, *later = changes
    return ", ".join(
        [
            f"{first['speed']:g}",
            *(f"from {change['from']:.1f} s on {change['speed']:g}" for change in later),
        ]
    )


def write(table: dict[str, Any], path: Path) -> None:
    """Write the table to a new TOML file. Raises InputError where it cannot be written."""
    try:
        with path.open("xb") as file:
            tomli_w.dump(table, file)
    except OSError as cause:
        raise InputError(
            "the timing report cannot be written", where=str(path), found=str(cause)
        ) from cause
