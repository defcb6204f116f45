"""The page of a rehearsed day: `python -m slipbench.studies.day.document build/day docs/a_day_rehearsed.md`.

Each step with its command, its duration and the lines that matter; pictures of its pages.
"""

import re
import sys
import textwrap
from collections.abc import Sequence
from pathlib import Path

from slipbench.protocol.errors import InputError
from slipbench.studies.day.transcript import NAME, Step, steps

WIDEST = 120  # characters of a line
MOST_LINES = 4
TEXT = {
    "plan": "Trials that fit into the straight. Each was simulated; the amplitudes leave a quarter of each range.",
    "session": "Eight runs. A connector came loose in the second throttle run, which tripped; the rear tyre had lost"
    " air in the third spark run, which differs from the earlier ones. Both are repeated. Then the session selects"
    " runs and explains them, designs a trial for what they leave open, has it ridden, and explains again.",
    "design": "A slip controller from the usable throttle runs.",
    "trial": "The controller, ridden: steps of the slip.",
    "identify": "Its report.",
}
PICTURES = {
    "session": (
        ("day_report", "The report of the session"),
        ("day_memo", "The memo of the analysis"),
    ),
    "design": (("day_controller", "The controller's page"),),
    "identify": (("day_slip_control", "The report of the run under slip control"),),
}
DULL = re.compile(
    r"  (armed|exciting|settling|handing back|done|not armed|margins|band|note)|Fitting |Accepted"
    r"|Look-ahead|Screening|Calibrating|Localizing|Testing|Validating|Choosing|Reading|Simulating|Refining"
    r"|^$|written: "
)


def document(found: Sequence[Step]) -> str:
    """The page as Markdown. Raises InputError where the day has not come to its end."""
    missing = [name for name in TEXT if name not in {step.name for step in found}]
    if missing:
        raise InputError("the day did not come to its end", found=f"no {', '.join(missing)}")
    minutes = sum(step.seconds for step in found) / 60
    parts = [
        "# A day at the track, rehearsed",
        "Made by `make day`: the commands that an engineer types, on the simulated clock, with the demonstration"
        " motorcycle in place of a real one and the nominal vehicle file as what is known of it before the day."
        f" All steps together took {minutes:.0f} minutes on two processors that other work shared; at the track the"
        " riding comes on top. [How to](how_to/a_day_at_the_track.md) explains each command.",
    ]
    for step in found:
        parts += [f"## {step.name.capitalize()}", TEXT[step.name], _shown(step)]
        parts += [f"![{text}](figures/{name}.png)" for name, text in PICTURES.get(step.name, ())]
    return "\n\n".join(parts) + "\n"


def _shown(step: Step) -> str:
    lines = [line for line in step.lines if not DULL.match(line)]
    body = "\n".join(
        _wrapped(line) for line in (f"$ slipbench {_without_places(step.command)}", *lines)
    )
    return f"```console\n{_without_places(body)}\n```\n\n{step.seconds} s."


def _wrapped(line: str) -> str:
    """The line, broken where it is long and ended after MOST_LINES."""
    indent = line[: len(line) - len(line.lstrip())] + "    "
    return "\n".join(
        textwrap.wrap(
            line, WIDEST, subsequent_indent=indent, max_lines=MOST_LINES, placeholder=" ..."
        )
    )


def _without_places(text: str) -> str:
    """The text with the folders of this machine taken off its paths."""
    return re.sub(r"(?<![\w.])/(?:[\w.-]+/)+", "", text)


def main(folder: Path, page: Path) -> None:
    """Write the page from the transcript of a day. Raises InputError where there is none."""
    path = folder / NAME
    if not path.exists():
        raise InputError("no transcript of a day", where=str(path), remedy="make day")
    page.write_text(document(steps(path.read_text(encoding="utf-8"))), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
