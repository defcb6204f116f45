"""Laws of fault plans: which frames, which receivers, when, and reproducible."""

from collections import Counter
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slipbench.bench.bus.events import Delivery
from slipbench.bench.bus.faults import (
    Corrupted,
    Delayed,
    Disturbed,
    Duplicated,
    Fault,
    FaultPlan,
    Frozen,
    Lost,
    Reordered,
    Where,
)
from slipbench.bench.bus.frame import BitRates, Frame
from slipbench.bench.bus.plan_text import plan_text, read_plan
from slipbench.bench.bus.wire import Wire
from slipbench.protocol.errors import InputError

SECOND = 1_000_000_000
PERIOD = 1_000_000  # ns between two frames
COUNT = 400


def heard(*faults: Fault, seed: int = 1, count: int = COUNT) -> dict[str, list[Delivery]]:
    """Numbered frames, a millisecond apart, identifiers 1 and 2, as two listeners receive them."""
    wire = Wire(BitRates(), FaultPlan(faults, seed))
    sender, *listeners = (wire.attach(name) for name in ("sender", "one", "two"))
    events = []
    for number in range(count):
        events += wire.advance(number * PERIOD)
        wire.offer(Frame(1 + number % 2, number.to_bytes(4, "big")), sender, number * PERIOD)
    events += wire.advance(wire.now_ns + SECOND)
    return {
        node.name: [each for each in events if isinstance(each, Delivery) and each.node is node]
        for node in listeners
    }


def numbers(deliveries: list[Delivery]) -> list[int]:
    return [int.from_bytes(each.frame.data, "big") for each in deliveries]


WHOLE = heard()
KINDS: list[Fault] = [
    Disturbed(0.08),
    Lost(0.3),
    Corrupted(0.3),
    Duplicated(0.3),
    Delayed(0.3, 0.0025),
    Reordered(0.3),
    Frozen(Where(begin=0.1), 0.3),
]


def content(found: dict[str, list[Delivery]]) -> dict[str, list[tuple[int, Frame]]]:
    return {name: [(each.time_ns, each.frame) for each in found[name]] for name in found}


@pytest.mark.parametrize("fault", KINDS, ids=lambda fault: type(fault).__name__)
def test_a_plan_gives_the_same_faults_again_and_other_ones_with_another_seed(fault: Fault) -> None:
    once, again, other = heard(fault), heard(fault), heard(fault, seed=2)
    assert content(once) == content(again)
    assert content(once) != content(other)
    assert content(once) != content(WHOLE)


def outside(deliveries: list[Delivery]) -> list[Frame]:
    """Frames that arrived before 0.1 s, and those after all delayed ones from before 0.2 s."""
    late = 0.2e9 + 20 * PERIOD
    return [each.frame for each in deliveries if each.time_ns < 0.1e9 or each.time_ns > late]


@pytest.mark.parametrize("fault", KINDS, ids=lambda fault: type(fault).__name__)
def test_outside_its_window_a_fault_does_nothing(fault: Fault) -> None:
    window = replace(fault, where=Where(begin=0.1, end=0.2))
    found = heard(window)
    for name in found:
        assert outside(found[name]) == outside(WHOLE[name])
    assert content(found) != content(WHOLE)


@pytest.mark.parametrize("fault", KINDS[1:], ids=lambda fault: type(fault).__name__)
def test_a_fault_acts_only_on_the_receiver_and_the_identifier_it_names(fault: Fault) -> None:
    where = replace(fault.where, identifiers=frozenset({2}), receivers=frozenset({"two"}))
    found = heard(replace(fault, where=where))
    assert content({"one": found["one"]}) == content({"one": WHOLE["one"]})
    of_one = [each.frame for each in found["two"] if each.frame.identifier == 1]
    assert of_one == [each.frame for each in WHOLE["two"] if each.frame.identifier == 1]
    assert content(found) != content(WHOLE)


def test_a_fault_that_names_another_sender_does_nothing() -> None:
    assert content(heard(Lost(1.0, Where(senders={"somebody else"})))) == content(WHOLE)


