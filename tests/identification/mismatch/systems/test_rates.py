"""Channels at irregular times, and of several rates, are taken at their own instants."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import linalg

from slipbench.identification.mismatch.analysis import begin
from slipbench.identification.mismatch.explain import analyse
from slipbench.identification.mismatch.fit.calibrate import calibrate
from slipbench.identification.mismatch.reporting.conclude import verdict
from slipbench.identification.mismatch.systems.model_file import DrivenInput, ModelFile
from slipbench.identification.mismatch.systems.record import _held, prepare
from slipbench.plant.signals import Floats
from slipbench.protocol.recording.channel import Channel
from slipbench.protocol.recording.recording import Recording
from slipbench.protocol.recording.role_map import RoleMap, Source
from tests.identification.mismatch.laws.spring import DAMPING, FREQUENCY, GAIN, spring
from tests.identification.mismatch.systems.test_delays import LATE

SECONDS, FINE, DEAD_TIME = 20.0, 2e-4, 0.023
UNITS = {"force": "V", "place": "m", "speed": "m/s"}
ROLES = RoleMap(
    title="spring", quantities=UNITS, roles={role: Source(column=role) for role in UNITS}
)
TWO = f"""{LATE}
[outputs.quick]
role = "speed"
value = "velocity"
size = {{ value = 10, unit = "m/s" }}
"""


def regular(rate: float) -> Floats:
    """Times of samples, s. rate: 1/s."""
    return np.arange(0.0, SECONDS, 1.0 / rate)


def jittered(rate: float) -> Floats:
    """Times that are late by up to 80 % of a period, s."""
    return regular(rate) + 0.8 / rate * np.random.default_rng(1).random(regular(rate).size)


def on_change(rate: float) -> Floats:
    """Times at random, s; the first is 0."""
    drawn = np.random.default_rng(2).uniform(0.0, SECONDS, int(rate * SECONDS))
    return np.sort(np.append(drawn, (0.0, SECONDS)))


def recorded(force: Floats, place: Floats, speed: Floats, seed: int = 5) -> Recording:
    """Record a spring at these times, s: it is driven by the recorded force of 23 ms before."""
    print(f"seed {seed}")
    rng = np.random.default_rng(seed)
    renewed = rng.random(force.size) < 200.0 / force.size
    recorded_values = rng.standard_normal(force.size)[
        np.maximum.accumulate(renewed * np.arange(force.size))
    ]
    recorded_values -= recorded_values[0]
    time = FINE * np.arange(round(SECONDS / FINE) + 1)
    late = np.searchsorted(force, time - DEAD_TIME + 1e-9, side="right") - 1
    acting = recorded_values[np.maximum(late, 0)]
    a = np.array([[0.0, 1.0], [-(FREQUENCY**2), -2.0 * DAMPING * FREQUENCY]])
    both = np.block([[a, np.array([[0.0], [GAIN]])], [np.zeros((1, 3))]])
    step = linalg.expm(FINE * both)[:2]
    x = np.zeros((time.size, 2))
    for k in range(time.size - 1):
        x[k + 1] = step[:, :2] @ x[k] + step[:, 2] * acting[k]
    values = {"force": (force, recorded_values)}
    for j, (role, at, noise) in enumerate((("place", place, 2e-3), ("speed", speed, 0.05))):
        shown = np.interp(at, time, x[:, j]) + noise * rng.standard_normal(at.size)
        values[role] = (at, shown)
    channels = {r: Channel(r, t, v, UNITS[r], "bus", "made") for r, (t, v) in values.items()}
    return Recording(Path("spring"), {}, None, ROLES, channels, {})


def calibrated(folder: Path, ridden: Recording) -> dict[str, float]:
    """Parameters by name, SI."""
    system = spring(folder, TWO)
    analysis = begin(system, [system.prepare(ridden)], [])
    fit = calibrate(analysis.training, analysis.training.origin())
    return {c.name: c.at(float(x)) for c, x in zip(fit.model.known, fit.point.x, strict=True)}


@pytest.mark.parametrize(
    ("times", "rate"),
    [(regular, 100), (regular, 30), (jittered, 100), (jittered, 20), (on_change, 20)],
)
def test_a_held_input_is_not_late_whatever_its_times(
    tmp_path: Path, times: Callable[[float], Floats], rate: float
) -> None:
    """Regression: values at the start of a row were up to 10 ms late; dead time was 18 ms."""
    found = calibrated(tmp_path, recorded(times(rate), regular(100), regular(100)))
    assert found["dead_time"] == pytest.approx(DEAD_TIME, abs=0.3e-3)
    assert found["gain"] == pytest.approx(GAIN, rel=1.5e-3)


@pytest.mark.parametrize(
    ("place", "speed"),
    [(regular(100), regular(10)), (regular(10), regular(100)), (jittered(100), jittered(33))],
)
def test_outputs_have_rates_and_times_of_their_own(
    tmp_path: Path, place: Floats, speed: Floats
) -> None:
    found = calibrated(tmp_path, recorded(regular(100), place, speed))
    assert found["dead_time"] == pytest.approx(DEAD_TIME, abs=0.2e-3)
    assert found["frequency"] == pytest.approx(FREQUENCY, rel=1e-3)
    assert found["gain"] == pytest.approx(GAIN, rel=1.5e-3)


@pytest.mark.parametrize(
    ("force", "place", "step"),
    [
        (regular(100), regular(100), 0.01),
        (regular(100), regular(50), 0.01),
        (regular(100) + 0.013, regular(100) + 0.013, 0.01),
        (regular(30), regular(100), 0.005),
        (regular(100), jittered(100), 0.005),
        (regular(100), regular(100) + 0.004, 0.005),
    ],
)
def test_rows_are_steps_of_integration_where_samples_fall_within_rows(
    tmp_path: Path, force: Floats, place: Floats, step: float
) -> None:
    record = spring(tmp_path, LATE).prepare(recorded(force, place, regular(100)))
    assert record.grid.step == pytest.approx(step)


def test_a_right_model_lacks_nothing_whatever_the_rates(tmp_path: Path) -> None:
    """With rows of the input, 33 ms, a leak from the force was named with hundreds of nats."""
    wide = TWO.replace('period = "10 ms"', 'period = "100 ms"')
    system = spring(tmp_path, wide.replace('step = "5 ms"', 'step = "2 ms"'))
    kinds = ("leak_from_channel", "elastic_transmission", "lag", "scale")
    library = [kind for kind in system.library if kind.name in kinds]
    runs = [
        system.prepare(recorded(regular(30), regular(100), regular(10), seed)) for seed in (6, 7)
    ]
    found = verdict(analyse(begin(system, runs[:1], runs[1:]), library))
    assert [effect.name for effect in found.effects] == []


@given(
    times=st.lists(st.floats(0.0, 5.0), min_size=1, max_size=30, unique=True),
    step=st.sampled_from((0.01, 0.1, 0.35)),
)
def test_rows_of_a_held_input_have_its_area(times: list[float], step: float) -> None:
    """Except for values recorded within a thousandth of a row of its begin or end."""
    sampled = np.sort(np.array([0.0, *times]))
    values = np.random.default_rng(3).standard_normal(sampled.size)
    ends = step * np.arange(1, round(6.0 / step) + 1)
    rows = _held(sampled, values, ends, step)
    area = np.sum(values * np.diff(np.append(sampled, ends[-1])))
    slack = 2e-3 * step * 2.0 * np.abs(values).max() * sampled.size
    assert abs(step * rows.sum() - area) <= slack + 1e-9


def test_a_held_input_that_is_told_where_rows_begin_keeps_its_values() -> None:
    sampled = 12.3 + 0.01 * np.arange(500)
    values = np.random.default_rng(4).standard_normal(500)
    ends = 12.3 + 0.01 * np.arange(1, 501)
    assert np.array_equal(_held(sampled, values, ends, 0.01), values)


def test_an_exact_input_has_no_values_between_its_own(tmp_path: Path) -> None:
    file = spring(tmp_path, TWO).file
    recorded_values = DrivenInput(role="force", size=file.inputs["force"].size, exact=True)
    exact: ModelFile = file.model_copy(update={"inputs": {"force": recorded_values}})
    ridden = recorded(jittered(20), regular(100), regular(100))
    values = ridden.channels["force"].value
    assert np.isin(prepare(ridden, exact).inputs, values).all()
    assert not np.isin(prepare(ridden, file).inputs, values).all()


def test_an_output_that_is_slower_than_the_period_is_told(tmp_path: Path) -> None:
    slow = recorded(regular(100), regular(100), regular(10))
    (note,) = spring(tmp_path, TWO).prepare(slow).notes
    assert note == (
        "quick is sampled every 0.1 s, and period = 0.01 s: intervals are too narrow by about 3.2;"
        " period is that of the slowest output"
    )
    wide = TWO.replace('period = "10 ms"', 'period = "100 ms"')
    assert spring(tmp_path, wide).prepare(slow).notes == ()
    missing = replace(slow, channels={r: c for r, c in slow.channels.items() if r != "speed"})
    assert spring(tmp_path, TWO).prepare(missing).notes == ()
