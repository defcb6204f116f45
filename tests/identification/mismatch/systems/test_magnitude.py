"""The usual magnitude of a rate is what its equation gives for usual inputs and states."""

import numpy as np
import pytest

from slipbench.identification.mismatch.systems.magnitude import usual_rates
from tests.identification.mismatch.laws.spring import MODEL, spring


def test_it_is_the_root_mean_square_of_the_equation(tmp_path):
    """Of terms of 100, 100 and 20 m/s^2, drawn uniformly within their sizes."""
    found = usual_rates(spring(tmp_path).file)
    terms = np.array([100.0, 10.0**2, 2 * 0.1 * 10 * 10])
    assert found["velocity"] == pytest.approx(np.sqrt(np.sum(terms**2) / 3), rel=0.2)
    assert found["position"] == pytest.approx(10.0 / np.sqrt(3), rel=0.2)


@pytest.mark.parametrize("factor", [0.01, 100.0])
def test_it_goes_with_the_size_of_what_drives_the_rate_and_not_with_the_sampling(tmp_path, factor):
    plain = usual_rates(spring(tmp_path).file)
    (tmp_path / "other").mkdir()
    text = MODEL.replace("value = 1, unit", f"value = {factor}, unit").replace(
        'value = 10, unit = "m/s"', f'value = {10 * factor}, unit = "m/s"'
    )
    scaled = usual_rates(spring(tmp_path / "other", text).file)
    for name, usual in plain.items():
        assert scaled[name] == pytest.approx(factor * usual, rel=1e-9)


def test_an_equation_that_cannot_be_evaluated_leaves_the_size_in_a_period(tmp_path):
    text = MODEL.replace('rate = "gain * force', 'rate = "sqrt(-1 - position ** 2) * gain * force')
    found = usual_rates(spring(tmp_path, text).file)
    assert found["velocity"] == pytest.approx(10.0 / 0.01)


def test_friction_at_a_rate_is_sized_by_it(tmp_path):
    system = spring(tmp_path)
    (kind,) = (k for k in system.library if k().key == "friction.velocity_rate/velocity")
    assert kind.place.size == usual_rates(system.file)["velocity"]
