"""Laws of the page of a day: each step is on it with its duration, no place of a machine is."""

import re

import pytest

from slipbench.protocol.errors import InputError
from slipbench.studies.day.document import PICTURES, TEXT, WIDEST, document
from slipbench.studies.day.transcript import NAME, kept, steps

LINES = [
    line
    for name in TEXT
    for line in (
        f"$ slipbench {name} /some/where/day.toml --out x",
        f"made /a/b/{name}.html",
        "# 61 s",
    )
]


def test_a_transcript_keeps_what_is_said_and_gives_the_steps_back(tmp_path):
    said = []
    say = kept(tmp_path, said.append)
    for line in LINES:
        say(line)
    assert said == LINES
    found = steps((tmp_path / NAME).read_text())
    assert [(step.name, step.seconds) for step in found] == [(name, 61) for name in TEXT]
    assert [step.lines for step in found] == [(f"made /a/b/{name}.html",) for name in TEXT]


def test_the_page_has_each_step_and_its_pictures_and_no_folder_of_a_machine():
    long = "$ slipbench plan x\n" + 300 * "y" + "\n# 1 s\n"
    page = document(steps("\n".join(LINES[3:]) + "\n" + long))
    for name, text in TEXT.items():
        assert text in page
        assert f"$ slipbench {name}" in page
    assert all(f"figures/{name}.png" in page for rows in PICTURES.values() for name, _ in rows)
    assert not re.search(r"/some/|/a/b", page)
    console = re.findall(r"```console\n(.*?)```", page, re.DOTALL)
    assert max(len(line) for part in console for line in part.splitlines()) <= WIDEST
    assert "took 4 minutes" in page


def test_a_day_that_stopped_has_no_page():
    with pytest.raises(InputError, match="did not come to its end"):
        document(steps("\n".join(LINES[:-1])))
