"""What a user selects in a recording: a time window, an input and an output.

    selection = Selection(parse_window("12:42"), "throttle_position", "slip")
    found = identify(read(folder), selection)

A recording without a trial has no phase EXCITING. The window then says when the input was rich enough
to identify from, and the names say what is the input and what the output.
"""

import re
from dataclasses import dataclass

import numpy as np

from slipbench.identification.signals.dataset import Dataset
from slipbench.identification.signals.motion import Motion, NoMotion
from slipbench.identification.signals.named import named_signal, named_signals
from slipbench.identification.signals.trial_window import (
    SHORTEST,
    NoExcitation,
    TrialWindow,
    with_margin,
)
from slipbench.protocol.codec.messages import TripReason
from slipbench.protocol.errors import InputError

INPUTS = ("throttle_command", "throttle_position", "spark_command", "spark_advance")
MOST_UNKNOWN = 0.05  # share of the window in which a signal may be unknown
FORMAT = (
    "START:END in seconds (12:42) or START-END in seconds or mm:ss (1:05-2:10), after the start"
)


@dataclass(frozen=True)
class Selection:
    """window: start and end, s after the recording's start, None: the trial's; input, output: names."""

    window: tuple[float, float] | None = None
    input: str | None = None
    output: str | None = None


def parse_window(text: str) -> tuple[float, float]:
    """Start and end of a window, s: "12:42", "12.5-42" or "1:05-2:10". Raises InputError."""
    parts = text.split("-") if "-" in text else text.split(":")
    try:
        start, end = (_seconds(part.strip()) for part in parts)
    except ValueError:
        raise InputError(
            "the window cannot be read", where="--window", expected=FORMAT, found=text
        ) from None
    if not end > start:
        raise InputError(
            "the window ends before it starts",
            where="--window",
            expected=FORMAT,
            found=f"{text}: from {start:g} s to {end:g} s",
        )
    return start, end


def selected_window(of: Selection, base: Dataset, where: str) -> TrialWindow | None:
    """Window that the user selected; None where the trial's counts. Raises InputError."""
    if of.window is None:
        return None
    start, end = of.window
    if end > base.time[-1] + 1 / base.rate or end - start < SHORTEST:
        raise InputError(
            "the window does not fit the recording",
            where=where,
            expected=f"at least {SHORTEST:g} s between 0 s and {base.time[-1]:.2f} s, its end",
            found=f"from {start:g} s to {end:g} s",
            remedy="give another --window",
        )
    part = slice(round(start * base.rate), min(round(end * base.rate) + 1, base.time.size))
    return TrialWindow(part, with_margin(part, base), TripReason.NONE, float("nan"))


def selected_pair(
    of: Selection,
    base: Dataset,
    moved: Motion | NoMotion,
    window: TrialWindow | NoExcitation,
    where: str,
) -> tuple[str, str] | None:
    """Names of input and output that the user selected; None where the trial's count.

    Without a named input it is the first actuator signal that moves in the window, without a named
    output it is the slip. Raises InputError that lists the signals with their units.
    """
    if of == Selection():
        return None
    if isinstance(window, NoExcitation):
        raise InputError(
            "the recording has no trial, so the time to identify from is unknown",
            where=where,
            found=window.reason,
            remedy=f"give --window {FORMAT}",
        )
    part = window.exciting
    moving = (x for x in INPUTS if _usable(named_signal(base, moved, x), part))
    given, taken = of.input or next(moving, None), of.output or "slip"
    if given is None:
        raise _missing("no actuator signal moves in the window", where, "--input", base, moved)
    for option, name in (("--input", given), ("--output", taken)):
        value = named_signal(base, moved, name)
        if value is None:
            reason = f": {moved.reason}" if name == "slip" and isinstance(moved, NoMotion) else ""
            raise _missing(f"there is no signal {name}{reason}", where, option, base, moved)
        unknown = float(np.mean(~np.isfinite(value[part])))
        if unknown > MOST_UNKNOWN:
            raise InputError(
                f"{name} is unknown in {unknown:.0%} of the window",
                where=where,
                expected=f"at most {MOST_UNKNOWN:.0%}",
                remedy="give another --window",
            )
        if not _usable(value, part):
            raise InputError(
                f"{name} is constant in the window",
                where=where,
                expected="a signal that moves",
                remedy=f"give another --window or another {option}",
            )
    if given == taken:
        raise InputError(
            "input and output are the same signal",
            where=where,
            found=given,
            remedy="give another --output",
        )
    return given, taken


def _missing(
    what: str, where: str, option: str, base: Dataset, moved: Motion | NoMotion
) -> InputError:
    known = [f"{name} [{unit}]" for name, (_, unit) in sorted(named_signals(base, moved).items())]
    return InputError(
        f"{what}; the signals are {', '.join(known) or 'none'}",  # the longest part of a message
        where=where,
        remedy=f"give {option} one of these names",
    )


def _usable(value: np.ndarray | None, part: slice) -> bool:
    if value is None:
        return False
    known = value[part][np.isfinite(value[part])]
    return bool(known.size) and float(np.std(known)) > 1e-9 * max(1.0, float(np.abs(known).max()))


def _seconds(text: str) -> float:
    """Seconds of "12.5" or "1:05"."""
    if match := re.fullmatch(r"(\d+):([0-5]\d(?:\.\d+)?)", text):
        return 60.0 * float(match[1]) + float(match[2])
    if not re.fullmatch(r"\d+(\.\d*)?|\.\d+", text):
        raise ValueError(text)
    return float(text)