@pytest.mark.parametrize("chance", [0.0, 0.1, 0.5, 1.0])
def test_a_fault_acts_as_often_as_its_chance_states(chance: float) -> None:
    """Four standard deviations of a binomial count; 800 independent draws."""
    found = heard(Lost(chance))
    lost = 2 * COUNT - sum(map(len, found.values()))
    assert abs(lost - 2 * COUNT * chance) <= 4 * (2 * COUNT * chance * (1 - chance)) ** 0.5
    if 0 < chance < 1:
        assert numbers(found["one"]) != numbers(found["two"])  # each receiver draws its own


def test_duplicates_are_equal_and_follow_each_other() -> None:
    found = numbers(heard(Duplicated(0.3))["one"])
    assert sorted(set(found)) == list(range(COUNT))
    assert found == sorted(found)
    assert set(Counter(found).values()) == {1, 2}


def test_reordered_frames_all_arrive_and_never_more_than_one_place_late_when_apart() -> None:
    found = numbers(heard(Reordered(0.2))["one"])
    assert sorted(found) == list(range(COUNT))
    assert found != sorted(found)


def test_a_frame_that_nothing_overtakes_arrives_after_all() -> None:
    [only] = heard(Reordered(1.0, at_most=0.005), count=1)["one"]
    assert only.time_ns == WHOLE["one"][0].time_ns + 5_000_000


def test_a_delay_delays_by_what_it_says_and_its_spread_reorders() -> None:
    found, spread = heard(Delayed(1.0, 0.0025)), heard(Delayed(1.0, 0.0, spread=0.01))
    assert [each.time_ns - 2_500_000 for each in found["one"]] == [
        each.time_ns for each in WHOLE["one"]
    ]
    assert sorted(numbers(spread["one"])) == list(range(COUNT))
    assert numbers(spread["one"]) != list(range(COUNT))


def test_corruption_inverts_one_bit_of_the_payload_and_nothing_else() -> None:
    for sent, got in zip(WHOLE["one"], heard(Corrupted(1.0))["one"], strict=True):
        wrong = int.from_bytes(sent.frame.data, "big") ^ int.from_bytes(got.frame.data, "big")
        assert wrong.bit_count() == 1
        assert got.frame._replace(data=b"") == sent.frame._replace(data=b"")


def test_what_is_frozen_repeats_the_last_payload_before() -> None:
    found = heard(Frozen(Where(begin=0.1, end=0.2, identifiers={1})))["one"]
    frozen = [
        number
        for number, each in zip(numbers(found), found, strict=True)
        if each.frame.identifier == 1 and 0.1e9 <= each.time_ns < 0.2e9
    ]
    assert len(frozen) == 50
    assert set(frozen) == {98}  # sent at 98 ms, the last even number before 100 ms


@given(st.integers(0, 2**63), st.lists(st.sampled_from(KINDS), max_size=4))
@settings(max_examples=50)
def test_a_plan_survives_its_text(seed: int, faults: list[Fault]) -> None:
    somewhere = Where(0.5, 2.0, frozenset({1, 0x1FFFFFFF}), frozenset({"a"}), frozenset({"b"}))
    plan = FaultPlan((*faults, *(replace(fault, where=somewhere) for fault in faults)), seed)
    assert read_plan(plan_text(plan)) == plan


@pytest.mark.parametrize(
    "fault",
    [
        Lost(1.1),
        Lost(-0.1),
        Lost(float("nan")),
        Delayed(1.0, float("inf")),
        Delayed(1.0, -1.0),
        Delayed(1.0, 0.0, float("nan")),
        Reordered(1.0, at_most=float("inf")),
    ],
    ids=str,
)
def test_what_cannot_happen_cannot_be_planned(fault: Fault) -> None:
    with pytest.raises(ValueError, match="is not between"):
        FaultPlan((fault,))


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "{}",
        '{"seed": 1, "faults": [{"fault": "bang"}]}',
        '{"seed": "x", "faults": []}',
        '{"seed": 1, "faults": [{"fault": "lost", "chance": 1, "colour": 2}]}',
        '{"seed": 1, "faults": [{"fault": "lost", "chance": 1, "where": {"senders": [1]}}]}',
        "[" * 100_000,
    ],
)
def test_what_is_no_plan_is_refused(text: str) -> None:
    with pytest.raises(InputError, match="not a fault plan"):
        read_plan(text)
