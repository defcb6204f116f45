"""What is told of a trial's end: nothing drops out without a word."""

from hypothesis import given
from hypothesis import strategies as st

from slipbench.bench.trials.outcome import in_short

notes = st.lists(st.sampled_from([f"note {n}" for n in range(12)]), max_size=40)


@given(notes, st.integers(1, 10))
def test_every_note_is_shown_once_or_counted_as_not_shown(said: list[str], most: int) -> None:
    told = in_short(said, most)
    kinds = list(dict.fromkeys(said))
    shown = [line.split(" (")[0] for line in told if not line.startswith("and ")]
    assert shown == kinds[:most]
    left = [line for line in told if line.startswith("and ")]
    assert left == ([f"and {len(kinds) - most} others, in run.toml"] if kinds[most:] else [])


@given(notes)
def test_how_often_a_note_came_is_told(said: list[str]) -> None:
    for line in in_short(said, 100):
        note, _, times = line.partition(" (")
        assert said.count(note) == int(times.split()[0] if times else 1)


def test_what_a_bus_refuses_a_hundred_times_does_not_hide_what_the_recorder_says() -> None:
    assert in_short(["refused"] * 100 + ["the disk is full"]) == [
        "refused (100 times)",
        "the disk is full",
    ]
