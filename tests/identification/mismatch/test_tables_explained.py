"""The command takes tables as they are, and gives the verdict of the imported recordings."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from slipbench.command import app

pytest.importorskip("pyarrow")
MODEL = """
name = "Motor"
step = "10 ms"
period = "10 ms"

[parameters]
gain = { value = 100, unit = "rpm/V", plus_minus = 20 }
time_constant = { value = 50, unit = "ms", plus_minus = 20 }

[inputs.command]
role = "command"
size = { value = 5, unit = "V" }

[states.speed]
rate = "(gain * command - speed) / time_constant"
size = { value = 500, unit = "rpm" }

[outputs.tacho]
role = "motor speed"
value = "speed"
size = { value = 500, unit = "rpm" }
"""


def table(path, seed, dead):
    """A motor that does not move below a voltage."""
    rng = np.random.default_rng(seed)
    time, command = 0.01 * np.arange(800), np.repeat(rng.uniform(-6, 6, 100), 8)
    kept, speed, lines = np.exp(-0.01 / 0.06), 0.0, ["time [s],command [V],motor speed [rpm]"]
    for t, u in zip(time, command, strict=True):
        lines.append(f"{t:.2f},{u:.4f},{speed + rng.normal(0, 2):.4f}")
        speed = kept * speed + (1 - kept) * 110 * (u - np.clip(u, -dead, dead))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return str(path)


@pytest.mark.parametrize("dead", [0.0, 1.0])
def test_a_dead_zone_in_tables_is_named(tmp_path, dead):
    (tmp_path / "motor.toml").write_text(MODEL, encoding="utf-8")
    one, two, three = (table(tmp_path / f"{k}.csv", k, dead) for k in (1, 2, 3))
    verdict_file = tmp_path / "verdict.json"
    arguments = ["--model", str(tmp_path / "motor.toml"), one, f"{two}@0:6", "--held-out", three]
    done = CliRunner().invoke(app, ["explain", *arguments, "--json", str(verdict_file)])
    assert done.exit_code == 0, done.output
    found = [e["name"] for e in json.loads(verdict_file.read_text(encoding="utf-8"))["effects"]]
    assert found == (["dead_zone"] if dead else [])


def test_a_column_without_a_unit_is_named_where_it_is_needed(tmp_path):
    (tmp_path / "motor.toml").write_text(MODEL, encoding="utf-8")
    path = tmp_path / "1.csv"
    table(path, 1, 0.0)
    path.write_text(path.read_text(encoding="utf-8").replace("command [V]", "command"))
    done = CliRunner().invoke(app, ["explain", "--model", str(tmp_path / "motor.toml"), str(path)])
    assert "no unit is stated" in str(done.exception)
