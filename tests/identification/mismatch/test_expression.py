"""An equation of any size is parsed or rejected; an added term applies to the full equation."""

import numpy as np
import pytest

from slipbench.identification.mismatch.runs import read_system
from slipbench.identification.mismatch.simulation.causal_partition import CausalPartition
from slipbench.identification.mismatch.simulation.simulation_input import SimulationInput
from slipbench.identification.mismatch.systems.expression import DEEPEST, read_expression
from slipbench.protocol.errors import InputError
from tests.identification.mismatch.spring import MODEL, recorded

CHAIN = CausalPartition({"system": ()}, ())
TOO_LARGE = {
    "9" * 310: "number of an equation is too large",
    "9" * 999: "number of an equation is too large",
    "0x" + "f" * 400: "number of an equation is too large",
    "1e999": "number of an equation is too large",
    "+".join("x" * 450): "too many nested operations",
    "-" * 900 + "x": "too many nested operations",
    "(" * 450 + "x" + ")" * 450: "too many nested operations",
    "sin(" * 150 + "x" + ")" * 150: "too many nested operations",
    "x**" * 300 + "x": "too many nested operations",
    "x" * 1001: "too long",
}


@pytest.mark.parametrize("text", TOO_LARGE, ids=lambda t: f"{t[:8]}x{len(t)}")
def test_an_equation_beyond_the_limits_is_refused_in_words(text):
    with pytest.raises(InputError, match=TOO_LARGE[text]):
        read_expression(text, ["x"], "model.toml: states.x.rate")


@pytest.mark.parametrize(
    "text", ["+".join("x" * DEEPEST), "-" * DEEPEST + "x", "sin(" * 60 + "x" + ")" * 60]
)
def test_an_equation_within_the_limits_is_read(text):
    assert read_expression(text, ["x"], "somewhere").names == {"x"}


@pytest.mark.parametrize("equation", ["1 if position < 1e9 else 5", "position - position >= 0"])
def test_a_disturbance_is_added_to_the_value_of_the_whole_equation(equation, tmp_path):
    """f = 1 whichever branch holds, so f + 1 = 2."""
    path = tmp_path / "spring.toml"
    path.write_text(MODEL.replace('value = "position"', f'value = "{equation}"', 1), "utf-8")
    spring = read_system(path)
    record = spring.prepare(recorded(7, seconds=1.0))
    quiet, added = np.zeros(record.slow.shape[1]), {"deflection": np.ones(record.grid.rows)}
    plain, disturbed = (
        spring.simulate(SimulationInput(record, CHAIN, "system", quiet, a)) for a in ({}, added)
    )
    assert np.allclose(plain["deflection"], 1.0)
    assert np.allclose(disturbed["deflection"], 2.0)
