"""Laws of the loop: every tick is counted, whatever the clock or the bus does."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from slipbench.bench.gateway.gateway import PhaseChange
from slipbench.bench.loop.clock import MILLISECOND, SimulatedClock
from slipbench.bench.loop.loop import Lateness, run_periodic
from slipbench.bench.loop.ring import Ring
from slipbench.bench.loop.ticks import HEADER, TickTable, read_ticks, tick_recorder
from slipbench.bench.safety.trial import TrialState
from slipbench.bench.trials.outcome import Outcome, invalid
from slipbench.protocol.codec.messages import Phase
from slipbench.protocol.trial_file import Timing


class SlowTicks:
    """A simulated clock on which each tick takes a given time."""

    def __init__(self, durations):
        self.clock = SimulatedClock()
        self.durations = iter(durations)

    def now_ns(self):
        return self.clock.now_ns()

    def sleep_until_ns(self, deadline):
        self.clock.sleep_until_ns(deadline)

    def work(self):
        self.clock.sleep_until_ns(self.clock.now_ns() + next(self.durations, 0))


@given(st.lists(st.integers(0, 7 * MILLISECOND), max_size=60))
def test_every_tick_is_on_time_late_or_skipped_and_all_are_counted(durations):
    slow, told = SlowTicks(durations), []

    def tick(number, due):
        told.append((number, due, slow.now_ns()))
        slow.work()
        return True

    lateness = run_periodic(tick, MILLISECOND, slow, most=200)
    numbers = [number for number, _, _ in told]
    assert numbers == sorted(set(numbers))
    assert list(lateness.tick) == numbers
    assert lateness.due == lateness.skipped + len(numbers)
    for (number, due, began), late in zip(told, lateness.lateness, strict=True):
        assert due == lateness.start + number * MILLISECOND
        assert began - due == late
        assert 0 <= late < MILLISECOND


@given(st.dictionaries(st.integers(0, 40), st.integers(0, MILLISECOND - 1)))
def test_where_the_wait_ends_early_the_ticks_restart_and_all_are_counted(early):
    """Keys: ticks that are called before they are due; values: by how much, ns."""
    clock, dues = SimulatedClock(), []

    def wait(deadline):
        by = early.get(len(dues), 0)
        clock.sleep_until_ns(deadline - by)
        return by > 0

    lateness = run_periodic(
        lambda _, due: dues.append(due) or len(dues) <= 40, MILLISECOND, clock, wait=wait
    )
    assert lateness.tick.tolist() == list(range(41))
    assert not lateness.lateness.any()
    gaps = np.diff(dues)
    assert gaps.tolist() == [MILLISECOND - early.get(number, 0) for number in range(1, 41)]
    assert lateness.start + 40 * MILLISECOND == dues[-1]


def test_on_the_simulated_clock_nothing_is_ever_late():
    clock, times = SimulatedClock(), []
    lateness = run_periodic(
        lambda number, due: times.append(clock.now_ns() - due) or number < 99, MILLISECOND, clock
    )
    assert times == [0] * 100
    assert lateness.skipped == 0
    assert np.all(lateness.lateness == 0)


def test_the_world_is_advanced_over_all_of_the_simulated_time():
    lived = []
    clock = SimulatedClock(0, lived.append)
    run_periodic(lambda number, _due: number < 9, MILLISECOND, clock)
    assert lived == [MILLISECOND * (1 + k) for k in range(10)]


@given(
    st.lists(st.integers(0, 7 * MILLISECOND), max_size=60),
    st.integers(0, MILLISECOND),
    st.sets(st.integers(0, 199)),
)
def test_the_table_of_ticks_holds_every_tick_once_with_its_fate(tmp_path_factory, d, late, refuses):
    """refuses: ticks whose commands the bus refuses."""
    slow, ring, told = SlowTicks(d), Ring.local(), []

    def tick(number, _due):
        told.append(number)
        slow.work()
        return True

    lateness = run_periodic(
        tick, MILLISECOND, slow, 200, tick_recorder(ring), refused=lambda: told[-1] in refuses
    )
    assert lateness.refused.tolist() == [number in refuses for number in told]
    table = TickTable(MILLISECOND, late)
    text = HEADER + "".join(table.lines(slot) for slot in ring.drain())
    rows = [line.split(",") for line in text.splitlines()[1:]]
    assert [int(row[0]) for row in rows] == list(range(lateness.due))
    assert [int(row[1]) for row in rows] == [
        lateness.start + n * MILLISECOND for n in range(lateness.due)
    ]
    fates = [row[3] for row in rows]
    assert fates.count("skipped") == lateness.skipped
    assert fates.count("refused") == len(refuses.intersection(told))
    assert fates.count("late") == int(np.sum((lateness.lateness > late) & ~lateness.refused))
    path = tmp_path_factory.getbasetemp() / "ticks.csv"
    path.write_text(text + "99999,12")  # an incomplete last line
    again = read_ticks(path, MILLISECOND)
    assert again.start == lateness.start
    assert list(again.tick) == list(lateness.tick)
    assert list(again.lateness) == list(lateness.lateness)
    assert list(again.refused) == list(lateness.refused)


def test_a_full_ring_is_marked_as_failed_at_the_next_tick():
    ring = Ring.local(2)
    note = tick_recorder(ring)
    for number in range(3):
        assert not ring.failed
        note(number, number * MILLISECOND, 0, False)
    assert ring.failed


def judged(tick, lateness, timing, refused=()):
    """Why a trial that excites from tick 100 to tick 1100 is invalid."""
    start = 1_000_000_000
    changes = (
        PhaseChange(Phase.EXCITING, start + 100 * MILLISECOND),
        PhaseChange(Phase.DONE, start + 1100 * MILLISECOND),
    )
    ticks = Lateness(
        np.array(tick), np.array(lateness), MILLISECOND, start, np.isin(tick, list(refused))
    )
    return invalid(Outcome(TrialState(Phase.DONE), changes, ticks), timing)


SOME = st.sets(st.integers(0, 1199))


@given(SOME, SOME, SOME, st.integers(0, 1000))
def test_a_trial_is_invalid_when_over_its_budget_while_it_holds_authority(
    late, skipped, refused, budget
):
    ran = sorted(set(range(1200)) - skipped)
    lateness = [600_000 * (n in late) for n in ran]
    timing = Timing(budget=f"{budget / 100} %")
    why = judged(ran or [0], lateness or [0], timing, refused)
    held = range(100, 1100)
    bad = len((late | skipped | refused).intersection(held))
    assert bool(why) == (bad > timing.budget * 1000)


@given(st.integers(1, MILLISECOND - 1), st.integers(0, 8))
def test_restarted_ticks_are_checked_from_their_restart(early, late_ticks):
    """The press comes before tick 100; ticks 100 to 300 hold authority, some of them late."""
    clock, dues = SimulatedClock(), []

    def wait(deadline):
        late = 300_000 + 600_000 if 150 <= len(dues) < 150 + late_ticks else 0
        clock.sleep_until_ns(deadline - early * (len(dues) == 100) + late)
        return len(dues) == 100

    lateness = run_periodic(
        lambda _number, due: dues.append(due) or len(dues) <= 300, MILLISECOND, clock, wait=wait
    )
    changes = (PhaseChange(Phase.EXCITING, dues[100]), PhaseChange(Phase.DONE, dues[300]))
    why = invalid(Outcome(TrialState(Phase.DONE), changes, lateness), Timing(budget="0 %"))
    assert why.startswith(f"{late_ticks} ticks of 200 ") if late_ticks else why == ""
