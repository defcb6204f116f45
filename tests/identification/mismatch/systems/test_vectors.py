"""A model file with vectors is equivalent to a file with their elements as scalars."""

import tomllib
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from slipbench.identification.mismatch.simulation.record import Record
from slipbench.identification.mismatch.simulation.sampling import Grid
from slipbench.identification.mismatch.systems.equations import equations
from slipbench.identification.mismatch.systems.kernel import kernel_text
from slipbench.identification.mismatch.systems.model_file import ModelFile, load_model_file
from slipbench.identification.mismatch.systems.run import run
from slipbench.identification.mismatch.systems.system import ModelSystem
from slipbench.identification.mismatch.systems.vectors.element import MOST_ELEMENTS
from slipbench.identification.mismatch.systems.vectors.expansion import without_vectors
from slipbench.plant.signals import Floats
from slipbench.protocol.configuration import load_toml, parse
from slipbench.protocol.errors import InputError
from tests.paths import MODELS

HEAD = 'name = "Two arms"\nstep = "5 ms"\nperiod = "10 ms"\n'
TWO = (
    HEAD
    + """
[parameters]
stiffness = { value = [[200, -100], [-90, 200]], unit = "1/s^2", plus_minus = 20 }
loss = { value = [2, 3], unit = "1/s", plus_minus = [1, 0] }
stop = { value = [80, 90], unit = "deg", plus_minus = 4 }
dead_time = { value = 20, unit = "ms", plus_minus = 5 }

[inputs.torque]
role = ["torque_a", "torque_b"]
size = { value = [1, 2], unit = "1/s^2" }
held = [true, false]

[inputs.tilt]
role = "tilt"
size = { value = 0.1, unit = "rad" }

[seams.pull]
value = "stiffness @ (angle - tilt)"
size = { value = 90, unit = "1/s^2" }
along = "speed"

[states.angle]
length = 2
rate = "speed"
size = { value = 40, unit = "deg" }
start = "shown"
low = [{ value = -70, unit = "deg" }, { value = -80, unit = "deg" }]
high = "stop"
restitution = [0, 0.5]

[states.speed]
length = 2
rate = "delay(torque, dead_time) - pull - loss * speed"
size = { value = [3, 4], unit = "rad/s" }
start = { value = [0.1, 0.2], unit = "rad/s" }
first = { value = 0.5, unit = "rad/s" }

[outputs.shown]
role = ["angle_a", "angle_b"]
value = "angle"
size = { value = 40, unit = "deg" }
latency = ["1 ms", "2 ms"]

[outputs.both]
role = "sum_of_angles"
value = "sum(angle) - speed[1] * dead_time"
size = { value = 40, unit = "deg" }
"""
)
BY_HAND = (
    HEAD
    + """
[parameters]
stiffness_1_1 = { value = 200, unit = "1/s^2", plus_minus = 20 }
stiffness_1_2 = { value = -100, unit = "1/s^2", plus_minus = 20 }
stiffness_2_1 = { value = -90, unit = "1/s^2", plus_minus = 20 }
stiffness_2_2 = { value = 200, unit = "1/s^2", plus_minus = 20 }
loss_1 = { value = 2, unit = "1/s", plus_minus = 1 }
loss_2 = { value = 3, unit = "1/s", plus_minus = 0 }
stop_1 = { value = 80, unit = "deg", plus_minus = 4 }
stop_2 = { value = 90, unit = "deg", plus_minus = 4 }
dead_time = { value = 20, unit = "ms", plus_minus = 5 }

[inputs]
torque_1 = { role = "torque_a", size = { value = 1, unit = "1/s^2" }, held = true }
torque_2 = { role = "torque_b", size = { value = 2, unit = "1/s^2" }, held = false }
tilt = { role = "tilt", size = { value = 0.1, unit = "rad" } }

[seams.pull_1]
value = "stiffness_1_1 * (angle_1 - tilt) + stiffness_1_2 * (angle_2 - tilt)"
size = { value = 90, unit = "1/s^2" }
along = "speed_1"

[seams.pull_2]
value = "stiffness_2_1 * (angle_1 - tilt) + stiffness_2_2 * (angle_2 - tilt)"
size = { value = 90, unit = "1/s^2" }
along = "speed_2"

[states.angle_1]
rate = "speed_1"
size = { value = 40, unit = "deg" }
start = "shown_1"
low = { value = -70, unit = "deg" }
high = "stop_1"
restitution = 0

[states.angle_2]
rate = "speed_2"
size = { value = 40, unit = "deg" }
start = "shown_2"
low = { value = -80, unit = "deg" }
high = "stop_2"
restitution = 0.5

[states.speed_1]
rate = "delay(torque_1, dead_time) - pull_1 - loss_1 * speed_1"
size = { value = 3, unit = "rad/s" }
start = { value = 0.1, unit = "rad/s" }
first = { value = 0.5, unit = "rad/s" }

[states.speed_2]
rate = "delay(torque_2, dead_time) - pull_2 - loss_2 * speed_2"
size = { value = 4, unit = "rad/s" }
start = { value = 0.2, unit = "rad/s" }
first = { value = 0.5, unit = "rad/s" }

[outputs]
shown_1 = { role = "angle_a", value = "angle_1", size = { value = 40, unit = "deg" }, latency = "1 ms" }
shown_2 = { role = "angle_b", value = "angle_2", size = { value = 40, unit = "deg" }, latency = "2 ms" }

[outputs.both]
role = "sum_of_angles"
value = "angle_1 + angle_2 - speed_1 * dead_time"
size = { value = 40, unit = "deg" }
"""
)
WITHOUT_VECTORS = [path for path in MODELS.glob("*.toml") if path.stem != "three_carts"]


