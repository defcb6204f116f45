"""Parameters that calibration moved far from the file are reported with the consequences."""

import json

from slipbench.identification.mismatch.analysis import begin
from slipbench.identification.mismatch.explain import analyse
from slipbench.identification.mismatch.reporting.conclude import verdict
from slipbench.identification.mismatch.reporting.memo import lines
from slipbench.identification.mismatch.reporting.verdict import as_json
from tests.identification.mismatch.laws.spring import FREQUENCY, MODEL, spring, swung


def verdict_with(folder, plus_minus: float):
    text = MODEL.replace(
        'value = 10, unit = "rad/s", plus_minus = 1',
        f'value = 10, unit = "rad/s", plus_minus = {plus_minus}',
    )
    system = spring(folder, text)
    analysis = begin(system, [system.prepare(swung(1))], [system.prepare(swung(2))])
    return verdict(analyse(analysis, ()))


def test_a_parameter_that_went_far_is_told_with_its_values(tmp_path) -> None:
    """The file states 0.2 %; the truth is 3 % off, and calibration ends at its bound."""
    found = verdict_with(tmp_path, 0.02)
    (far,) = (p for p in found.far if p.key == "parameters.frequency")
    assert far.stated == 10.0
    assert far.stated < far.calibrated < FREQUENCY
    assert far.deviations > 2.9
    assert any("far from the file: " in line and "frequency" in line for line in lines(found))
    assert json.loads(as_json(found))["far"][0]["key"] == "parameters.frequency"


def test_parameters_within_what_the_file_states_are_not_told(tmp_path) -> None:
    found = verdict_with(tmp_path, 1.0)
    assert found.far == ()
    assert not any("far from the file" in line for line in lines(found))
