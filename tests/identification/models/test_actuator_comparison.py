"""Laws of throttle against spark, on systems whose answer is known."""

from itertools import pairwise

import numpy as np
import pytest

from slipbench.identification.models.actuator_comparison import (
    Comparison,
    DeadTime,
    NoComparison,
    answer,
    compare_actuators,
)
from slipbench.identification.response.response import FrequencyResponse
from slipbench.studies.paper.switched_claims import actuator_claims

FREQUENCY = np.linspace(0.5, 14, 120)
DRIVELINE, SERVO = (2 * np.pi * 8.3, 0.32), (2 * np.pi * 12.6, 0.4)


def pair(s, w, z):
    return w * w / (s * s + 2 * z * w * s + w * w)


def delay_free(frequency, actuator):
    s = 2j * np.pi * np.asarray(frequency)
    return pair(s, *DRIVELINE) * (pair(s, *SERVO) if actuator == "throttle" else 1.0)


def response(actuator, delay, gain=0.17, seed=1, noise=0.01, top=14.0) -> FrequencyResponse:
    f = FREQUENCY[top >= FREQUENCY]
    value = gain * delay_free(f, actuator) * np.exp(-2j * np.pi * f * delay)
    rng, size = np.random.default_rng(seed), noise * abs(gain)
    value = value + size / np.sqrt(2) * (
        rng.standard_normal(f.size) + 1j * rng.standard_normal(f.size)
    )
    return FrequencyResponse(
        f"{actuator}_command",
        "slip",
        f,
        value,
        np.full(f.size, 0.99),
        np.full(f.size, size),
        2.0,
        "synthetic",
    )


KNOWN = (DeadTime(0.014, 0.0135, 0.0145), DeadTime(0.004, 0.0035, 0.0045))


def compared(gain=0.17, seed=1, delays=KNOWN, spark_gain=0.008) -> Comparison:
    found = compare_actuators(
        response("throttle", 0.014, gain, seed),
        response("spark", 0.004, spark_gain, seed + 50),
        delays=delays,
    )
    assert isinstance(found, Comparison)
    return found


def true_lead():
    spark, throttle = (delay_free(np.array([10.0]), name)[0] for name in ("spark", "throttle"))
    return np.degrees(np.angle(spark / throttle))


def true_bandwidth(actuator):
    f = np.linspace(0.1, 14, 5000)
    phase = np.degrees(np.unwrap(np.angle(delay_free(f, actuator))))
    return f[np.argmax(phase <= -120)]


def test_with_known_delays_lead_and_bandwidths_are_the_true_ones_over_seeds():
    inside = []
    for seed in range(4):
        found = compared(seed=seed)
        inside.append(abs(found.lead - true_lead()) <= found.lead_band)
        assert found.lead == pytest.approx(true_lead(), abs=4)
        for one, name in ((found.throttle, "throttle"), (found.spark, "spark")):
            assert one.bandwidth == pytest.approx(true_bandwidth(name), rel=0.02)
    print("seeds 0..3 inside the band:", inside)
    assert sum(inside) >= 3


def test_delays_that_are_not_known_are_found_and_widen_the_bands():
    known, found = compared(), compared(delays=(None, None))
    assert found.throttle.delay.low - 1e-3 <= 0.014 <= found.throttle.delay.high + 1e-3
    assert found.lead_band > known.lead_band
    assert abs(found.lead - true_lead()) < 2 * found.lead_band


def test_neither_gain_nor_sign_changes_lead_or_bandwidth():
    one, other = compared(), compared(gain=17.0, spark_gain=-0.8)
    assert other.lead == pytest.approx(one.lead, abs=1.0)
    assert other.spark.bandwidth == pytest.approx(one.spark.bandwidth, abs=0.1)
    assert other.throttle.gain(np.array([1.0]))[0] == pytest.approx(1.0, abs=0.01)


def test_more_phase_margin_leaves_less_bandwidth():
    one = compared().throttle
    margins = [one.lags_by(180 - margin) for margin in (30, 45, 60, 75)]
    assert all(a > b for a, b in pairwise(margins))
    assert one.lags_by(120, delayed=True) < one.bandwidth


def test_a_band_that_does_not_reach_the_cutoff_is_refused_in_words():
    found = compare_actuators(response("throttle", 0.014, top=8.0), response("spark", 0.004))
    assert isinstance(found, NoComparison)
    assert "reliable" in found.reason
    claims = actuator_claims(found)
    assert not any(claim.holds for claim in claims)


def test_the_answer_is_a_sentence_with_the_figures():
    found = compared()
    said = answer(found)
    assert f"{found.lead:.0f} ±" in said
    assert "w_c" in said
    assert [claim.name for claim in actuator_claims(found)] == [
        "spark_leads",
        "throttle_bandwidth",
        "spark_bandwidth",
    ]
