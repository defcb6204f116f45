"""Laws of the selection: every trial trains, what is held out trains nothing, repeats are left out."""

from hypothesis import given
from hypothesis import strategies as st

from slipbench.identification.session.day import Run
from slipbench.identification.session.selection import HELD_OUT, TRAINING, selection

TRIALS = {"throttle": "throttle", "steps": "throttle", "spark": "spark", "mixed": "spark"}
LOOKS = st.fixed_dictionaries(
    {
        "counts": st.booleans(),
        "covered": st.floats(0.0, 1.0),
        "coherence": st.one_of(st.none(), st.floats(0.0, 1.0)),
    }
)


def runs_of(rows: list[tuple[str, dict]]) -> list[Run]:
    return [
        Run(trial, f"{trial}-{n}", {**look, "actuator": TRIALS[trial]})
        for n, (trial, look) in enumerate(rows)
    ]


ROWS = st.lists(st.tuples(st.sampled_from(sorted(TRIALS)), LOOKS), max_size=16).map(runs_of)


@given(ROWS)
def test_each_usable_run_has_one_part_and_each_trial_trains(runs):
    found = selection(runs)
    parts = [one.run for one in (*found.training, *found.held_out)] + list(found.others)
    usable = [run for run in runs if run.usable]
    assert sorted(run.name for run in parts) == sorted(run.name for run in usable)
    assert {one.run.trial for one in found.training} == {run.trial for run in usable}
    assert len(found.training) <= max(TRAINING, len({run.trial for run in usable}))
    assert len(found.held_out) <= HELD_OUT


@given(ROWS)
def test_what_is_held_out_is_the_last_repeat_and_of_different_actuators_where_there_are(runs):
    found = selection(runs)
    usable = [run for run in runs if run.usable]
    repeated = {r.trial for r in usable if sum(o.trial == r.trial for o in usable) > 1}
    for one in found.held_out:
        assert one.run is [run for run in usable if run.trial == one.run.trial][-1]
        assert one.run.trial in repeated
    wanted = min(len({TRIALS[trial] for trial in repeated}), HELD_OUT)
    assert len({one.run.look["actuator"] for one in found.held_out}) == wanted


def test_the_best_runs_train_and_the_lines_say_why():
    rows = [("throttle", {"counts": True, "covered": c, "coherence": 0.9}) for c in (0.5, 1, 0.9)]
    rows += [("throttle", {"counts": True, "covered": 0.1, "coherence": 1.0})] * 4
    found = selection(runs_of(rows))
    best = ["throttle-1", "throttle-2", "throttle-0"]
    assert [one.run.name for one in found.training] == best[:TRAINING]
    assert found.lines[0].startswith("throttle-1: training: excites the throttle")
    assert found.lines[-1].startswith("not used: further repeats")