def read(text: str) -> ModelFile:
    return ModelFile.model_validate(without_vectors(tomllib.loads(text), "arms.toml"))


def written(folder: Path, text: str) -> Path:
    path = folder / "arms.toml"
    path.write_text(text, encoding="utf-8")
    return path


def shown(file: ModelFile, inputs: Floats, start: Floats) -> dict[str, Floats]:
    """Run a model file from these states, with steps of 5 ms in rows of 10 ms."""
    read = equations(file, "test")
    tree = file.model_dump()
    for state, x in zip(tree["states"].values(), start, strict=True):
        state["start"] = {"value": float(x)}
    values = np.array([number.si for number in file.parameters.values()])
    rows = len(inputs)
    grid = Grid(rows, 0.0, rows, file.period, file.period)
    record = Record("test", 0.0, grid, inputs, {}, {}, np.zeros((rows, 0)))
    zero_input = np.zeros((rows, len(read.places)))
    return run(read, ModelFile.model_validate(tree), values, (), record, zero_input)


def test_vectors_are_the_file_that_is_written_by_hand() -> None:
    file, by_hand = read(TWO), read(BY_HAND)
    assert file == by_hand
    assert [*file.parameters] == [*by_hand.parameters]
    assert [*file.states] == [*by_hand.states]
    ours, theirs = (kernel_text(equations(f, "arms.toml"), "effects") for f in (file, by_hand))
    assert ours == theirs


@pytest.mark.parametrize("path", WITHOUT_VECTORS, ids=lambda path: path.stem)
def test_a_file_of_numbers_stays_as_it_is(path: Path) -> None:
    tree = load_toml(path)
    assert without_vectors(tree, path.name) == tree


def test_the_simulation_is_the_matrix_exponential() -> None:
    """x' = A x + B u with u held: x after a period is exp(A T) x + A^-1 (exp(A T) - 1) B u."""
    matrix = np.array([[-2.0, 1.0, 0.5], [0.0, -3.0, 2.0], [-1.0, 0.5, -1.5]])
    gain = np.array([[1.0, 0.0], [0.5, -1.0], [0.0, 2.0]])
    file = read(
        HEAD
        + f"""
parameters.matrix = {{ value = {matrix.tolist()}, unit = "1/s" }}
parameters.gain = {{ value = {gain.tolist()}, unit = "1/s" }}
inputs.u = {{ role = ["a", "b"], size = {{ value = 1 }} }}
states.x = {{ length = 3, rate = "matrix @ x + gain @ u", size = {{ value = 1 }} }}
outputs.y = {{ role = ["c", "d"], value = "transpose(gain) @ x", size = {{ value = 1 }} }}
"""
    )
    print("seed 4")
    rng = np.random.default_rng(4)
    x, u = rng.standard_normal(3), rng.standard_normal((50, 2))
    found = shown(file, u, x)
    ahead = expm(matrix * file.period)
    driven = np.linalg.solve(matrix, ahead - np.eye(3)) @ gain
    for k, now in enumerate(u):
        x = ahead @ x + driven @ now
        y = [found[f"y_{i}"][k] for i in (1, 2)]
        assert np.allclose(y, gain.T @ x, rtol=0.0, atol=1e-7)


