"""Selection in a recording by the user: a time window, an input and an output.

    selection = Selection(parse_window("12:42"), "throttle_position", "slip")
    found = identify(read(folder), selection)

A recording without a trial has no phase EXCITING. The window then says when the input was rich enough
to identify from, and the names say what is the input and what the output.
"""

import re
from dataclasses import dataclass

import numpy as np

from slipbench.identification.response.signal_names import Names
from slipbench.identification.signals.aligned import Aligned
from slipbench.identification.signals.dataset import Dataset
from slipbench.identification.signals.motion import Motion, NoMotion
from slipbench.identification.signals.named import named_signal
from slipbench.identification.signals.trial_window import (
    SHORTEST,
    NoExcitation,
    TrialWindow,
    with_margin,
)
from slipbench.protocol.codec.messages import TripReason
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.roles import ROLES

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
    last = float(base.time[-1])
    if last + 1 / base.rate < SHORTEST:
        raise InputError(
            "the recording is too short",
            where=where,
            expected=f"at least {SHORTEST:g} s",
            found=f"{last:.3g} s",
            remedy="record for longer",
        )
    if not (start >= 0.0 and end <= last + 2 / base.rate and end - start >= SHORTEST):
        raise InputError(
            "the window does not fit the recording",
            where=where,
            expected=f"at least {SHORTEST:g} s between 0 s and {last:.2f} s, its end",
            found=f"from {start:g} s to {end:g} s",
            remedy=f"give --window 0:{_down(last)} for the whole recording, or another part",
        )
    part = slice(round(start * base.rate), min(round(end * base.rate) + 1, base.time.size))
    return TrialWindow(part, with_margin(part, base), TripReason.NONE, float("nan"))


def selected_pair(
    of: Selection,
    data: Aligned,
    base: Dataset,
    moved: Motion | NoMotion,
    window: TrialWindow | NoExcitation,
) -> tuple[str, str] | None:
    """Names of input and output that the user selected; None where the trial's count.

    Without a named input it is the first actuator signal that moves in the window, without a named
    output it is the slip. Raises InputError that lists the signals with their units.
    """
    where, names = data.recording.folder.name, Names(base, moved, data.absent)
    if of == Selection():
        _check_roles(data, names)
        return None
    if isinstance(window, NoExcitation):
        raise InputError(
            "the recording has no trial, so the time to identify from is unknown",
            where=where,
            found=window.reason,
            remedy=f"give --window 0:{_down(float(base.time[-1]))} for the whole recording, or another part:"
            f" {FORMAT}",
        )
    part = window.exciting
    moving = (x for x in INPUTS if _usable(named_signal(base, moved, x), part))
    given, taken = of.input or next(moving, None), of.output or "slip"
    if given is None:
        raise names.not_given("--input", "no actuator signal moves in the window", where)
    if of.output is None and isinstance(moved, NoMotion):
        raise names.not_given("--output", f"there is no slip: {moved.reason}", where)
    given, taken = names.meant(given), names.meant(taken)
    for option, name in (("--input", given), ("--output", taken)):
        value = named_signal(base, moved, name)
        if value is None:
            raise names.unknown(name, option, where)
        unknown = float(np.mean(~np.isfinite(value[part])))
        if unknown > MOST_UNKNOWN:
            raise InputError(
                f"{name} is unknown in {100 * unknown:.0f} % of the window",
                where=where,
                expected=f"at most {100 * MOST_UNKNOWN:.0f} %",
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


def _check_roles(data: Aligned, names: Names) -> None:
    """Raise InputError where no signal is a role of the bench: then nothing says what is the input.

    Without any signal nothing can be given: the identification says what is missing.
    """
    signals = (*data.time, *data.absent)
    if not signals or any(role in ROLES for role in signals):
        return
    raise names.not_given(
        "--input, --output and --window",
        "no signal has the name of a role of the bench, such as throttle_command",
        data.recording.folder.name,
    )


def _down(seconds: float) -> str:
    """Time in s with two decimals at most, rounded down."""
    return f"{int(seconds * 100) / 100:g}" if seconds < 1e4 else f"{int(seconds)}"


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
