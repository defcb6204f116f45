"""Laws of every system of a model file, and of every effect in it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slipbench.identification.mismatch.analysis import begin
from slipbench.identification.mismatch.explain import analyse
from slipbench.identification.mismatch.reporting.conclude import verdict
from slipbench.identification.mismatch.runs import read_system
from slipbench.identification.mismatch.simulation.causal_partition import CausalPartition
from slipbench.identification.mismatch.simulation.piece import Piece
from slipbench.identification.mismatch.simulation.simulation_input import SimulationInput
from slipbench.identification.mismatch.systems.clock_search import best_shift
from slipbench.identification.mismatch.systems.effects.library import BY_NAME, LIBRARY
from slipbench.identification.mismatch.systems.expression import read_expression
from slipbench.plant.effects.effect import SECTIONS
from slipbench.plant.errors import PlantError
from slipbench.protocol.errors import InputError
from tests.identification.mismatch.spring import MODEL, recorded, system

CHAIN = CausalPartition({"system": ()}, ())


@pytest.fixture(scope="module")
def spring(tmp_path_factory):
    return system(tmp_path_factory.mktemp("spring"))


@pytest.fixture(scope="module")
def record(spring):
    return spring.prepare(recorded(7, seconds=4.0))


LAGGING = """
[states.current]
rate = "50 * (force - current)"
size = { value = 1, unit = "V" }

