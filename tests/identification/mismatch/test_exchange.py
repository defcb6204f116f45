"""A name on which the search got stuck is exchanged for what explains more; a right one stays."""

import pytest

from slipbench.identification.mismatch.analysis import begin
from slipbench.identification.mismatch.fit.calibrate import calibrate, from_far
from slipbench.identification.mismatch.fit.fitting import Fit, with_effects
from slipbench.identification.mismatch.naming.exchange import exchanged
from slipbench.identification.mismatch.naming.naming import Named
from slipbench.identification.mismatch.naming.tried import candidates
from tests.identification.mismatch.spring import recorded, system

BENT = ("asymmetry", "cubic", "dead_zone")


@pytest.fixture(scope="module")
def bare(tmp_path_factory) -> Fit:
    """The linear spring, re-calibrated on a hardening one."""
    spring = system(tmp_path_factory.mktemp("spring"))
    analysis = begin(spring, [spring.prepare(recorded(33, cube=0.05, seconds=12.0))], [])
    return calibrate(analysis.training, analysis.training.origin())


def after_exchange(bare: Fit, key: str) -> tuple[Named, Named]:
    library = [
        k for k in bare.model.system.library if k.name in BENT and k.place.name == "deflection"
    ]
    kind = next(k for k in library if k().key == key)
    fit = from_far(with_effects(bare, (next(candidates(kind)),)))
    named = Named(bare, fit, [], 0.0, {key: {"dead_zone.deflection": 3.0}})
    return named, exchanged(named, library, None, print, [])


def test_a_wrong_name_is_exchanged_for_the_right_one_and_becomes_its_rival(bare) -> None:
    before, after = after_exchange(bare, "asymmetry.deflection")
    assert after.names == ["cubic.deflection"]
    nats = after.gain - before.gain
    assert after.rivals == {"cubic.deflection": {"asymmetry.deflection": pytest.approx(nats)}}


def test_a_right_name_stays(bare) -> None:
    before, after = after_exchange(bare, "cubic.deflection")
    assert after is before
