"""Laws of trends: error rates are those stated, a known truth is recovered, units do not matter."""

import math
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slipbench.identification.season.change_points import change_points, model
from slipbench.identification.season.index import refreshed
from slipbench.identification.season.points import Points, points
from slipbench.identification.season.season import Season
from slipbench.identification.season.trend import curve, trend
from slipbench.identification.season.trend_figure import write_figure
from slipbench.identification.season.trend_words import lines
from slipbench.identification.season.weighted import fit, variances
from tests.bench.test_commands import run
from tests.identification.season.seasons import explain, identify, make_run

SEED = 20260503


def noise(kind, generator, count):
    """Stated deviations and errors of `count` values: what the intervals say, and what happens."""
    stated = np.exp(generator.normal(0, 0.7, count))
    true = {
        "as stated": stated,
        "the first half precise": np.where(np.arange(count) < count // 2, 1.0, 5.0),
        "scatter between runs": np.hypot(stated, 1.0),
        "scatter alone": np.hypot(0.05 * stated, 1.0),
        "intervals too narrow": 3 * stated,
        "no intervals": np.ones(count),
    }[kind]
    if kind == "the first half precise":
        stated = true
    elif kind == "scatter alone":
        stated = 0.05 * stated
    elif kind == "no intervals":
        stated = np.zeros(count)
    return stated, generator.normal(0, true)


@pytest.mark.parametrize("slope", [0.0, 0.02])
@pytest.mark.parametrize(
    "kind",
    [
        "as stated",
        "the first half precise",
        "scatter between runs",
        "scatter alone",
        "intervals too narrow",
        "no intervals",
    ],
)
def test_without_a_change_at_most_5_percent_of_series_have_a_change_point(kind, slope):
    print("seed", SEED)
    generator, found, series = np.random.default_rng(SEED), 0, 1000
    for _ in range(series):
        count = int(generator.integers(4, 20))
        x = np.sort(generator.uniform(0, 1000, count))
        deviation, error = noise(kind, generator, count)
        found += bool(change_points(x, slope * x + error, deviation))
    # 3 standard deviations of the count itself: the rate of "no intervals" is 5 % exactly
    assert found <= 0.05 * series + (
        3 * math.sqrt(0.05 * 0.95 * series) if kind == "no intervals" else 0
    )


@pytest.mark.parametrize("kind", ["as stated", "scatter between runs", "no intervals"])
def test_a_jump_is_found_at_its_place_with_its_levels(kind):
    print("seed", SEED)
    generator, found, inside, series = np.random.default_rng(SEED), 0, 0, 200
    for _ in range(series):
        x, at = np.arange(12.0), int(generator.integers(4, 9))
        deviation, error = noise(kind, generator, x.size)
        changes = change_points(x, 0.1 * x + 20 * (x >= at) + error, deviation)
        if [one.after for one in changes] == [at]:
            found += 1
            (one,) = changes
            truth = (0.1 * (at - 1), 0.1 * at + 20)
            inside += one.before[1] <= truth[0] <= one.before[2]
            inside += one.afterwards[1] <= truth[1] <= one.afterwards[2]
            assert one.rises
    assert found > 0.9 * series
    assert inside > 0.9 * 2 * found


def test_the_true_place_of_a_small_jump_is_among_those_that_are_named():
    print("seed", SEED)
    generator, found, exact, named = np.random.default_rng(SEED), 0, 0, 0
    for _ in range(300):
        x, at = np.arange(12.0), int(generator.integers(3, 10))
        deviation, error = noise("as stated", generator, x.size)
        changes = change_points(x, 4.0 * (x >= at) + error, deviation)
        if len(changes) == 1:
            (one,) = changes
            found, exact = found + 1, exact + (one.after == at)
            named += at in (one.after, *one.also)
    assert named > 0.9 * found
    assert named > exact  # the others are named for a reason


def test_a_clear_jump_has_one_place():
    x = np.arange(12.0)
    _, error = noise("as stated", np.random.default_rng(SEED), 12)
    (one,) = change_points(x, 100.0 * (x >= 5) + error, np.ones(12))
    assert (one.after, one.also) == (5, ())


def test_two_jumps_are_two_change_points():
    print("seed", SEED)
    x, generator = np.arange(30.0), np.random.default_rng(SEED)
    value = 10.0 * (x >= 10) - 7.0 * (x >= 20) + generator.normal(0, 0.5, x.size)
    found = change_points(x, value, np.full(x.size, 0.5))
    assert [(one.after, one.rises) for one in found] == [(10, True), (20, False)]


@settings(max_examples=30, deadline=None)
@given(
    st.integers(0, 2**32),
    st.integers(5, 15),
    st.floats(1e-6, 1e6),
    st.floats(-1e3, 1e3),
    st.floats(1e-3, 1e3),
)
def test_units_and_direction_do_not_matter(seed, count, scale, offset, stretch):
    generator = np.random.default_rng(seed)
    x = np.sort(generator.uniform(0, 1000, count))
    deviation, error = noise("scatter between runs", generator, count)
    value = error + 8.0 * (np.arange(count) >= count // 2)
    found = change_points(x, value, deviation)
    for other in (
        change_points(stretch * x + offset, value, deviation),
        change_points(x, scale * (value + offset), scale * deviation),
        change_points(x, -value, deviation),
        change_points(-x[::-1], value[::-1], deviation[::-1])[::-1],
    ):
        assert [one.p_value for one in other] == pytest.approx(
            [one.p_value for one in found], rel=1e-3, abs=1e-9
        )


@pytest.mark.parametrize("value", [np.full(9, 8.7), np.linspace(0.1, 0.9, 9), np.zeros(9)])
def test_values_without_noise_have_no_change_point(value):
    assert change_points(np.arange(9.0), value, np.zeros(9)) == ()
    assert change_points(np.arange(9.0), value, np.full(9, 1e-3)) == ()


def test_a_fit_is_that_of_numpy():
    generator = np.random.default_rng(SEED)
    x, deviation = np.sort(generator.uniform(0, 9, 12)), generator.uniform(0.5, 2, 12)
    value = 3 - 0.5 * x + generator.normal(0, deviation)
    made = fit(np.column_stack([np.ones_like(x), x]), value, deviation**2)
    coefficients, covariance = np.polyfit(x, value, 1, w=1 / deviation, cov="unscaled")
    assert made.coefficients[::-1] == pytest.approx(coefficients)
    assert made.covariance[::-1, ::-1] == pytest.approx(covariance)


@given(st.integers(0, 2**32), st.floats(0, 10))
@settings(max_examples=30, deadline=None)
def test_with_the_scatter_the_residual_is_what_is_expected(seed, scatter):
    generator = np.random.default_rng(seed)
    deviation = generator.uniform(0.1, 3, 10)
    value = generator.normal(0, np.hypot(deviation, scatter))
    columns = model(np.arange(10.0), [])
    variance, between = variances(columns, value, deviation)
    residual = fit(columns, value, variance).residual
    assert residual == pytest.approx(8) if between else residual <= 8 + 1e-9


def series(x, value, deviation):
    names = tuple(f"r{i}" for i in range(x.size))
    return Points("slack", "mm", "mileage", x, value, deviation, names, ())


@pytest.mark.parametrize("kind", ["as stated", "scatter between runs", "no intervals"])
def test_the_interval_of_the_trend_has_the_truth_in_95_percent(kind):
    print("seed", SEED)
    generator, inside, count = np.random.default_rng(SEED), 0, 600
    for _ in range(count):
        x = np.sort(generator.uniform(0, 100, 10))
        deviation, error = noise(kind, generator, 10)
        _, low, high = trend(series(x, 5 + 0.3 * x + error, deviation)).change
        inside += low <= 0.3 * np.ptp(x) <= high
    assert inside / count > 0.95 - 3 * math.sqrt(0.95 * 0.05 / count)


def test_the_curve_of_a_trend_is_within_its_interval():
    x = np.arange(10.0)
    deviation, error = noise("as stated", np.random.default_rng(SEED), 10)
    drawn = curve(trend(series(x, 30.0 * (x >= 5) + error, deviation)))
    assert np.all(drawn[:, 1] < drawn[:, 0])
    assert np.all(drawn[:, 0] < drawn[:, 2])


@pytest.fixture
def season(tmp_path):
    """Ten days of a chain that jumps in its eighth; two runs a day."""
    generator = np.random.default_rng(SEED)
    for day in range(1, 11):
        for number in (1, 2):
            tags = {"mileage": 100 * day}
            frequency = 8.0 + generator.normal(0, 0.1)
            make_run(tmp_path / f"d{day:02d}-{number}", day, tags, frequency)
        paths = [f"../d{day:02d}-{number}" for number in (1, 2)]
        slack = 1.2 + 1.9 * (day > 7) + generator.normal(0, 0.15)
        explain(tmp_path / f"memo{day:02d}", slack, 0.3, paths)
    return tmp_path


def test_backlash_over_mileage_in_words(season):
    found = lines(trend(points(Season(refreshed(season)), "backlash", "mileage")))
    (sentence,) = [line for line in found if line.startswith("Change point")]
    words = (
        r"Change point: backlash_slack rises from (\S+) \((\S+) to (\S+)\) to (\S+) \((\S+) to (\S+)\) rad"
        r" between memo07 and memo08 \(mileage 700 to 800; p < 0\.001 over all places\)\."
    )
    found = [float(one) for one in re.fullmatch(words, sentence).groups()]
    assert found[1] < 1.2 < found[2] < 2 < found[4] < 3.1 < found[5]


def test_runs_of_a_day_are_pooled_and_over_time_they_are_not(season):
    made = Season(refreshed(season))
    daily, each = (points(made, "natural_frequency", over) for over in ("date", "time"))
    assert daily.x.size == 10
    assert each.x.size == 10  # both runs of a day begin at the same minute
    assert daily.runs[0] == "d01-1, d01-2"
    single = points(made, "natural_frequency", "date", "name like '%-1'")
    assert daily.deviation[0] == pytest.approx(single.deviation[0] / math.sqrt(2))


def test_what_is_left_out_is_said(season):
    make_run(season / "spoiled", 11, {"mileage": 1100}, 8.0, "not usable")
    make_run(season / "untagged", 12, {}, 8.0)
    identify(season / "d01-1" / "window", 9.9)
    found = points(Season(refreshed(season)), "natural_frequency", "mileage")
    assert found.left_out == (
        "an identification beside that of its run: window",
        "verdict: not usable: spoiled",
        "no mileage: untagged",
    )
    said = "\n".join(lines(trend(found)))
    assert all(f"left out: {one}" in said for one in found.left_out)


def test_runs_that_differ_in_more_than_the_abscissa_are_noted(season):
    path = season / "d03-1" / "trial.toml"
    path.write_text(path.read_text().replace('name = "throttle_sweep"', 'name = "other"'))
    made = Season(refreshed(season))
    assert points(made, "natural_frequency").mixed == ("trial (other, throttle_sweep)",)
    assert points(made, "natural_frequency", where="trial <> 'other'").mixed == ()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("natural_freq",), "did you mean natural_frequency"),
        (("zzz",), "parameters: "),
        (("backlash", "--over", "milage"), "did you mean 'mileage'"),
        (("backlash", "--over", "name"), "holds no numbers"),
        (("backlash", "--over", "mileage", "--where", "mileage < 300"), "too few values"),
        (("backlash", "--figure", "trend.gif"), "ends with .png"),
    ],
)
def test_wrong_input_ends_with_its_reason(season, monkeypatch, capsys, arguments, words):
    status, _, err = run(monkeypatch, capsys, "runs", season, "--trend", *arguments)
    assert status == 2
    assert words in err


@pytest.mark.parametrize("over", ["date", "time", "mileage"])
def test_a_figure_is_written(season, tmp_path, over):
    path = tmp_path / "trend.svg"
    write_figure(trend(points(Season(refreshed(season)), "natural_frequency", over)), path)
    assert "natural frequency, Hz" in path.read_text() or len(path.read_bytes()) > 10_000
