"""A browser, and the commands that serve a view, for tests of what users see."""

import os
import re
import shutil
import signal
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest

CHROMIUM = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
)
ANY_PORT = "127.0.0.1:0"
PATIENCE = 240_000  # ms; a busy machine starts a trial slowly
# Connections that nobody asked for fail in a closed network, and take the processor meanwhile.
ARGUMENTS = ["--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-sync"]
LEAST_PRIORITY = "19"
ADDRESS = re.compile(r"(?:view|may trip): (http://\S+)")


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    """Headless Chromium of the system, which takes no processor from a trial."""
    library = pytest.importorskip("playwright.sync_api", reason="pip install playwright")
    if CHROMIUM is None:
        pytest.skip("no Chromium: apt-get install chromium")
    with library.sync_playwright() as playwright:
        opened = playwright.chromium.launch(
            executable_path=launcher(tmp_path_factory.mktemp("browser")), args=ARGUMENTS
        )
        yield opened
        opened.close()


def launcher(folder: Path) -> Path:
    """Write a program that starts Chromium with the least priority, and return it."""
    path = folder / "chromium"
    path.write_text(f'#!/bin/sh\nexec nice -n {LEAST_PRIORITY} "{CHROMIUM}" "$@"\n')
    path.chmod(0o755)
    return path


@pytest.fixture
def page(browser):
    """A page as wide as a laptop's screen. An error of its script fails the test."""
    errors = []
    context = browser.new_context(viewport={"width": 1280, "height": 900})
    opened = context.new_page()
    opened.set_default_timeout(PATIENCE)
    opened.on("pageerror", lambda fault: errors.append(str(fault)))
    yield opened
    context.close()
    assert errors == []


class Command:
    """A running command and the address of its view."""

    def __init__(self, process, output):
        self.process, self._output, self.url = process, output, ""

    @property
    def output(self):
        return self._output.read_text()

    def wait(self):
        return self.process.wait(60)

    def interrupt(self):
        self.process.send_signal(signal.SIGINT)
        self.wait()


@contextmanager
def serving(folder: Path, *arguments: str, address: re.Pattern = ADDRESS):
    """Run a command of slipbench that serves a view or a stream, until the block ends.

    address: finds in its output where it serves
    """
    pytest.importorskip("starlette", reason="pip install 'slipbench[view]'")
    output = folder / f"output-{len(list(folder.glob('output-*')))}"
    with output.open("w") as file:
        process = subprocess.Popen(
            [sys.executable, "-m", "slipbench", *arguments],
            cwd=folder,
            stdout=file,
            stderr=subprocess.STDOUT,
            env={**os.environ, "PYTHONUNBUFFERED": "1"},
        )
    command = Command(process, output)
    try:
        while not (found := address.search(command.output)):
            assert process.poll() is None, command.output
            with_patience(process)
        command.url = found[1]
        yield command
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
        try:
            process.wait(60)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def with_patience(process):
    """Wait a moment for a process."""
    try:
        process.wait(0.1)
    except subprocess.TimeoutExpired:
        return


def until(page, condition):
    page.wait_for_function(f"() => {condition}", timeout=PATIENCE)


def until_phase(page, phase):
    until(page, f"document.getElementById('head').dataset.phase === '{phase}'")
