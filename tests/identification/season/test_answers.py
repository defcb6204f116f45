"""What the page of a season is sent is what `slipbench runs` prints."""

import json

import pytest

from slipbench.identification.season.answers import SeasonAnswers
from slipbench.identification.season.index import refreshed
from slipbench.identification.season.listing import listing, selected
from slipbench.identification.season.season import Season
from slipbench.identification.season.side_by_side import pair, table
from slipbench.protocol.errors import InputError
from tests.identification.season.seasons import identify, make_run

TYRES = ("new", "new", "used", "used", "used")


@pytest.fixture
def root(tmp_path):
    for day, tyre in enumerate(TYRES, 1):
        tags = {"tyre": tyre, "mileage": 100 * day}
        make_run(tmp_path / f"day{day}/runs/a-1", day, tags, 8.0 + 0.1 * day)
    make_run(tmp_path / "day1/runs/b-1", 1, {"tyre": "new"})
    return tmp_path


def sent(answer):
    """Give what arrives at the page: JSON has no NaN."""
    return json.loads(json.dumps(answer, allow_nan=False))


@pytest.mark.parametrize("where", ["", "tyre = 'used'", "mileage > 9000"])
def test_rows_are_the_listing(root, where):
    answer = sent(SeasonAnswers(root).rows({"where": where}))
    season = Season(refreshed(root))
    headings, cells = listing(season, where or None)
    assert (answer["headings"], answer["cells"]) == (headings, cells)
    assert answer["runs"] == [row["path"] for row in season.rows(where or None)]
    assert answer["total"] == len(TYRES) + 1


def test_columns_are_the_selection(root):
    answer = sent(SeasonAnswers(root).rows({"columns": "name, mileage, natural_frequency"}))
    expected = selected(Season(refreshed(root)), "name, mileage, natural_frequency")
    assert (answer["headings"], answer["cells"]) == expected


def test_a_run_that_is_recorded_meanwhile_is_in_the_next_list(root):
    answers = SeasonAnswers(root)
    make_run(root / "day9/runs/late-1", 9)
    answer = answers.rows({})
    assert answer["runs"][0] == "day9/runs/late-1"
    assert answer["total"] == len(TYRES) + 2


def test_what_has_no_run_of_its_own_cannot_be_selected(root):
    identify(root / "elsewhere", 8.4, recording="nothing-1")
    answer = SeasonAnswers(root).rows({})
    kinds = Season(refreshed(root)).rows()
    assert [path is None for path in answer["runs"]] == [row["kind"] == "identify" for row in kinds]
    assert None in answer["runs"]


def test_two_runs_side_by_side_are_those_of_the_command(root):
    names = {"first": "day1/runs/a-1", "second": "day5/runs/a-1"}
    answer = sent(SeasonAnswers(root).compare(names))
    season = Season(refreshed(root))
    headings, cells = table(season, *pair(season, tuple(names.values())))
    assert (answer["headings"], answer["cells"]) == (headings, cells)


def test_a_trend_has_points_in_order_inside_their_intervals(root):
    asked = {"parameter": "natural_frequency", "over": "mileage"}
    answer = sent(SeasonAnswers(root).trend(asked))
    assert answer["x"] == [100.0, 200.0, 300.0, 400.0, 500.0]
    assert answer["value"] == pytest.approx([8.1, 8.2, 8.3, 8.4, 8.5])
    for low, value, high in zip(answer["low"], answer["value"], answer["high"], strict=True):
        assert low < value < high
    for low, value, high in zip(
        answer["line_low"], answer["line"], answer["line_high"], strict=True
    ):
        assert low <= value <= high
    assert any("natural_frequency" in line for line in answer["lines"])
    assert answer["unit"] == "Hz"


def test_a_filter_holds_for_the_trend_as_well(root):
    asked = {"parameter": "natural_frequency", "over": "mileage", "where": "tyre = 'used'"}
    assert SeasonAnswers(root).trend(asked)["x"] == [300.0, 400.0, 500.0]


@pytest.mark.parametrize(
    ("name", "asked", "words"),
    [
        ("rows", {"where": "tyres = 'new'"}, "tyre"),
        ("rows", {"where": "read_text('/etc/hostname') <> ''"}, "cannot be evaluated"),
        ("compare", {"first": "day1/runs/a-1"}, "two runs"),
        ("compare", {"first": "day1/runs/a-1", "second": "no-such"}, "no-such"),
        ("trend", {"parameter": "nothing"}, "there is no parameter"),
        ("trend", {"parameter": "natural_frequency", "over": "tyre"}, "holds no numbers"),
    ],
)
def test_what_cannot_be_answered_says_why(root, name, asked, words):
    with pytest.raises(InputError, match=words):
        SeasonAnswers(root).by_name[name](asked)
