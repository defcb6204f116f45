"""A slice of the fuzzing target: `python -m tests.hostile.fuzz 2000 SEED` runs all of it."""

from random import Random

import pytest

from tests.hostile.fuzz import fuzz, in_a_line, warm_up
from tests.hostile.fuzz_commands import QUICK
from tests.hostile.fuzz_mutations import damaged_file
from tests.paths import TRIALS

SEED = 20
CASES = 50


@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # a process with threads forks
def test_hostile_input_ends_in_a_message(tmp_path):
    print(f"seed {SEED}")
    warm_up()
    ended = fuzz(range(1000, 1000 + CASES), SEED, tmp_path, jobs=2, lines=QUICK)
    assert len(ended) == CASES
    assert {end.running.case.line.argv.split()[0] for end in ended} >= {"trial", "import", "decode"}
    assert [in_a_line(end, SEED) for end in ended if end.wrong] == []


def test_a_case_follows_from_its_seed_and_number(tmp_path):
    """Other cases before it change nothing: the pools of hostile values stay as they are."""
    good = (TRIALS / "throttle_sweep.toml").read_bytes()

    def drawn(number):
        return damaged_file(Random(f"{SEED}:{number}"), good, toml=True)

    first = [drawn(number) for number in range(100)]
    for number in range(100, 1000):
        drawn(number)
    assert [drawn(number) for number in range(100)] == first
