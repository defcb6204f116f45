"""The paper's findings come out of trials on the demonstration motorcycle, over CAN.

The trials are ridden once for all tests here; they are the same to the last bit on every machine of
one kind.
"""

import json
import re
import shutil
from pathlib import Path

import pytest

from slipbench.protocol.errors import InputError
from slipbench.studies.paper.claims import Claim
from slipbench.studies.paper.paper_command import Reproduced, reproduce
from slipbench.studies.paper.paper_report import band_in_words, found_in_words
from slipbench.studies.paper.paper_trials import PAPER, record_all
from tests.paths import ROOT, TRIALS


@pytest.fixture(scope="module")
def paper(tmp_path_factory: pytest.TempPathFactory) -> tuple[Reproduced, Path]:
    out = tmp_path_factory.mktemp("paper")
    nominal = ROOT / "plant" / "vehicles" / "nominal.toml"
    return reproduce(out, out / "runs", nominal, ROOT / "examples" / "trials", 10.0), out


def test_every_claim_holds(paper: tuple[Reproduced, Path]) -> None:
    failing = {claim.name for claim in paper[0].claims if not claim.holds}
    told = "\n".join(
        f"{claim.statement}: {found_in_words(claim)}, wanted {band_in_words(claim)}; {claim.note}"
        for claim in paper[0].claims
        if not claim.holds
    )
    assert not failing, told


def test_every_claim_has_a_name_of_its_own(paper: tuple[Reproduced, Path]) -> None:
    names = [claim.name for claim in paper[0].claims]
    assert len(names) == len(set(names)) > 30


def test_the_claims_are_told_to_programs_as_well(paper: tuple[Reproduced, Path]) -> None:
    told = json.loads((paper[1] / "claims.json").read_text())
    assert told["answer"] == paper[0].answer
    assert [one["pass"] for one in told["claims"]] == [claim.holds for claim in paper[0].claims]


def test_the_page_needs_nothing_but_a_browser(paper: tuple[Reproduced, Path]) -> None:
    page = paper[0].page.read_text(encoding="utf-8")
    assert re.findall(r'(?:src|href)="(?!#)[^"]+"', page) == []
    assert page.count("<figure>") >= 15


def test_the_answer_names_both_actuators_and_their_figures(paper: tuple[Reproduced, Path]) -> None:
    assert "spark leads the throttle by" in paper[0].answer


def test_a_claim_without_a_figure_does_not_hold() -> None:
    claim = Claim("x", "x", float("nan"), 0.0, 1.0, "1", "x")
    assert not claim.holds
    assert claim.described()["value"] is None
    assert found_in_words(claim) == "not found"


def test_an_invalid_trial_file_is_refused_before_any_trial(tmp_path: Path) -> None:
    shutil.copytree(TRIALS, tmp_path / "trials")
    (tmp_path / "trials" / "throttle_sweep_12000.toml").write_text("limits = 1", encoding="utf-8")
    with pytest.raises(InputError, match="throttle_sweep_12000"):
        record_all(list(PAPER), tmp_path / "runs", tmp_path / "trials", lambda _: None)
    assert not (tmp_path / "runs").exists()
