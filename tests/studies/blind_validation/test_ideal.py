"""What the ideal observer subtracts is what the hidden effects have put into the recordings."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slipbench.identification.mismatch.fit.calibrate import calibrate
from slipbench.identification.mismatch.runs import open_analysis
from slipbench.studies.blind_validation.generator.case import Case, draw_case, write_case
from slipbench.studies.blind_validation.generator.fault_types import Hidden
from slipbench.studies.blind_validation.generator.vehicle_file import Noises
from slipbench.studies.blind_validation.ideal import Observer, ideal

SEED, NUMBER = 1, 9


def case_with(
    *hidden: Hidden, combustion: float = 1e-12, bump: float | None = None, noisy: bool = True
) -> Case:
    """One case with these effects; two short trials, combustion noise and bumps as given.

    Its filters are stated. bump: None for that of the case; noisy: whether its channels have noise.
    """
    case = draw_case(SEED, NUMBER)
    trials = tuple(
        replace(
            t,
            excitation=replace(t.excitation, seconds=9.0),
            roughness=replace(
                t.roughness, combustion=combustion, bump=t.roughness.bump if bump is None else bump
            ),
        )
        for t in case.training[:2]
    )
    truth = case.truth if noisy else replace(case.truth, noises=silent(case.truth.noises))
    return replace(case, truth=truth, hidden=hidden, training=trials, held_out=())


def silent(noises: Noises) -> Noises:
    return replace(noises, throttle=0.0, throttle_quantum=0.0, engine_speed=0.0, optical=0.0)


def model_of(case: Case, folder: Path):
    vehicle, training, _ = write_case(case, folder)
    return open_analysis(vehicle, training, []).training


@pytest.fixture(scope="module")
def bare(tmp_path_factory):
    return model_of(case_with(noisy=False), tmp_path_factory.mktemp("bare") / "case")


FILLING = Hidden("asymmetric_filling", "moderate", "", {"asymmetry": 0.6})
STICTION = Hidden("throttle_stiction", "moderate", "", {"width": 4e-3, "breakaway": 1.4})
LAG = Hidden("channel_lag", "moderate", "engine_speed", {"time_constant": 20e-3})
STALE = Hidden("stale_frames", "moderate", "optical_speed", {"share": 0.1})
TOOTH = Hidden("tooth_misplacement", "moderate", "rear_encoder", {"displacement": 1e-3, "tooth": 5})
FRONT_TOOTH = replace(TOOTH, subject="front_encoder")
OIL = Hidden("cold_oil_drag", "moderate", "", {"torque": 4.0, "time": 3.0})
COMPRESSION = Hidden("compression_torque", "moderate", "", {"swing": 40.0})
HARD = Hidden("hardening_cush", "moderate", "", {"hardening": 208.0})
SCALE = Hidden("optical_scale", "moderate", "", {"error": -5e-3})
MEAN = Hidden("moving_average", "moderate", "optical_speed", {"window": 40e-3})


@pytest.mark.parametrize(
    "hidden",
    [
        (FILLING,),
        (STICTION,),
        (LAG,),
        (STALE,),
        (TOOTH,),
        (FRONT_TOOTH,),
        (OIL,),
        (MEAN,),
        (FILLING, LAG),
    ],
    ids=lambda hidden: " and ".join(h.key for h in hidden),
)
def test_the_difference_is_what_the_recordings_differ_by(
    hidden: tuple[Hidden, ...], bare, tmp_path: Path
) -> None:
    """Recorded with and without the effects, without noise; the difference explains 90 % of it.

    Frames on the bus round their values, which is most of the rest.

    What the plate does drives the motion, so that servo effects are compared in its group alone.
    """
    case = case_with(*hidden, noisy=False)
    model = model_of(case, tmp_path / "case")
    difference = Observer(case, case.training).difference(model, ())
    explained = unexplained = 0.0
    for b, block in enumerate(model.partition.groups):
        if hidden == (STICTION,) and block.subsystem != "servo":
            assert not any(np.any(d) for d in difference[b])
            continue
        for r in range(len(model.records)):
            rows = min(len(model.measured[b][r]), len(bare.measured[b][r]))
            known = (model.known_bins[b][r][:rows] * bare.known_bins[b][r][:rows]) > 0.0
            true = (model.measured[b][r][:rows] - bare.measured[b][r][:rows]) * known
            mine = difference[b][r][:rows] * known
            scale = np.std(bare.measured[b][r] - np.roll(bare.measured[b][r], 1, axis=0), axis=0)
            explained += np.sum((true / (scale + 1e-9)) ** 2)
            unexplained += np.sum(((true - mine) / (scale + 1e-9)) ** 2)
    assert unexplained < 0.1 * explained


WARMTH = Hidden("grip_temperature", "moderate", "", {"sensitivity": -3e-3})


def check_same_difference(model, one: Case, other: Case) -> None:
    """The observer subtracts the same from recordings of both cases, and not nothing."""
    differences = [Observer(c, c.training).difference(model, ()) for c in (one, other)]
    first, second = ([d for group in found for d in group] for found in differences)
    assert any(np.any(d) for d in first)
    for a, b in zip(first, second, strict=True):
        np.testing.assert_array_equal(a, b)


def test_the_response_to_bumps_is_no_evidence(tmp_path: Path) -> None:
    """A tyre of less grip answers bumps differently; the bumps are in no recording."""
    smooth, rough = (case_with(WARMTH, bump=b) for b in (0.0, 0.025))
    model = model_of(smooth, tmp_path / "case")
    check_same_difference(model, smooth, rough)


def test_the_noise_of_a_repeated_frame_is_no_evidence(tmp_path: Path) -> None:
    """A stale frame repeats the noise of the one before it, which is in no recording by itself."""
    case = case_with(STALE)
    model = model_of(case, tmp_path / "case")
    quiet = replace(case, truth=replace(case.truth, noises=silent(case.truth.noises)))
    check_same_difference(model, case, quiet)


def test_the_gain_is_that_of_a_whole_calibration_without_the_effect(tmp_path: Path) -> None:
    case = case_with(FILLING, combustion=0.03)
    model = model_of(case, tmp_path / "with")
    base = calibrate(model, model.origin())
    found = ideal(case, base)
    observer = Observer(case, case.training)
    cleared = replace(
        model, records=tuple(observer.led_in(r, i, ()) for i, r in enumerate(model.records))
    )
    cleared.__dict__["measured"] = [
        [m - d for m, d in zip(ms, ds, strict=True)]
        for ms, ds in zip(model.measured, observer.difference(model, ()), strict=True)
    ]
    whole = calibrate(cleared, base.point).score - base.score
    assert found.gain > 100.0
    assert found.gain == pytest.approx(whole, rel=0.1)
    assert found.each == (found.gain,)


@pytest.mark.parametrize("combustion", [1e-12, 0.03])
def test_combustion_noise_hides_no_effect_that_goes_with_the_crank_angle(
    combustion: float, tmp_path: Path
) -> None:
    """It moves the crank by radians within seconds; the phase of the recording is not lost."""
    case = case_with(COMPRESSION, combustion=combustion)
    model = model_of(case, tmp_path / "case")
    assert ideal(case, calibrate(model, model.origin())).gain > 200.0


def test_what_calibration_absorbs_is_worth_nothing_beside_another_effect(tmp_path: Path) -> None:
    """Radii and ratios make up for a scale of the optical speed, however large the other effect is."""
    case = case_with(HARD, SCALE, combustion=0.03)
    model = model_of(case, tmp_path / "case")
    hard, scale = ideal(case, calibrate(model, model.origin())).each
    assert hard > 500.0
    assert scale < 8.0