[states.wheel]
rate = "20 * force"
size = { value = 6, unit = "rad" }
"""


@pytest.fixture(scope="module")
def lagging(tmp_path_factory):
    """A spring whose force is a state, neither a speed nor its integral; and a turning wheel."""
    path = tmp_path_factory.mktemp("lagging") / "spring.toml"
    path.write_text(MODEL.replace("gain * force", "gain * current") + LAGGING, encoding="utf-8")
    return read_system(path)


@pytest.fixture(scope="module")
def settled(lagging):
    return lagging.prepare(recorded(7, seconds=4.0))


def shown(spring, record, *effects):
    there = spring.at([], np.zeros(0), effects)
    return there.simulate(SimulationInput.undisturbed(record, CHAIN, "system"))["place"]


def simulated_or_nan(spring, record, effect):
    """Simulated reading; NaN where the simulation is rejected, as for a repelling spring."""
    try:
        return shown(spring, record, effect)
    except PlantError:
        return np.full(record.grid.rows, np.nan)


def kinds(spring, name):
    return [k for k in spring.library if k.name == name]


@pytest.mark.parametrize("kind", LIBRARY, ids=lambda kind: kind.name)
def test_the_page_of_every_effect_is_complete(kind):
    page = kind.page()
    assert set(page) >= {"Title", "Physics", *SECTIONS}
    assert all(page[section] for section in SECTIONS)
    assert set(kind.confused_with) <= set(BY_NAME)
    assert any(p.sized for p in kind.parameters())


@pytest.mark.parametrize("name", list(BY_NAME))
def test_an_absent_effect_changes_nothing_and_a_typical_one_leaves_a_trace(lagging, settled, name):
    found = kinds(lagging, name)
    assert found, f"{name} acts nowhere in a system that has every kind of place"
    plain = shown(lagging, settled)
    for kind in found:
        absent = shown(lagging, settled, kind.absent())
        assert np.allclose(absent, plain, atol=1e-9 * np.abs(plain).max()), kind().key
    traces = [np.ptp(simulated_or_nan(lagging, settled, kind()) - plain) for kind in found]
    assert np.nanmax(traces) > 1e-4 * np.ptp(plain)


@pytest.mark.parametrize("name", list(BY_NAME))
def test_up_to_three_times_the_typical_size_it_is_finite_or_refused_in_words(
    lagging, settled, name
):
    for kind in kinds(lagging, name):
        for share in (0.3, 3.0):
            values = {}
            for p in kind.parameters():
                sized = p.sized and np.isfinite(p.absent)
                requested = p.absent + share * (p.typical - p.absent) if sized else p.typical
                values[p.name] = min(max(requested, p.low), p.high)
            simulated_place = simulated_or_nan(lagging, settled, kind(**values))
            assert np.isfinite(simulated_place).all() or np.isnan(simulated_place).all()


def test_a_quarter_of_the_step_gives_the_same(spring, record, tmp_path):
    path = tmp_path / "fine.toml"
    path.write_text(MODEL.replace('step = "5 ms"', 'step = "1.25 ms"'), encoding="utf-8")
    fine = shown(read_system(path), record)
    assert np.allclose(shown(spring, record), fine, atol=1e-5 * np.ptp(fine))


def test_what_is_written_reads_back_as_the_same_system(spring, record, tmp_path):
    kind = next(k for k in kinds(spring, "cubic") if k.place.name == "deflection")
    there = spring.at([], np.zeros(0), (kind(cube=0.3),)).as_improved(spring.plus_minus)
    path = tmp_path / "improved.toml"
    path.write_text(there.text(), encoding="utf-8")
    again = read_system(path)
    assert np.allclose(shown(again, record), shown(spring, record, kind(cube=0.3)))


@pytest.mark.parametrize(
    "text", ["__import__('os')", "x.y", "[x]", "lambda: x", "open('f')", "x if", "'a'", "z", "x@x"]
)
def test_an_equation_holds_arithmetic_alone(text):
    with pytest.raises(InputError):
        read_expression(text, ["x"], "somewhere")


def test_a_hardening_spring_is_named_and_its_size_told(spring):
    runs = [spring.prepare(recorded(seed, cube=0.15, seconds=10.0)) for seed in (21, 22)]
    kind_names = ("cubic", "saturation", "quadratic")
    library = [k for k in spring.library if k.name in kind_names and k.place.name == "deflection"]
    found = verdict(analyse(begin(spring, runs[:1], runs[1:]), library))
    assert ("cubic", "deflection") in [(e.name, e.subject) for e in found.effects]
    cube = next(e for e in found.effects if e.name == "cubic").parameters[0]
    assert cube.low - 0.02 < 0.15 < cube.high + 0.02
    assert found.held_out[0].improved < 0.2 * found.held_out[0].nominal


@pytest.mark.parametrize("ahead", [-1.3, 0.0, 17.25])
def test_a_clock_that_was_never_set_is_found_to_a_row(ahead):
    rng = np.random.default_rng(3)
    step, rows = 0.05, 400
    true = np.convolve(rng.standard_normal(3000), np.ones(20), "same")
    at = step * np.arange(3000)
    begin_at = 40.0
    inside = (at > begin_at) & (at <= begin_at + rows * step + 1e-9)
    offset, similarity = best_shift(step, true[inside][:rows], at + ahead, true)
    assert abs(offset - (begin_at + ahead)) < 1.5 * step
    assert similarity > 0.99


def test_pieces_of_one_run_meet_where_they_share_time():
    first, second, unbounded = (Piece.of(Path(f"run{p}")) for p in ("@0:60", "@60:", ""))
    assert not first.meets(second)
    assert first.meets(unbounded)
    with pytest.raises(InputError, match="not a segment"):
        Piece.of(Path("run@60:0"))


def test_a_smooth_input_is_followed_between_its_samples(tmp_path):
    source = recorded(11, seconds=2.0)
    force = source.channels["force"]
    swings = replace(force, value=np.sin(2 * np.pi * 11.0 * force.time))  # 9 samples a period
    errors = {}
    for word in ("held = false", "smooth = true"):
        path = tmp_path / "spring.toml"
        path.write_text(MODEL.replace('role = "force"', f'role = "force"\n{word}'), "utf-8")
        finer = path.read_text("utf-8").replace('period = "10 ms"', 'period = "20 ms"')
        path.write_text(finer, "utf-8")
        record = read_system(path).prepare(
            replace(source, channels={**source.channels, "force": swings})
        )
        inner = slice(50, -50)
        middle = 0.5 * (record.time[1:] + record.time[:-1]) + record.start
        between = 0.5 * (record.inputs[1:, 0] + record.inputs[:-1, 0])
        errors[word] = np.abs(between - np.sin(2 * np.pi * 11.0 * middle))[inner].max()
    lines, smooth = errors.values()
    assert lines > 0.04
    assert smooth < 0.1 * lines


def test_a_state_that_starts_from_an_output_without_a_record_is_named(tmp_path):
    other = '[outputs.second]\nrole = "second"\nvalue = "velocity"\nsize = { value = 1, unit = "m/s" }\n'
    text = MODEL.replace("[states.velocity]", '[states.velocity]\nstart = "second"') + other
    (tmp_path / "two.toml").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match="'velocity' starts from an output that was not recorded"):
        type(system(tmp_path)).load(tmp_path / "two.toml").prepare(recorded(7, seconds=4.0))
