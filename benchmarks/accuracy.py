"""Accuracy of identification on simulated motorcycles whose true response is known.

`python benchmarks/accuracy.py [seeds] [--out docs/accuracy.md] [--workers n] [--seconds s]` simulates
trials, identifies them and compares. Only filling time and c / k of the driveline count as known, and
only for the dead time. The model order is selected. Results are kept in build/accuracy: after
--seconds, or when stopped, the page has the trials so far, and the next call continues.
"""

import argparse
import time
from pathlib import Path

from known.cases import CASES
from known.page import document
from known.rows import ridden

SEEDS = 20
MARK = "\n## Causes"  # what is written by hand from here on is kept


def main() -> None:
    """Simulate the trials, then print or write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("seeds", type=int, nargs="?", default=SEEDS)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--seconds", type=float, default=float("inf"))
    given = parser.parse_args()
    until = time.monotonic() + given.seconds
    made = [ridden(case, given.seeds, given.workers, until) for case in CASES]
    made = [row for row in made if row.outcomes]
    if given.out is None:
        print(document(made, ""))
        return
    old = given.out.read_text(encoding="utf-8") if given.out.exists() else ""
    notes = old[old.index(MARK) :] if MARK in old else "\n"
    given.out.write_text(document(made, notes), encoding="utf-8")


if __name__ == "__main__":
    main()
