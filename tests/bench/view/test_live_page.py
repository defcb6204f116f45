"""What a user sees of a trial in real time: the page in headless Chromium."""

import re
from contextlib import contextmanager, suppress
from subprocess import TimeoutExpired
from urllib.parse import urlsplit

import pytest

from slipbench.protocol.configuration import load_toml
from tests.bench.session.plans import EXCITATION, plan_file, trial_file
from tests.bench.view.conftest import ANY_PORT, serving, until, until_phase
from tests.bench.view.recordings import short_trial

LONG = "60 s"  # a busy machine shows a page slowly, and the trial has to last until it is tripped
PATIENT = {"stale": "50 ms"}  # the most that a trial allows: these tests are of the page
PHASE = "document.getElementById('head').dataset.phase"
EXCITING = f"{PHASE} === 'exciting'"
# What a trial says when the machine kept its processes from running in real time.
LATE = re.compile(r"tripped: (.*(?:silent for|grants NONE|late|stood still).*)")


def live_trial(folder, duration=LONG, *options):
    rider = {"presses_button_after": "500 ms"}
    path = short_trial(folder, duration, rider=rider, limits=PATIENT)
    run = folder / "run"
    address = () if "--view-address" in options else ("--view-address", ANY_PORT)
    options = ("--real-time", "--view", *address, *options)
    return serving(folder, "trial", str(path), "--out", str(run), *options)


@contextmanager
def in_real_time(command):
    """Run a block with a trial. Skips where this machine cannot run the trial in real time."""
    try:
        yield command
    except Exception as fault:
        with suppress(TimeoutExpired):  # a trial that was tripped ends, and says why
            command.wait()
        if late := LATE.search(command.output):
            pytest.skip(f"this machine runs no trial in real time: {late[1]}")
        raise AssertionError(command.output) from fault


def until_shown(page, condition, run="true"):
    """Wait for what a page shows while a trial excites. run: whether the page shows this trial."""
    until(page, f"({condition}) || (({run}) && ['tripped', 'done'].includes({PHASE}))")
    assert page.evaluate(condition)


def test_it_opens_updates_survives_a_reload_and_trips(page, tmp_path):
    with live_trial(tmp_path) as trial, in_real_time(trial):
        page.goto(trial.url)
        until_shown(page, EXCITING)
        until_shown(page, "window.updates > 60")
        assert re.fullmatch(r"\d{5}", page.text_content("#rpm"))
        assert page.text_content("#gear") == "2"
        assert page.locator("#limits > :visible").count() >= 10
        before = page.evaluate("data[0][0]")
        page.reload()
        until_shown(page, "window.updates > 3")
        assert page.evaluate("data[0][0]") == before  # the samples from before the reload
        drawn = "document.querySelector('#chart-slip canvas').toDataURL()"
        first = page.evaluate(drawn)
        until_shown(page, f"{drawn} !== '{first}'")
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
    with live_trial(tmp_path, LONG, "--view-address", "0.0.0.0:0") as trial:
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


def test_a_session_is_tripped_from_the_page_and_goes_on_later(page, tmp_path):
    short = {"file": trial_file(tmp_path, limits=PATIENT)}
    long = {**short, "name": "long", "excitation": {**EXCITATION, "duration": LONG}}
    plan = plan_file(tmp_path, short, long)
    place = ("--real-time", "--view", "--view-address", ANY_PORT)
    serving_day = serving(tmp_path, "session", str(plan), "--out", "day", *place)
    with serving_day as session, in_real_time(session):
        page.goto(session.url)
        second = "state && state.run === 'long-1'"
        until_shown(page, f"{second} && {EXCITING}", second)
        assert page.locator("#runs li").count() == 2
        page.click("#trip")
        page.click("#trip-now")
        assert session.wait() == 130
        assert "the same command goes on with long-1" in session.output
    assert load_toml(tmp_path / "day/runs/long-1/run.toml")["outcome"]["trip"] == "stopped"
