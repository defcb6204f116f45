"""What a user sees of a replay and of a session: the page in headless Chromium."""

from urllib.parse import urlsplit

import pytest

from slipbench.bench.session.session import open_session, run_session
from slipbench.bench.session.session_folder import locked
from slipbench.bench.trials.connection import Connection
from slipbench.session_commands import look
from tests.bench.session.plans import plan_file
from tests.bench.view.conftest import ANY_PORT, serving, until, until_phase
from tests.bench.view.recordings import recorded

PHONE = {"width": 390, "height": 844}
FITS = "() => document.documentElement.scrollWidth <= window.innerWidth"


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return recorded(tmp_path_factory.mktemp("replay"))


def test_a_lost_connection_is_shown_and_the_page_connects_again(page, tmp_path, run):
    with serving(tmp_path, "view", str(run), "--view-address", ANY_PORT) as first:
        page.goto(first.url)
        until(page, "window.updates > 3")
        address = urlsplit(first.url).netloc
    until(page, "document.getElementById('alarm').textContent.startsWith('No connection')")
    with serving(tmp_path, "view", str(run), "--view-address", address):
        until(page, "document.getElementById('alarm').hidden")
        count = page.evaluate("window.updates")
        until(page, f"window.updates > {count + 3}")


def test_a_replay_pauses_and_seeks(page, tmp_path, run):
    with serving(tmp_path, "view", str(run), "--view-address", ANY_PORT) as view:
        page.goto(view.url)
        until(page, "window.updates > 3")
        page.click("#play")
        until(page, "document.getElementById('play').textContent === 'Play'")
        page.evaluate("$('seek').value = 3; $('seek').oninput(); $('seek').onchange()")
        until(page, "state.position === 3")
        until_phase(page, "exciting")
        page.click("#play")
        until(page, "state.position > 3")
        page.evaluate("$('seek').value = $('seek').max; $('seek').onchange()")
        until_phase(page, "done")
        assert page.is_hidden("#stop")


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_it_fits_on_a_phone(browser, tmp_path, run, scheme):
    context = browser.new_context(viewport=PHONE, color_scheme=scheme, is_mobile=True)
    page = context.new_page()
    with serving(tmp_path, "view", str(run), "--view-address", ANY_PORT) as view:
        page.goto(view.url)
        until(page, "window.updates > 3")
        page.evaluate("wish({seek: 3})")
        until_phase(page, "exciting")
        assert page.evaluate(FITS)
        for number in ("rpm", "gear", "speed", "slip", "distance"):
            box = page.locator(f"#{number}").bounding_box()
            assert box["x"] >= 0
            assert box["x"] + box["width"] <= PHONE["width"]
            inside = f"() => $('{number}').scrollWidth <= $('{number}').clientWidth"
            assert page.evaluate(inside), number
    context.close()


def test_a_session_lists_its_runs_with_their_verdicts(page, tmp_path):
    out = tmp_path / "day"
    with locked(out):
        session = open_session(plan_file(tmp_path, {"repeats": 2}), out)
        run_session(session, Connection(), look, lambda line: None)
    with serving(tmp_path, "view", str(out), "--view-address", ANY_PORT) as view:
        page.goto(view.url)
        until(page, "document.getElementById('runs').children.length === 2")
        assert page.locator("#runs li").all_text_contents()[0].startswith("sweep-1: ")
        until(page, "document.getElementById('verdict').textContent.length > 10")