def test_an_element_is_named_where_units_do_not_agree(tmp_path: Path) -> None:
    assert ModelSystem.load(written(tmp_path, TWO)).notes == ()
    wrong = TWO.replace('size = { value = [3, 4], unit = "rad/s" }', "size = { value = [3, 4] }")
    notes = ModelSystem.load(written(tmp_path, wrong)).notes
    assert any("arms.toml: states.speed_2.rate: units do not agree" in note for note in notes)


def test_effects_act_at_elements(tmp_path: Path) -> None:
    text = TWO + '\n[[effects]]\nname = "friction"\nat = "pull_2"\n'
    (found,) = ModelSystem.load(written(tmp_path, text)).effects
    assert (found.place.name, found.place.other) == ("pull_2", "speed_2")


def test_an_effect_that_was_found_is_written_at_its_element(tmp_path: Path) -> None:
    system = ModelSystem.load(written(tmp_path, TWO))
    kind = next(k for k in system.library if k().key == "friction.speed_1_rate/speed_1")
    improved = system.at([], np.zeros(0), (kind(force=0.4),))
    (found,) = ModelSystem.load(written(tmp_path, improved.text())).effects
    assert found.key == "friction.speed_1_rate/speed_1"
    assert found.force == pytest.approx(0.4)


CALIBRATED = TWO.replace(
    "stiffness = { value = [[200, -100], [-90, 200]],",
    "# measured\nstiffness = { value = [\n  [200, -100], # near\n  [-90, 200],  # far\n],",
)


def test_half_widths_that_differ_become_a_list(tmp_path: Path) -> None:
    text = CALIBRATED.replace(', unit = "deg", plus_minus = 4 }', ', unit = "deg" }')
    again = ModelSystem.load(written(tmp_path, text)).text()
    assert 'stop = { value = [80, 90], unit = "deg", plus_minus = [4.0, 4.5]' in again


def test_an_improved_file_has_its_numbers_in_the_lists(tmp_path: Path) -> None:
    system = ModelSystem.load(written(tmp_path, CALIBRATED))
    assert system.text() == CALIBRATED
    known = system.coordinates([], None)
    x = np.linspace(-0.5, 0.5, len(known))
    other = system.at(known, x, ()).as_improved({k: 0.9 * v for k, v in system.plus_minus.items()})
    text = other.text()
    assert "# measured\nstiffness = { value = [\n  [" in text
    assert "], # near\n" in text
    again = ModelSystem.load(written(tmp_path, text))
    assert [*again.file.parameters] == [*system.file.parameters]
    assert np.allclose(again.values, other.values, rtol=1e-8)
    assert not np.allclose(again.values, system.values, rtol=1e-3)
    assert again.plus_minus == pytest.approx(dict(other.plus_minus), rel=1e-3)
    assert again.file.states == system.file.states


def replaced(old: str, new: str) -> str:
    assert old in TWO
    return TWO.replace(old, new, 1)


