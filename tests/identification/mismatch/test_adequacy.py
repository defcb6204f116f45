"""Names are adequate by the error share that a free curve could still explain, not by nats."""

import pytest

from slipbench.identification.mismatch.analysis import begin
from slipbench.identification.mismatch.curves.adequacy import Remainder, remainder
from slipbench.identification.mismatch.curves.locate import locate
from slipbench.identification.mismatch.fit.calibrate import calibrate
from slipbench.identification.mismatch.fit.candidate import Candidate
from slipbench.identification.mismatch.fit.fitting import Fit, with_effects
from slipbench.identification.mismatch.fit.least_squares_start import least_squares_start
from slipbench.identification.mismatch.fit.linearization import Linearization
from slipbench.identification.mismatch.naming.candidates import candidates
from slipbench.identification.mismatch.thresholds import RESIDUAL_SHARE
from tests.identification.mismatch.spring import recorded, system

QUIET = 1e-5
"""m, of noise: a part in a hundred thousand, so that a negligible effect is many nats."""


@pytest.fixture(scope="module")
def bare(tmp_path_factory) -> Fit:
    """The linear spring, re-calibrated on a hardening one that has a trace of a square as well."""
    spring = system(tmp_path_factory.mktemp("spring"))
    ride = recorded(31, cube=0.05, square=2e-3, seconds=20.0, noise=QUIET)
    analysis = begin(spring, [spring.prepare(ride)], [])
    return calibrate(analysis.training, analysis.training.origin())


def named(bare: Fit, key: str) -> Fit:
    kind = next(k for k in bare.model.system.library if k().key == key)
    first: Candidate = next(candidates(kind))
    return least_squares_start(with_effects(bare, (first,)))


def left_by(bare: Fit, key: str) -> Remainder | None:
    fit = named(bare, key)
    return remainder(bare, fit, locate(Linearization.of(fit), None))


def test_a_right_name_stands_beside_something_small_that_is_certain(bare) -> None:
    remaining = left_by(bare, "cubic.deflection")
    assert remaining is not None, "the trace of a square is certain at this noise"
    assert remaining.curve.log_likelihood_gain > 60.0
    assert remaining.share < 0.2 * RESIDUAL_SHARE
    assert remaining.small


def test_a_wrong_name_leaves_a_curve_too_much_to_stand(bare) -> None:
    remaining = left_by(bare, "asymmetry.deflection")
    assert remaining is not None
    assert not remaining.small


def test_what_no_free_curve_finds_leaves_nothing(bare) -> None:
    fit = named(bare, "cubic.deflection")
    assert remainder(bare, fit, []) is None
