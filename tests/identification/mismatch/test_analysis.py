"""When names stand, and when a free curve takes their place."""

from types import SimpleNamespace

import pytest

from slipbench.identification.mismatch import explain
from slipbench.identification.mismatch.analysis import Analysis, unexplained
from slipbench.identification.mismatch.curves.sufficiency import Remainder

PLACE = "servo force"


def known_of(share: float, nats: float) -> Analysis:
    """One name, beside which a free curve finds a share of what the name explains."""
    curve = SimpleNamespace(gain=80.0, certain=True, place=PLACE)
    return Analysis(
        None,
        None,
        SimpleNamespace(),
        base=SimpleNamespace(),
        before=[SimpleNamespace(gain=300.0, certain=True, place=PLACE)],
        named=SimpleNamespace(names=["stiction"]),
        after=[curve],
        remains=Remainder(curve, share, nats),
    )


@pytest.fixture
def foretold(monkeypatch):
    """What names and the curve gain on held-out recordings is set here."""

    def held_out(names, curve):
        found = SimpleNamespace(confirmed=curve, curve=SimpleNamespace(place=PLACE))
        monkeypatch.setattr(explain, "inside", lambda *_: found)
        monkeypatch.setattr(explain, "_foretell_more", lambda *_: names > curve)

    return held_out


def settle(known):
    explain._free(known, (), lambda _: None)
    return "names" if not unexplained(known) else "curve"


@pytest.mark.parametrize(("share", "nats"), [(0.04, 0.04), (0.3, 0.04), (0.04, 0.3)])
def test_names_that_leave_little_in_one_measure_stand(share, nats, foretold):
    """Where noise is small, next to nothing of an error is many nats; slow errors are few."""
    foretold(0.0, 1e6)
    assert settle(known_of(share, nats)) == "names"


@pytest.mark.parametrize(("names", "curve"), [(3761.0, 2711.0), (2711.0, 3761.0)])
def test_names_that_leave_more_stand_where_they_foretell_more(names, curve, foretold):
    """What is withdrawn must leave a better explanation behind."""
    foretold(names, curve)
    assert settle(known_of(0.2, 0.2)) == ("names" if names > curve else "curve")
