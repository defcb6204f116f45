"""Rehearse a day at the track: `python -m slipbench.studies.day build/day`."""

import sys
from pathlib import Path

from slipbench.protocol.errors import InputError
from slipbench.studies.day.rehearsal import Day, rehearse


def main(arguments: list[str]) -> int:
    """Exit status: 0 done, 2 invalid input or a step that failed (see message)."""
    if len(arguments) != 1:
        sys.stderr.write("usage: python -m slipbench.studies.day FOLDER\n")
        return 2
    day = Day(Path(arguments[0]).absolute(), lambda line: print(line, flush=True))
    try:
        rehearse(day)
    except InputError as fault:
        sys.stderr.write(f"{fault}\n")
        return 2
    for page in day.pages.values():
        print(page)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
