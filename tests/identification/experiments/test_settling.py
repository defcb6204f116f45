"""Laws of the questions of a session: what is rejected is not designed for again, paths lead on."""

import json
from pathlib import Path

import pytest

from slipbench.identification.experiments.sequential_test import RunEvidence
from slipbench.identification.experiments.settling import (
    Asked,
    evidence_from,
    evidence_tree,
    first_questions,
    lines_of,
)
from slipbench.identification.mismatch.reporting.open_questions import (
    OpenQuestions,
    StatedHypothesis,
)

NAMES = (("backlash", "hardening_cush", "driveline_loss"), ("nothing", "wet_patch"))


def opened(**changes) -> OpenQuestions:
    questions = tuple(tuple(StatedHypothesis(effect=name) for name in one) for one in NAMES)
    tree = {"vehicle": "v.toml", "improved": "i.toml", "runs": ("../runs/a",), **changes}
    return OpenQuestions(questions=questions, **tree)


def asked(*nats: tuple[float, ...]) -> Asked:
    """Questions after runs; nats: log densities of the five hypotheses in each run."""
    runs = []
    for n, row in enumerate(nats):
        parts = row[:3], row[3:]
        runs.append(
            tuple(
                RunEvidence(f"designed_{n + 1}-1", dict(zip(names, part, strict=True)))
                for names, part in zip(NAMES, parts, strict=True)
            )
        )
    return Asked(opened(), Path(), tuple(runs))


def effects(found: OpenQuestions) -> list[tuple[str, ...]]:
    return [tuple(one.effect for one in question) for question in found.questions]


def test_before_any_run_all_is_open_and_evidence_is_one():
    found = asked()
    assert not found.settled
    assert effects(found.still_open) == list(NAMES)
    assert all("open: " in line and " 1, " in line for line in lines_of(found))


def test_rejected_hypotheses_and_settled_questions_are_not_designed_for_again():
    found = asked((0.0, -1.0, -20.0, 0.0, -30.0))
    assert effects(found.still_open) == [("backlash", "hardening_cush")]
    assert not found.settled
    assert lines_of(found)[1].startswith("nothing stands, the others are rejected")
    both = asked((0.0, -1.0, -20.0, 0.0, -30.0), (0.0, -20.0, 0.0, 0.0, 0.0))
    assert both.settled
    assert effects(both.still_open) == []


def test_where_each_is_rejected_in_turn_something_else_is_missing():
    found = asked((0.0, 0.0, 0.0, 0.0, -30.0), (0.0, 0.0, 0.0, -60.0, 0.0))
    assert "something else is missing" in lines_of(found)[1]


def test_evidence_is_the_same_after_it_was_written_and_read():
    found = asked((0.1, -1.0, -20.0, 0.3, -30.0), (1.0, 2.0, 3.0, 4.0, 5.0))
    assert evidence_from(json.loads(json.dumps(evidence_tree(found.evidence)))) == found.evidence


@pytest.mark.parametrize("depth", ["memo", "deeper/memo"])
def test_paths_of_the_questions_lead_from_the_new_folder_and_all_effects_are_contested(
    tmp_path, depth
):
    analysis, folder = tmp_path / depth, tmp_path / "designed"
    found = first_questions(opened(contested=("eccentricity",)), analysis, folder)
    for name, before in (("vehicle", "v.toml"), ("improved", "i.toml")):
        assert (folder / getattr(found, name)).resolve() == (analysis / before).resolve()
    assert (folder / found.runs[0]).resolve() == (analysis / "../runs/a").resolve()
    assert set(found.contested) == {"eccentricity", "wet_patch", *NAMES[0]}
    assert found.questions == opened().questions
