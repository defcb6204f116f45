"""The floor is the part that trials do not repeat; lack of fit is the shared residual."""

from types import SimpleNamespace

import numpy as np
import pytest

from slipbench.identification.mismatch.fit.floor import (
    INNOVATIONS,
    PATTERN,
    REPEATED,
    floors,
    lack_of_fit,
    repeated,
)
from slipbench.identification.mismatch.fit.whitening import whitener
from slipbench.identification.mismatch.simulation.sampling import Grid
from slipbench.identification.mismatch.simulation.sensor import Sampled, tooth_sensors


def fit(shared, same_input=True):
    """Two recordings of one trial: residuals with a shared part beside noise of deviation 1."""
    rng = np.random.default_rng(6)
    common = shared * np.sin(np.arange(1000) * 0.2)[:, None]
    residual = [common + rng.standard_normal((1000, 1)) for _ in range(2)]
    command = np.sin(np.arange(5000) * 0.01)[:, None]
    inputs = [command, command if same_input else np.roll(command, 300)]
    records = tuple(
        SimpleNamespace(name=f"run {i}", inputs=u, grid=SimpleNamespace(stretches=3))
        for i, u in enumerate(inputs)
    )
    partition = SimpleNamespace(groups=(SimpleNamespace(order=4),))
    model = SimpleNamespace(records=records, partition=partition)
    return SimpleNamespace(model=model, residuals=[residual], noise=[whitener(residual, 4)])


def test_the_floor_of_repeated_trials_is_what_they_do_not_share():
    floor, source = floors(fit(shared=2.0), 0)
    assert source == REPEATED
    assert abs(floor[0] - 1.0) < 0.05


def test_without_repetition_the_floor_is_what_is_new_in_every_bin():
    one = fit(shared=2.0, same_input=False)
    floor, source = floors(one, 0)
    assert source == INNOVATIONS
    assert 0.95 < floor[0] < 0.8 * np.sqrt(np.mean(one.residuals[0][0] ** 2))


def test_lack_of_fit_is_seen_where_the_trials_share_something():
    assert lack_of_fit(fit(shared=2.0)).p_value < 1e-3
    assert lack_of_fit(fit(shared=0.0)).p_value > 1e-3
    assert lack_of_fit(fit(shared=2.0, same_input=False)) is None


def test_every_recording_is_in_one_pair_at_most():
    records = fit(1.0).model.records
    again = SimpleNamespace(**{**vars(records[0]), "name": "run 2"})
    assert list(repeated((*records, again))) == [(0, 1)]


@pytest.mark.parametrize("seconds", [2.4, 4.4, 13.4, 13.9, 14.4, 15.2])
def test_a_tooth_pattern_has_a_floor_whatever_the_length_of_the_recording(seconds):
    """Equal noise in every cell: its deviation is the floor, however many segments there are."""
    teeth, rng = 24, np.random.default_rng(8)
    print("seed 8")
    grid = Grid(round((seconds + 1.0) * 1e3), 1.0, round(seconds * 100), 0.01)
    passed = np.arange(0.0, seconds + 1.0, 2.5e-3)
    _, disc = tooth_sensors("rear", Sampled(passed, np.arange(passed.size), "ecu"), teeth, grid)
    record = SimpleNamespace(
        name="run", inputs=np.zeros((9, 1)), grid=grid, sensors={"rear_tooth_pattern": disc}
    )
    block = SimpleNamespace(order=0, outputs=("rear_tooth_pattern",))
    model = SimpleNamespace(records=(record,), partition=SimpleNamespace(groups=(block,)))
    residual = rng.standard_normal((disc.value.size, 1))
    floor, source = floors(SimpleNamespace(model=model, residuals=[[residual]], noise=[None]), 0)
    assert source == PATTERN
    rows = residual.reshape(-1, teeth)
    own = (
        np.sqrt(np.mean(residual**2))
        if len(rows) == 1
        else np.sqrt(rows.var(axis=0, ddof=1).mean())
    )
    assert floor == pytest.approx([own])
