"""Whatever frames come, in whatever order, at whatever time: nothing moves that must not.

The laws are in judge.py; `make million` lives through a million sequences of other seeds.
"""

import pytest

from slipbench.bench.gateway import gateway as gateway_module
from slipbench.bench.safety import permit as permit_module
from slipbench.bench.safety import trial as trial_module
from slipbench.bench.safety.permit import permit
from tests.bench.safety.sequences import batch, kept
from tests.bench.safety.world import beginnings, use_binding

SEED, SIZE = 20_000, 1_500


@pytest.fixture(autouse=True)
def own_database():
    yield
    use_binding(0)


@pytest.mark.parametrize("seed", [SEED, SEED + 1], ids=["own database", "drawn database"])
def test_no_sequence_of_frames_moves_an_actuator_against_the_laws(seed):
    print(f"seed {seed}, {SIZE} sequences")
    tally = batch(seed, SIZE)
    assert tally.sequences >= SIZE
    print(tally)
    assert tally.held > SIZE  # there was something to judge
    reasons = {
        "brake",
        "clutch",
        "gear",
        "engine_speed",
        "speed",
        "slip",
        "front_wheel",
        "faulty",
        "timing",
        "throttle_fault",
        "grip_opened",
        "button_released",
    }
    assert reasons <= set(tally.endings)
    assert "done" in tally.endings


@pytest.mark.parametrize(
    "check", ["_timing", "_links", "_rider", "_grip", "_motion", "_throttle", "_spark"]
)
def test_the_judge_finds_a_gate_that_lacks_a_check(check, monkeypatch):
    """What `_granted` finds moves nothing: without the devices' grant a command is only words."""
    monkeypatch.setattr(permit_module, check, lambda *_: None)
    if check in ("_throttle", "_spark"):
        jump_to_the_limit(monkeypatch)
    with pytest.raises(AssertionError):
        batch(SEED, 10 * SIZE)


def jump_to_the_limit(monkeypatch):
    """A trial that asks for too much: only the gate stands before the bus."""
    beginnings()  # made before the trial asks for too much, or none would come as far as settling
    asked = trial_module.requested_command

    def greedy(state, plan, now, offsets=None):
        command = asked(state, plan, now, offsets)
        return type(command)(command.authority, 3 * command.throttle, 5 * command.spark, now)

    monkeypatch.setattr(gateway_module, "requested_command", greedy)


@pytest.mark.parametrize("seed", [1, 2])
def test_a_trial_that_asks_for_too_much_is_stopped_by_the_gate(seed, monkeypatch):
    jump_to_the_limit(monkeypatch)
    ended = batch(SEED + seed, 300).endings
    assert ended["amplitude"] + ended["range"] + ended["rate"] > 0


def test_the_gate_is_asked_about_every_command_with_authority(monkeypatch):
    """A gateway that asks and does not listen is found out."""
    monkeypatch.setattr(gateway_module, "permit", lambda command, *_: command)
    with pytest.raises(AssertionError):
        batch(SEED, SIZE)
    assert permit is not gateway_module.permit


def test_a_batch_that_was_lived_through_is_not_again(tmp_path, monkeypatch):
    first = kept(tmp_path, SEED, 40)
    monkeypatch.setattr("tests.bench.safety.sequences.batch", None)
    assert kept(tmp_path, SEED, 40) == first
    assert first.sequences >= 40
    assert sum(first.endings.values()) == first.sequences
