"""A slice of the fuzzing target: `python -m tests.hostile.fuzz 2000 SEED` runs all of it."""

import pytest

from tests.hostile.fuzz import fuzz, in_a_line, warm_up
from tests.hostile.fuzz_commands import QUICK

SEED = 20
CASES = 150


@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # a process with threads forks
def test_hostile_input_ends_in_a_message(tmp_path):
    print(f"seed {SEED}")
    warm_up()
    ended = fuzz(range(1000, 1000 + CASES), SEED, tmp_path, jobs=2, lines=QUICK)
    assert len(ended) == CASES
    assert {end.running.case.line.argv.split()[0] for end in ended} >= {"trial", "import", "decode"}
    assert [in_a_line(end, SEED) for end in ended if end.wrong] == []
