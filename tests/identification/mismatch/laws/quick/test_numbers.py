"""Numbers that are known to factors: calibration reaches the truth, or the verdict says otherwise."""

from pathlib import Path

import pytest

from tests.identification.mismatch.laws.explained import (
    explained,
    holds,
    large_errors,
    names,
    reported,
)
from tests.identification.mismatch.laws.spring import FREQUENCY, MODEL, cubic, spring, swung

BENT = tuple(
    f"{name}.deflection" for name in ("cubic", "quadratic", "asymmetry", "dead_zone", "saturation")
)


def known_to_factors(folder: Path, frequency: float):
    """Read a model whose frequency and gain are known to factors. frequency: rad/s, nominal."""
    text = MODEL.replace("plus_minus = 20", "plus_minus = 80")
    text = text.replace(
        'value = 10, unit = "rad/s", plus_minus = 1',
        f'value = {frequency}, unit = "rad/s", plus_minus = 5',
    )
    return spring(folder, text)


@pytest.mark.parametrize("nominal", [6.5, 14.0])
def test_a_simulation_far_from_its_truth_is_calibrated_and_nothing_is_claimed(tmp_path, nominal):
    """A noise model of a far start takes all errors for noise, and the fit stays where it began."""
    print(f"frequency {nominal} rad/s in the file, {FREQUENCY} in truth")
    found = explained(known_to_factors(tmp_path, nominal), [swung(1)], [swung(2)], BENT)
    assert not found.mismatch, reported(found)
    assert not large_errors(found), reported(found)


@pytest.mark.parametrize("nominal", [6.5, 14.0])
def test_an_effect_is_named_wherever_the_calibration_begins(tmp_path, nominal):
    system = known_to_factors(tmp_path, nominal)
    found = explained(system, [swung(1, cubic(0.15))], [swung(2, cubic(0.15))], BENT)
    assert names(found) == ["cubic.deflection"], reported(found)
    assert holds(found, "cubic", "cube", 0.15, slack=0.02)
    assert not large_errors(found), reported(found)
