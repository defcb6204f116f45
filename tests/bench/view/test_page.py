"""What a user sees: the page in headless Chromium, beside a trial in real time and on a replay."""

import re
from urllib.parse import urlsplit

import pytest

from slipbench.bench.session.session import open_session, run_session
from slipbench.bench.session.session_folder import locked
from slipbench.bench.trials.connection import Connection
from slipbench.protocol.configuration import load_toml
from slipbench.session_commands import look
from tests.bench.session.plans import plan_file
from tests.bench.view.conftest import serving
from tests.bench.view.recordings import recorded, short_trial

ANY_PORT = "127.0.0.1:0"
PATIENCE = 240_000  # ms; a busy machine starts a trial slowly
PHONE = {"width": 390, "height": 844}
FITS = "() => document.documentElement.scrollWidth <= window.innerWidth"


def until(page, condition):
    page.wait_for_function(f"() => {condition}", timeout=PATIENCE)


def until_phase(page, phase):
    until(page, f"document.getElementById('head').dataset.phase === '{phase}'")


def live_trial(folder, duration="30 s", *options):
    path = short_trial(folder, duration, rider={"presses_button_after": "500 ms"})
    run = folder / "run"
    address = () if "--view-address" in options else ("--view-address", ANY_PORT)
    options = ("--real-time", "--view", *address, *options)
    return serving(folder, "trial", str(path), "--out", str(run), *options)


def test_it_opens_updates_survives_a_reload_and_trips(page, tmp_path):
    with live_trial(tmp_path) as trial:
        page.goto(trial.url)
        until_phase(page, "exciting")
        until(page, "window.updates > 60")
        assert re.fullmatch(r"\d{5}", page.text_content("#rpm"))
        assert page.text_content("#gear") == "2"
        assert page.locator("#limits > :visible").count() >= 10
        before = page.evaluate("data[0][0]")
        page.reload()
        until(page, "window.updates > 3")
        assert page.evaluate("data[0][0]") == before  # the samples from before the reload
        drawn = "document.querySelector('#chart-slip canvas').toDataURL()"
        first = page.evaluate(drawn)
        until(page, f"{drawn} !== '{first}'")
        page.click("#trip")
        page.click("#cancel")
        assert page.is_hidden("#confirm")
        assert trial.process.poll() is None
        page.click("#trip")
        page.click("#trip-now")
        until_phase(page, "tripped")
        assert trial.wait() == 3
    assert load_toml(tmp_path / "run" / "run.toml")["outcome"]["trip"] == "stopped"


def test_it_shows_the_quick_look_when_the_run_is_done(page, tmp_path):
    with live_trial(tmp_path, "4 s") as trial:
        page.goto(trial.url)
        until(page, "/^(good|go on|repeat|other)/.test($('verdict').textContent)")
        outcome = load_toml(tmp_path / "run" / "run.toml")["outcome"]
        assert page.text_content("#phase") == outcome["phase"]
        assert page.locator("#look li").count() >= 1
        assert page.is_disabled("#trip")
        trial.wait()
        until(page, "!document.getElementById('alarm').hidden")
        assert "The bench has ended" in page.text_content("#alarm")


def test_another_machine_needs_the_token_and_a_read_only_page_has_no_trip(browser, page, tmp_path):
    with live_trial(tmp_path, "30 s", "--view-address", "0.0.0.0:0") as trial:
        local = re.sub(r"//[^:]+:", "//127.0.0.1:", trial.url)
        parts = urlsplit(local)
        assert page.goto(f"http://{parts.netloc}/").status == 403
        page.goto(local)
        until(page, "window.updates > 3")
        assert "token" not in page.url
        until(page, "!document.getElementById('stop').hidden")
        token = re.search(r"read-only: \S+token=(\S+)", trial.output)[1]
        other = browser.new_context().new_page()
        other.goto(f"http://{parts.netloc}/?token={token}")
        until(other, "window.updates > 3")
        assert other.is_hidden("#stop")
        status = "fetch('trip', {method: 'POST'}).then((answer) => answer.status)"
        assert other.evaluate(status) == 403
        assert trial.process.poll() is None
        other.context.close()


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


def test_a_session_is_tripped_from_the_page_and_goes_on_later(page, tmp_path):
    plan = plan_file(tmp_path, {"repeats": 2})
    place = ("--real-time", "--view", "--view-address", ANY_PORT)
    with serving(tmp_path, "session", str(plan), "--out", "day", *place) as session:
        page.goto(session.url)
        until(page, "state && state.run === 'sweep-2' && state.phase === 'exciting'")
        assert page.locator("#runs li").count() == 2
        page.click("#trip")
        page.click("#trip-now")
        assert session.wait() == 130
        assert "the same command goes on with sweep-2" in session.output
    assert load_toml(tmp_path / "day/runs/sweep-2/run.toml")["outcome"]["trip"] == "stopped"
