"""Quick look at a run: what it covers, how near it came to its limits, and whether it counts."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from slipbench.identification.response.from_folder import identified
from slipbench.identification.response.identify import Identification, identify
from slipbench.identification.response.response import FrequencyResponse
from slipbench.identification.session.margins import OF_THE_COMMAND
from slipbench.identification.session.measures import (
    Measures,
    measures,
    response_from,
    tree,
    unreadable,
)
from slipbench.identification.session.verdict import Verdict, verdict
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.run_folder import read

SHOWN = 3  # smallest margins that are shown


@dataclass(frozen=True)
class QuickLook:
    """Figures of a run and the verdict on them."""

    measures: Measures
    verdict: Verdict


def quick_look(found: Identification, earlier: Sequence[FrequencyResponse] = ()) -> QuickLook:
    """Quick look at an identified run. earlier: responses of the same trial, command to slip."""
    figures = measures(found, earlier)
    return QuickLook(figures, verdict(figures))


def quick_look_of(run: Path, earlier: Sequence[FrequencyResponse] = ()) -> QuickLook:
    """Quick look at a run folder; one that cannot be read gets a verdict as well."""
    try:
        recording = read(run)
        if not any(channel.time.size for channel in recording.channels.values()):
            identified(recording)  # raises the reason
        return quick_look(identify(recording), earlier)
    except InputError as fault:
        figures = unreadable(run, fault.what)
        return QuickLook(figures, verdict(figures))


def look_tree(look: QuickLook) -> dict[str, Any]:
    """Quick look for quick_look.json: verdict, reason, lines for people, and all figures."""
    return {
        "verdict": look.verdict.word,
        "reason": look.verdict.reason,
        "counts": look.verdict.counts,
        "proposed_amplitude": look.verdict.amplitude,
        "lines": lines(look.measures),
        **tree(look.measures),
    }


def earlier_responses(looks: Sequence[Mapping[str, Any]]) -> list[FrequencyResponse]:
    """Responses in the quick looks of earlier runs."""
    return [response_from(look["response"]) for look in looks if look.get("response")]


def lines(of: Measures) -> list[str]:
    """Figures as lines for a terminal."""
    if of.response is None and not of.margins:
        return [of.no_response]
    made = [_response_line(of), _margin_line(of)]
    if of.repeatability is not None:
        one = of.repeatability
        made.append(
            f"repeatability: {one.distance:.1%} from {of.repeats} earlier"
            f" run{'s' if of.repeats > 1 else ''}, {one.expected:.1%} expected from noise"
        )
    if of.clipping or of.late or of.trip:
        made.append(
            f"clipping {of.clipping:.1%}; trip: {of.detail or of.trip or 'none'};"
            f" lateness: {of.late or 'valid'}"
        )
    return made


def _response_line(of: Measures) -> str:
    if of.response is None:
        return f"no frequency response: {of.no_response}"
    planned = f"{of.planned[0]:g} to {of.planned[1]:g} Hz" if of.planned else "?"
    band = f"{of.band[0]:.2g} to {of.band[1]:.3g} Hz" if of.band else "none"
    return f"band {band} of {planned} ({of.covered:.0%} of the lines), coherence {of.coherence:.3f}"


def _margin_line(of: Measures) -> str:
    """The smallest margins; those of the command were known before the run."""
    ridden = [item for item in of.margins.items() if item[0] not in OF_THE_COMMAND]
    shown = ", ".join(
        f"{name} {margin:.0%}" for name, margin in sorted(ridden, key=_second)[:SHOWN]
    )
    worst = 1e3 * of.lateness if of.lateness == of.lateness else 0.0
    return f"margins: {shown or 'unknown'}; largest lateness {worst:.2f} ms"


def _second(item: tuple[str, float]) -> float:
    return item[1]
