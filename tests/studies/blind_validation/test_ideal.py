"""What there is to see is told alike by the library's formula and by the generator's own."""

from dataclasses import replace
from pathlib import Path

import pytest

from slipbench.identification.mismatch.fit.calibrate import calibrate
from slipbench.identification.mismatch.runs import open_analysis
from slipbench.studies.blind_validation.generator.case import Case, draw_case, write_case
from slipbench.studies.blind_validation.generator.fault_types import Hidden
from slipbench.studies.blind_validation.ideal import at_truth, ideal

SEED, NUMBER = 1, 9  # asymmetric filling, of moderate size


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    case: Case = draw_case(SEED, NUMBER)
    case = replace(case, training=case.training[:2], held_out=())
    vehicle, training, _ = write_case(case, tmp_path_factory.mktemp("case") / "one")
    analysis = open_analysis(Path(vehicle), training, [])
    return case, calibrate(analysis.training, analysis.training.origin())


def test_a_fit_from_the_truth_and_the_true_difference_gain_alike(fitted) -> None:
    case, base = fitted
    assert case.hidden[0].kind == "asymmetric_filling"
    found = ideal(case, base)
    assert found.gain == pytest.approx(found.difference, rel=0.15)
    assert found.gain > 100.0


@pytest.mark.parametrize(
    ("kind", "subject", "parameters"),
    [
        ("backlash", "", {"slack": 9e-3}),
        ("rate_limit", "", {"limit": 5.0}),
        ("runner_resonance", "", {"share": 0.5, "frequency": 300.0, "damping": 0.2}),
        ("tooth_misplacement", "front_encoder", {"displacement": -7e-4, "tooth": 11.0}),
        ("quantiser", "engine_speed", {"quantum": 5.0}),
    ],
)
def test_a_candidate_at_the_truth_has_the_true_numbers(
    kind: str, subject: str, parameters: dict[str, float]
) -> None:
    effect = at_truth(Hidden(kind, "moderate", subject, parameters)).effect()
    assert effect.subject == subject
    for name, value in parameters.items():
        assert getattr(effect, name) == pytest.approx(value, rel=1e-6)
