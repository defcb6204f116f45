"""Score a study and write its page."""

import os
from collections.abc import Iterator, Sequence
from pathlib import Path

from slipbench.studies.blind_validation.counting import figures
from slipbench.studies.blind_validation.figures import draw_figures
from slipbench.studies.blind_validation.hidden_cases import FINGERPRINT, ground_truth, write_whole
from slipbench.studies.blind_validation.page import Provenance, headline, page
from slipbench.studies.blind_validation.score import scored
from slipbench.studies.blind_validation.study import Result, Study, source_fingerprint


def publish(study: Study, results: Sequence[Result], path: Path) -> Iterator[str]:
    """Write the page and its figures; yields lines for the terminal."""
    cases = scored(ground_truth(study.folder), results)
    counted = figures(cases)
    drawn = path.parent / "figures"
    draw_figures(cases, counted, drawn)
    made = Provenance(
        f"slipbench prove --cases {study.cases} --seed {study.seed}",
        (study.folder / FINGERPRINT).read_text("ascii").strip(),
        results[0]["source"] if results else source_fingerprint(),
        study.cases,
        os.path.relpath(drawn, path.parent),
        next((r["observed"] for r in results if "observed" in r), ""),
    )
    write_whole(path, page(cases, made))
    yield headline(results, cases)
    for one in counted:
        if one.total:
            low, high = one.interval
            verdict = {True: ", met", False: ", NOT MET", None: ""}[one.met]
            yield f"{one.text}: {one.shown} ({low:.0f} to {high:.0f}){verdict}"
    yield f"page: {path}"
