"""The section on published benchmarks names what exists, and the page has it."""

import re

from slipbench.identification.closed_loop_simulation.compare import PARAMETERS
from slipbench.identification.closed_loop_simulation.factors import (
    MEASURED,
    NO,
    PARTLY,
    SOURCES,
    VARIED,
    YES,
    factors,
)
from slipbench.plant.effects.library import LIBRARY
from tests.paths import ROOT

FACTORS = (*VARIED, *MEASURED)


def test_every_source_is_used_or_a_survey_and_every_number_exists():
    used = {number for factor in FACTORS for number in factor.sources}
    assert used == set(range(1, len(SOURCES)))  # the last one is the survey


def test_parameters_and_effects_that_are_named_exist():
    known = {f"{owner}.{name}" for owner, name in PARAMETERS} | {kind.name for kind in LIBRARY}
    named = {word for f in FACTORS for word in re.findall(r"`([a-z_.]+)`", f.here)}
    assert named
    assert named <= known


def test_what_is_covered_is_said_in_one_of_three_words():
    assert {factor.covered for factor in FACTORS} == {YES, PARTLY, NO}


def test_the_page_has_the_section():
    assert factors() in (ROOT / "docs" / "controllers.md").read_text(encoding="utf-8")
