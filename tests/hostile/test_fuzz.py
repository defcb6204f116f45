"""A slice of the fuzzing target: `python -m tests.hostile.fuzz 2000 SEED` runs all of it."""

import re
import subprocess
import sys
import time
from random import Random

import pytest

from tests.hostile import fuzz_run
from tests.hostile.fuzz_commands import Case, Line
from tests.hostile.fuzz_mutations import damaged_file
from tests.hostile.fuzz_run import start, step
from tests.paths import ROOT, TRIALS

SEED = 20
CASES = 50
COMMAND = re.compile(r"^  (\S+)  .*: \d", re.MULTILINE)  # a row of the target's table
BALLAST = 300 << 20  # bytes


def test_hostile_input_ends_in_a_message(tmp_path):
    """The cases are forks of the target's own process: small, whatever pytest has loaded."""
    words = [str(1000 + CASES), str(SEED), "--first", "1000", "--quick", "--jobs", "2"]
    done = subprocess.run(
        [sys.executable, "-m", "tests.hostile.fuzz", *words, "--keep", str(tmp_path)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    print(done.stdout)
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"\n0 of {CASES} failed\n" in done.stdout
    assert set(COMMAND.findall(done.stdout)) >= {"trial", "import", "decode"}


@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # a process with threads forks
def test_memory_is_counted_from_the_fork(tmp_path, monkeypatch):
    """What the forking process holds is not the case's; what the case takes is, all of it."""
    ballast = bytearray(b"x" * BALLAST)
    taken = []
    for size in (0, BALLAST):
        monkeypatch.setattr(fuzz_run, "main", lambda size=size: bytearray(b"x" * size))
        running = start(Case([], Line(""), tmp_path, {}, ()), number=len(taken))
        while (end := step(running)) is None:
            time.sleep(0.01)
        taken.append(end.memory)
    assert taken[0] < 0.2 * len(ballast)
    assert taken[1] > 0.8 * BALLAST


def test_a_case_follows_from_its_seed_and_number(tmp_path):
    """Other cases before it change nothing: the pools of hostile values stay as they are."""
    good = (TRIALS / "throttle_sweep.toml").read_bytes()

    def drawn(number):
        return damaged_file(Random(f"{SEED}:{number}"), good, toml=True)

    first = [drawn(number) for number in range(100)]
    for number in range(100, 1000):
        drawn(number)
    assert [drawn(number) for number in range(100)] == first
