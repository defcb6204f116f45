"""When names stand, and when a free curve takes their place."""

from types import SimpleNamespace

import pytest

from slipbench.identification.mismatch import analysis, explain
from slipbench.identification.mismatch.analysis import Analysis, unexplained

PLACE = "servo force"


def known_of(gain, left, by_factors=False, where=PLACE):
    """One name that brings so many nats, beside which a free curve finds some more somewhere."""
    curve = SimpleNamespace(gain=left, certain=True, place=where)
    fit = SimpleNamespace(candidates=[PLACE])
    system = SimpleNamespace(by_factors=by_factors)
    return Analysis(
        system,
        None,
        SimpleNamespace(),
        base=SimpleNamespace(),
        before=[SimpleNamespace(gain=0.3 * gain, certain=True, place=PLACE)],
        named=SimpleNamespace(names=["stiction"], gain=gain, fit=fit),
        after=[curve],
    )


@pytest.fixture
def foretold(monkeypatch):
    """What names and the curve gain on held-out recordings is set here."""

    def held_out(names, curve):
        found = SimpleNamespace(confirmed=curve, curve=SimpleNamespace(place=PLACE))
        monkeypatch.setattr(explain, "inside", lambda *_: found)
        monkeypatch.setattr(explain, "_foretell_more", lambda *_: names > curve)
        monkeypatch.setattr(analysis, "place_of", lambda _, candidate: candidate)

    return held_out


def settle(known):
    explain._free(known, (), lambda _: None)
    return "names" if not unexplained(known) else "curve"


@pytest.mark.parametrize("left", [0.0, 20.0, 59.0])
def test_names_that_leave_next_to_nothing_stand(left, foretold):
    foretold(0.0, 1e6)
    assert settle(known_of(2000.0, left)) == "names"


@pytest.mark.parametrize(("names", "curve"), [(3761.0, 2711.0), (2711.0, 3761.0)])
def test_names_that_leave_little_stand_where_they_foretell_more(names, curve, foretold):
    """Stiction by another formula left 76 of 5 832 nats, and a curve in its place brought 4 203."""
    foretold(names, curve)
    assert settle(known_of(5832.0, 76.0)) == ("names" if names > curve else "curve")


def test_names_that_leave_much_are_withdrawn_though_they_foretell_more(foretold):
    """What imitates something that the library lacks may foretell well too."""
    foretold(3000.0, 1000.0)
    assert settle(known_of(2000.0, 300.0)) == "curve"


@pytest.mark.parametrize(("names", "curve"), [(222.0, 182.0), (182.0, 222.0)])
def test_what_is_left_at_another_place_withdraws_no_name_that_foretells_more(
    names, curve, foretold
):
    """An asymmetric filling of 403 nats was withdrawn for 22 nats that wind left on the road."""
    foretold(names, curve)
    other = known_of(403.0, 22.0, where="road force")
    assert settle(other) == ("names" if names > curve else "curve")
    assert settle(known_of(403.0, 22.0)) == "curve"


def test_much_that_is_left_withdraws_names_wherever_it_is(foretold):
    foretold(3000.0, 1000.0)
    assert settle(known_of(2000.0, 450.0, where="road force")) == "curve"
