"""Two senders of one message are found by their counters; one sender never is, whatever is lost."""

import random

import pytest

from slipbench.bench.gateway.sender_monitor import SenderMonitor

CYCLE = 0.001  # s
NAME = "EcuStatus"


def found_after(counters, at=None):
    """Time (s) from the first of these frames until two senders are suspected; None: they are not.

    at: when each came; every cycle where it is None.
    """
    senders = SenderMonitor({NAME: CYCLE})
    for number, counter in enumerate(counters):
        now = 1e9 + (number * CYCLE if at is None else at[number])
        senders.heard(NAME, now, counter % 15)
        if senders.trouble:
            assert NAME in senders.trouble
            return now - 1e9
    return None


@pytest.mark.parametrize("offset", range(15))
def test_two_vehicles_are_found_within_ten_cycles_however_their_counters_stand(offset):
    both = [number for n in range(1000) for number in (n, n + offset)]
    at = [CYCLE * n for n in range(1000) for _ in range(2)]
    found = found_after(both, at=at)
    assert found is not None
    assert found <= 10 * CYCLE


def test_a_bus_that_repeats_every_frame_is_found_within_ten_cycles():
    found = found_after([n // 2 for n in range(40)], at=[CYCLE * n / 2 for n in range(40)])
    assert found is not None
    assert found <= 10 * CYCLE


@pytest.mark.parametrize("kept", [0.99, 0.8, 0.5, 0.3])
def test_one_sender_of_whose_frames_many_are_lost_is_one_sender(kept):
    seed = 41
    print("seed", seed)
    draw = random.Random(seed)
    numbers = [n for n in range(60_000) if draw.random() < kept]
    assert found_after(numbers, at=[CYCLE * n for n in numbers]) is None


def test_one_sender_that_catches_up_on_a_stall_is_one_sender():
    """Fifty frames at once, of which its controller had room for every third."""
    numbers = [*range(100), *range(100, 150, 3), *range(150, 400)]
    assert found_after(numbers, at=[CYCLE * max(n, 150) for n in numbers]) is None


@pytest.mark.parametrize("repeated", [0.001, 0.003])
def test_a_frame_that_is_repeated_now_and_then_is_no_second_sender(repeated):
    seed = 42
    print("seed", seed)
    draw = random.Random(seed)
    numbers = [n for n in range(60_000) for _ in range(1 + (draw.random() < repeated))]
    assert found_after(numbers, at=[CYCLE * n for n in numbers]) is None


def test_frames_that_overtake_each_other_now_and_then_are_no_second_sender():
    numbers = list(range(60_000))
    for place in range(0, len(numbers) - 1, 20):
        numbers[place], numbers[place + 1] = numbers[place + 1], numbers[place]
    assert found_after(numbers) is None


def test_what_was_heard_before_a_backlog_is_forgotten():
    senders = SenderMonitor({NAME: CYCLE})
    for _ in range(3):
        for _ in range(3):
            senders.heard(NAME, 1.0, 7)
        senders.forget()
    assert senders.trouble == ""


@pytest.mark.parametrize(
    ("counters", "found"),
    [
        ([0, 0, 1, 1, 2, 2, 3], False),  # three are out of turn: what follows each is in turn
        ([0, 0, 1, 1, 2, 2, 3, 3], True),
        ([0, 5, 1, 6, 2], False),  # 1, 6 and 2 go on from the frame before the last
        ([0, 5, 1, 6, 2, 7], True),
        ([0, 2, 4, 6, 8, 10, 12, 14, 1], False),  # lost frames leave gaps
        ([13, 14, 0, 1, 2, 3], False),
    ],
)
def test_four_frames_out_of_turn_at_once_are_a_second_sender(counters, found):
    assert (found_after([0], at=[0.0]), found_after(counters, at=[0.0] * len(counters))) == (
        None,
        0.0 if found else None,
    )


def test_of_the_frames_out_of_turn_half_as_many_as_are_due_go_by():
    """A repeated frame in two cycles is forgiven for ever, two in three cycles are not."""
    some = [n for n in range(0, 400, 2) for n in (n, n, n + 1)]
    assert found_after(some, at=[CYCLE * n for n in some]) is None
    many = [n for n in range(0, 400, 3) for n in (n, n, n + 1, n + 1, n + 2)]
    assert found_after(many, at=[CYCLE * n for n in many]) is not None


def test_frames_are_counted_in_windows_of_half_a_second():
    """Half as many again as are due, and two more; the window ends before its last moment."""
    cycle, most = 0.0625, 14  # exact in binary: 1.5 * 0.5 s / 62.5 ms + 2
    for last, found in ((0.499, True), (0.5, False)):
        senders = SenderMonitor({NAME: cycle})
        for number in range(most):
            senders.heard(NAME, number / 32)
            assert senders.trouble == ""
        senders.heard(NAME, last)
        assert (senders.trouble != "") == found
    for number in range(most - 1):  # the window that began at 0.5 s
        senders.heard(NAME, 0.75 + number / 128)
    assert senders.trouble == ""
    senders.heard(NAME, 0.99)
    assert "more often" in senders.trouble


def test_after_a_backlog_the_frames_of_its_window_do_not_count():
    senders = SenderMonitor({NAME: 0.0625})
    for _ in range(10):
        senders.heard(NAME, 1.0)
    senders.forget()
    for _ in range(14):
        senders.heard(NAME, 1.25)
    assert senders.trouble == ""
    senders.heard(NAME, 1.25)
    assert senders.trouble != ""


def test_a_message_without_a_counter_is_found_by_the_number_of_its_frames():
    senders = SenderMonitor({NAME: CYCLE})
    for number in range(2000):
        senders.heard(NAME, 1e9 + number * CYCLE / 2)
        if senders.trouble:
            break
    assert "more often" in senders.trouble
    assert number * CYCLE / 2 <= 0.5