@pytest.mark.parametrize(
    ("old", "new", "where", "expected", "found"),
    [
        ('rate = "speed"', 'rate = "[1, 2, 3]"', "states.angle.rate", "2 elements", "3 elements in [1"),
        ('rate = "speed"', 'rate = "stiffness"', "states.angle.rate", "2 elements", "2 x 2"),
        ('value = "angle"', 'value = "angle[1]"', "outputs.shown.value", "2 elements", "1 number"),
        ('value = "sum(angle)', 'value = "angle', "outputs.both.value", "1 number", "2 elements in"),
        ('["angle_a", "angle_b"]', '"angle_a"', "outputs.shown.value", "1 number", "2 elements"),
        ('length = 2\nrate = "d', 'rate = "d', "outputs.both.value", "1 index", "1 number in speed"),
        ("[0.1, 0.2]", "[0.1, 0.2, 0.3]", "states.speed.start.value", "2 elements", "3 elements"),
        ("[1, 0]", "[1, 0, 3]", "parameters.loss.plus_minus", "2 elements", "3 elements"),
        ("[true, false]", "[true]", "inputs.torque.held", "2 elements", "1 element"),
        ('role = "tilt"', 'role = "tilt"\nlatency = ["1 s"]', "inputs.tilt.latency", "1 number", "1 el"),
        ('high = "stop"', 'high = "stiffness"', "states.angle.high", "2 elements", "2 x 2 elements"),
        ("value = [1, 2]", "value = [1, 2, 3]", "inputs.torque.size.value", "2 elements", "3 elements"),
        ("length = 2\nrate", "length = 0\nrate", "states.angle.length", "", "0"),
        ("length = 2\nrate", "length = true\nrate", "states.angle.length", "", "True"),
        ("length = 2\nrate", "length = 201\nrate", "states.angle.length", "at most 200", "201"),
        ("[[200, -100], [-90, 200]]", "[[200, -100], [-90]]", "parameters.stiffness.value", "same len", ""),
        ("[[200, -100], [-90, 200]]", "[]", "parameters.stiffness.value", "rows", "[]"),
        ("[[200, -100], [-90, 200]]", "[[[1]]]", "parameters.stiffness.value", "rows", "[[[1]]]"),
        ("[2, 3]", f"{[1] * 201}", "parameters.loss.value", "at most 200", "201"),
    ],
)  # fmt: skip
def test_a_vector_that_does_not_fit_is_refused(tmp_path, old, new, where, expected, found) -> None:
    with pytest.raises(InputError) as refused:
        load_model_file(written(tmp_path, replaced(old, new)))
    assert refused.value.where == f"arms.toml: {where}"
    assert expected in refused.value.expected
    assert found in refused.value.found


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("dead_time = {", "stop_1 = {", "'stop_1' is defined twice"),
        ("dead_time = {", "speed = {", "'speed' is defined twice"),
        (
            "dead_time = {",
            "stiffness_1 = { value = [1, 2] }\ndead_time = {",
            "'stiffness_1_1' is defined",
        ),
        ("[inputs.tilt]", "[inputs.angle_2]", "'angle_2' is defined twice"),
        ("dead_time = {", "max = { value = [1, 2] }\ndead_time = {", "'max' is defined twice"),
        ("[[200, -100]", "[['a', -100]", "parameters.stiffness_1_1.value = 'a'"),
        ("length = 2", "lenght = 2", "1 number"),
        ('along = "speed"', 'along = "speeed"', "seams.pull_1.along = 'speeed' does not exist"),
        ("loss * speed", "loss * sped", "'sped' is not known here"),
        ("loss * speed", "loss * speed_3", "'speed_3' is not known here"),
    ],
)
def test_names_and_entries_of_vectors_are_checked(tmp_path, old, new, said) -> None:
    path = written(tmp_path, replaced(old, new))
    with pytest.raises(InputError, match=said.replace(".", r"\.")):
        ModelSystem.load(path)


def test_all_states_together_have_a_limit() -> None:
    half = MOST_ELEMENTS // 2
    states = "".join(
        f'states.{n} = {{ length = {half}, rate = "0", size = {{ value = 1 }} }}\n' for n in "abc"
    )
    with pytest.raises(InputError, match=r"states: too many elements(.|\n)*200(.|\n)*300"):
        without_vectors(tomllib.loads(HEAD + states), "many.toml")


ANYTHING = st.recursive(
    st.sampled_from([0, 1, 2, -3.5, True, "", "angle", "speed_1", "loss", "pull[1] @ loss", "a b"]),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(st.sampled_from(["value", "unit", "angle", "rate", "a-b"]), inner, max_size=2)
    ),
    max_leaves=6,
)  # fmt: skip


def tables(tree: Any) -> Iterator[Any]:
    """Yield every table and list of a file with something in it."""
    if isinstance(tree, dict | list) and tree:
        yield tree
        for inner in tree.values() if isinstance(tree, dict) else tree:
            yield from tables(inner)


@given(st.data())
def test_any_other_file_is_read_or_refused_in_words(data: st.DataObject) -> None:
    tree = tomllib.loads(TWO)
    for _ in range(data.draw(st.integers(1, 3))):
        table = data.draw(st.sampled_from([*tables(tree)]))
        keys = [*table] if isinstance(table, dict) else [*range(len(table))]
        table[data.draw(st.sampled_from(keys))] = data.draw(ANYTHING)
    with suppress(InputError):
        ModelSystem.of(
            parse(without_vectors(tree, "arms.toml"), ModelFile, "arms.toml"), "arms.toml"
        )
