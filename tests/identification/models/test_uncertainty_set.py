"""Laws of a model with a bound: nothing that was measured lies outside."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slipbench.identification.models import uncertainty_file
from slipbench.identification.models.rational_model import RationalModel
from slipbench.identification.models.uncertainty_set import (
    Member,
    NoSet,
    UncertaintySet,
    fit_weight,
    uncertainty_set,
)
from slipbench.identification.response.response import FrequencyResponse

FREQUENCY = np.linspace(0.5, 12, 80)


def model(gain=0.17, natural=53.0, damping=0.3, delay=0.012) -> RationalModel:
    pair = natural * (-damping + 1j * np.sqrt(1 - damping**2))
    poles = np.array([pair, np.conj(pair), -150.0])
    return RationalModel(
        "throttle_command", "slip", np.zeros(0, complex), poles, gain * natural**2 * 150, delay
    )


def response(of: RationalModel, deviation=0.002, coherence=0.98) -> FrequencyResponse:
    n = FREQUENCY.size
    return FrequencyResponse(
        "throttle_command",
        "slip",
        FREQUENCY,
        of.response(FREQUENCY),
        np.full(n, coherence),
        np.full(n, deviation),
        2.0,
        "synthetic",
    )


MEMBERS = [Member(f"{w:g} rad/s", response(model(0.17 * w / 53, w))) for w in (50.0, 53.0, 58.0)]


@pytest.fixture(scope="module")
def found() -> UncertaintySet:
    made = uncertainty_set(model(), MEMBERS)
    assert isinstance(made, UncertaintySet)
    return made


def test_the_weight_lies_above_every_member_and_its_band(found):
    weight = np.abs(found.weight.response(FREQUENCY))
    nominal = model().response(FREQUENCY)
    for member in MEMBERS:
        lines = member.response
        far = np.abs(lines.value - nominal) + lines.gain_band
        assert (far <= weight * np.abs(nominal) * (1 + 1e-3)).all()


def test_the_weight_is_not_much_above_what_is_needed(found):
    weight = np.abs(found.weight.response(found.frequency))
    excess = float(np.exp(np.mean(np.log(weight / found.bound))))
    print(f"excess {excess:.2f}")
    assert excess < 1.6


@given(seed=st.integers(0, 10_000))
@settings(max_examples=15, deadline=None)
def test_a_weight_is_stable_minimum_phase_and_above_any_bound(seed):
    rng = np.random.default_rng(seed)
    bound = np.exp(np.convolve(rng.standard_normal(90), np.ones(11) / 11, "valid") - 1)
    weight = fit_weight(FREQUENCY, bound)
    assert (np.abs(weight.response(FREQUENCY)) >= bound).all()
    assert (weight.to_control().poles().real < 0).all()
    assert (weight.to_control().zeros().real < 0).all()


def test_the_set_grows_with_the_noise(found):
    loud = uncertainty_set(
        model(), [Member(m.name, response(model(), deviation=0.01)) for m in MEMBERS] + MEMBERS
    )
    assert isinstance(loud, UncertaintySet)
    assert (loud.bound >= found.bound - 1e-12).all()


def test_a_loop_that_survives_is_stable_for_all_members(found):
    """Integral action of any speed: where the set says that it survives, no member is unstable.

    A loop close to its own limit of stability cannot survive.
    """
    s = 2j * np.pi * found.frequency
    nominal = model().response(found.frequency) / s
    limit = 1 / np.abs(nominal[np.argmax(np.unwrap(np.angle(nominal)) < -np.pi)])
    assert found.survives(0.1 * limit * nominal)
    assert not found.survives(0.95 * limit * nominal)
    for share in np.linspace(0.05, 0.95, 19):
        if found.survives(share * limit * nominal):
            assert all(stable(share * limit * value / s) for value in found.members.values())


def stable(loop):
    """No gain above 1 where the phase has passed -180 degrees."""
    return bool((np.abs(loop)[np.unwrap(np.angle(loop)) < -np.pi] < 1).all())


def test_a_file_brings_back_the_same_set(found, tmp_path):
    uncertainty_file.write(found, tmp_path / "set.toml")
    again = uncertainty_file.read(tmp_path / "set.toml")
    assert again.nominal.delay == found.nominal.delay
    assert np.array_equal(again.nominal.poles, found.nominal.poles)
    assert np.array_equal(again.bound, found.bound)
    assert np.array_equal(again.weight.sections, found.weight.sections)
    for name, value in found.members.items():
        assert np.array_equal(again.members[name], value, equal_nan=True)


def test_python_control_gets_the_same_numbers(found):
    system, delay, weight = found.to_control()
    s = 2j * np.pi * 5.0
    assert system(s) * np.exp(-s * delay) == pytest.approx(model().response(np.array([5.0]))[0])
    assert weight(s) == pytest.approx(found.weight.response(np.array([5.0]))[0])


def test_members_that_are_not_believed_are_refused():
    made = uncertainty_set(model(), [Member("noise", response(model(), coherence=0.2))])
    assert isinstance(made, NoSet)
    assert "noise" in made.reason
    assert isinstance(uncertainty_set(model(), []), NoSet)
