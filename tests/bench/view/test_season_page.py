"""What a user sees of a season: the page in headless Chromium, served by `slipbench view`."""

import os

import pytest

from tests.bench.view.conftest import serving
from tests.identification.season.seasons import make_run

ANY_PORT = "127.0.0.1:0"
PATIENCE = 240_000  # ms; a busy machine starts slowly
PHONE = {"width": 390, "height": 844}
FITS = "() => document.documentElement.scrollWidth <= window.innerWidth"
DAYS = 12


@pytest.fixture(scope="module")
def season(tmp_path_factory):
    """A season: the natural frequency falls with the mileage, and drops after day 8."""
    pytest.importorskip("duckdb", reason="pip install 'slipbench[analysis]'")
    root = tmp_path_factory.mktemp("season") / "2026"
    for day in range(1, DAYS + 1):
        tags = {"tyre": "new" if day < 6 else "used", "mileage": 80 * day}
        frequency = 9.0 - 0.01 * day - (1.5 if day > 8 else 0.0)
        verdict = "not usable" if day == 3 else "good"
        make_run(root / f"day{day:02d}/runs/sweep-1", day, tags, frequency, verdict)
    return root


@pytest.fixture
def shown(page, season, tmp_path):
    with serving(tmp_path, "view", str(season), "--view-address", ANY_PORT) as view:
        page.goto(view.url)
        answered(page, 1)
        yield page


def answered(page, count):
    page.wait_for_function(f"() => window.answers >= {count}", timeout=PATIENCE)


def cells(page, column):
    place = page.locator("#rows thead th").all_text_contents().index(column)
    return page.locator(f"#rows tbody td:nth-child({place + 1})").all_text_contents()


def filtered(page, where):
    before = page.evaluate("window.answers")
    page.fill("#where", where)
    page.click("#filter button")
    answered(page, before + 1)


def test_it_lists_filters_and_orders_the_runs(shown):
    assert shown.text_content("#folder") == "2026"
    assert shown.text_content("#count") == f"{DAYS} of {DAYS} runs and analyses"
    assert cells(shown, "verdict").count("not usable") == 1
    filtered(shown, "tyre = 'used' and mileage > 500")
    assert shown.text_content("#count") == f"6 of {DAYS} runs and analyses"
    assert cells(shown, "tyre") == ["used"] * 6
    shown.click("#rows thead button:text-is('mileage')")
    assert cells(shown, "mileage") == ["560", "640", "720", "800", "880", "960"]
    shown.click("#rows thead button:text-is('mileage')")
    assert cells(shown, "mileage")[0] == "960"
    picture(shown, "season_list")


def test_a_wrong_filter_is_shown_with_its_remedy_and_the_list_stays(shown):
    filtered(shown, "tyres = 'used'")
    assert "did you mean" in shown.text_content("#alarm")
    assert shown.locator("#rows tbody tr").count() == DAYS
    filtered(shown, "")
    assert shown.is_hidden("#alarm")


def test_two_selected_runs_are_compared(shown):
    assert shown.is_disabled("#compare")
    boxes = shown.locator("#rows tbody input")
    for index in (11, 5, 0):  # a third choice replaces the first
        boxes.nth(index).check()
    assert shown.locator("#rows tbody input:checked").count() == 2
    shown.click("#compare")
    answered(shown, 2)
    text = shown.locator("#compared").inner_text()
    assert "mileage" in text
    assert shown.locator("#compared .differs").count() >= 1
    picture(shown, "season_compare")


def test_a_trend_is_drawn_with_its_change_point(shown):
    shown.select_option("#parameter", "natural_frequency")
    shown.select_option("#over", "mileage")
    shown.click("#trend-form button")
    answered(shown, 2)
    assert shown.is_hidden("#trend-fault")
    assert "Change point: natural_frequency falls" in shown.text_content("#trend-lines")
    assert shown.locator("#trend-chart canvas").count() == 1
    drawn = shown.evaluate("plot.data[0].length")
    assert drawn == DAYS - 1  # one run is not usable
    picture(shown, "season_trend")


def test_a_trend_of_too_few_runs_says_so(shown):
    filtered(shown, "mileage > 900")
    shown.select_option("#parameter", "natural_frequency")
    shown.click("#trend-form button")
    answered(shown, 3)
    assert "too few values" in shown.text_content("#trend-fault")
    assert shown.locator("#trend-chart canvas").count() == 0


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_it_fits_on_a_phone(browser, season, tmp_path, scheme):
    context = browser.new_context(viewport=PHONE, color_scheme=scheme, is_mobile=True)
    page = context.new_page()
    with serving(tmp_path, "view", str(season), "--view-address", ANY_PORT) as view:
        page.goto(view.url)
        answered(page, 1)
        assert page.evaluate(FITS)
        picture(page, f"season_phone_{scheme}")
    context.close()


def picture(page, name):
    """Keep a picture for people where a folder for pictures is named."""
    if folder := os.environ.get("SLIPBENCH_PICTURES"):
        page.screenshot(path=f"{folder}/{name}.png", full_page=True)
