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


def test_a_message_without_a_counter_is_found_by_the_number_of_its_frames():
    senders = SenderMonitor({NAME: CYCLE})
    for number in range(2000):
        senders.heard(NAME, 1e9 + number * CYCLE / 2)
        if senders.trouble:
            break
    assert "more often" in senders.trouble
    assert number * CYCLE / 2 <= 0.5
