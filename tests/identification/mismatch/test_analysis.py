"""When names are kept, and when a free curve replaces them."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import pytest

from slipbench.identification.mismatch import explain
from slipbench.identification.mismatch.analysis import Analysis, unexplained
from slipbench.identification.mismatch.curves.adequacy import Remainder
from slipbench.identification.mismatch.thresholds import RISEN_ERROR

PLACE = "servo force"


@dataclass(frozen=True)
class Located:
    """A free curve that was located. p: of it."""

    place: str
    gain: float = 300.0
    p: float = 1e-6

    @property
    def significant(self) -> bool:
        return self.p < 0.05


def known_of(share: float, nats: float) -> Analysis:
    """One name, beside which a free curve finds a share of what the name explains."""
    curve = SimpleNamespace(log_likelihood_gain=80.0, significant=True, place=PLACE)
    return Analysis(
        None,
        None,
        SimpleNamespace(),
        base=SimpleNamespace(),
        before=[Located(PLACE)],
        named=SimpleNamespace(names=["stiction"], fit=SimpleNamespace()),
        after=[curve],
        remains=Remainder(curve, share, nats),
    )


@pytest.fixture
def predicted_held_out(monkeypatch):
    """Set the held-out gains of names and curve."""

    def held_out(names, curve, unchanged=1e6, ratio=0.9):
        where = SimpleNamespace(place=PLACE, regressor="throttle")
        found = SimpleNamespace(confirmed=curve, curve=where, fit=None, proven=SimpleNamespace())
        found.at_fitted_noise = lambda: found
        monkeypatch.setattr(explain, "fit_curves_in_model", lambda *_: found)
        monkeypatch.setattr(explain, "predicted_gain", lambda *_: unchanged)
        monkeypatch.setattr(explain, "error_ratio", lambda *_: ratio)
        monkeypatch.setattr(explain, "_names_predict_better", lambda *_: names > curve)
        monkeypatch.setattr(explain, "_error_is_large", lambda _: False)

    return held_out


def settle(known):
    explain._free(known, (), lambda _: None)
    return "names" if not unexplained(known) else "curve"


@pytest.mark.parametrize("share", [0.04, 0.3])
def test_names_that_leave_little_in_nats_stand(share, predicted_held_out):
    """Slow errors are few nats."""
    predicted_held_out(0.0, 1e6)
    assert settle(known_of(share, 0.04)) == "names"


@pytest.mark.parametrize(("names", "curve"), [(1.0, -5.0), (3761.0, 2711.0), (2711.0, 3761.0)])
def test_names_that_leave_a_small_error_give_way_to_a_curve_that_predicts_better_alone(
    names, curve, predicted_held_out
):
    """With small noise a negligible error is many nats: without a better curve the names stand."""
    predicted_held_out(names, curve)
    assert settle(known_of(0.04, 0.3)) == ("names" if names > curve else "curve")


def test_names_that_leave_a_negligible_error_stand(predicted_held_out):
    """A lag beside 0.01 % of the mean square, which is a tenth of its nats."""
    predicted_held_out(0.0, 1e6)
    assert settle(known_of(1e-4, 0.1)) == "names"


def test_names_that_leave_a_small_error_stand_without_held_out_recordings(predicted_held_out):
    predicted_held_out(0.0, 1e6)
    known = replace(known_of(0.04, 0.3), held_out=None)
    assert settle(known) == "names"


@pytest.mark.parametrize(("names", "curve"), [(3761.0, 2711.0), (2711.0, 3761.0)])
def test_names_that_leave_more_stand_where_they_foretell_more(names, curve, predicted_held_out):
    """Names are withdrawn only for a better explanation."""
    predicted_held_out(names, curve)
    assert settle(known_of(0.2, 0.2)) == ("names" if names > curve else "curve")


@pytest.mark.parametrize("unchanged", [-3.0, 4.0])
def test_a_curve_that_gains_only_where_parameters_move_again_is_withdrawn(
    unchanged, predicted_held_out
):
    """Regression: a coupled drive gained 47 nats, but the written file's error rose by 60 %."""
    predicted_held_out(0.0, 47.0, unchanged)
    known = known_of(0.2, 0.2)
    explain._free(known, (), lambda _: None)
    assert known.free is None
    (veto,) = known.vetoes
    assert veto.gain == unchanged


@pytest.mark.parametrize("ratio", [0.5, 1.0, 1.1, 3.0])
def test_a_curve_with_which_a_held_out_error_rises_does_not_stand(ratio, predicted_held_out):
    """Held-out recordings confirm that something is missing there: only the curve is rejected."""
    predicted_held_out(-1.0, 100.0, ratio=ratio)
    known = known_of(0.3, 0.3)
    explain._free(known, (), lambda _: None)
    assert (known.free is not None) == (ratio <= RISEN_ERROR)
    assert len(known.vetoes) == (ratio > RISEN_ERROR)
    assert known.before[0].significant


@pytest.mark.parametrize(("found", "by_least_squares"), [(True, 0.5), (False, 0.5), (False, 1e-9)])
def test_least_squares_take_no_alarm_back(found, by_least_squares, monkeypatch):
    """found: whether a curve is significant with the fitted noise model; the other is p."""
    plain = SimpleNamespace(base=None, held_out=None)
    plain.curves = lambda: [Located("road force", p=by_least_squares)]
    compared = SimpleNamespace(base=None, held_out=None, by_least_squares=lambda: plain)
    monkeypatch.setattr(explain, "Comparison", lambda *_: compared)
    monkeypatch.setattr(explain, "fit_curves_in_model", lambda *_: None)
    monkeypatch.setattr(explain, "_error_is_large", lambda _: True)
    monkeypatch.setattr(explain, "_headline", lambda _: "")
    monkeypatch.setattr(explain, "operating_region", lambda *_: None)
    monkeypatch.setattr(explain, "Linearization", SimpleNamespace(of=lambda _: None))
    nameless = SimpleNamespace(names=[], fit=None, p=1.0)
    known = replace(known_of(0.2, 0.2), named=nameless, after=[], remains=None)
    known.before = [Located(PLACE, p=1e-6 if found else 0.5)]
    explain._free(known, (), lambda _: None)
    assert unexplained(known) == (found or by_least_squares < 0.05)
    assert known.before[0].place == (PLACE if found else "road force")
