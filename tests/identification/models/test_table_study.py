"""A model of columns: the truth comes back, unseen runs are predicted, bad tables are refused."""

import numpy as np
import pytest
from scipy import signal
from typer.testing import CliRunner

from slipbench import command
from slipbench.identification.models.output_error import output_error
from slipbench.identification.models.stable_rational import Order
from slipbench.identification.models.table_study import outside, read_run, table_study
from slipbench.protocol.errors import InputError
from tests.recordings import recording

RATE, W, Z = 200.0, 2 * np.pi * 3.0, 0.1
T = np.arange(0, 8, 1 / RATE)
SWEEP = np.sin(2 * np.pi * (0.2 * T + 0.5 * T**2)) * (T < 7)
STEP = (T > 0.5) * 2.0
LATE = 3  # samples


def system(u):
    """A resonance of 3 Hz behind 15 ms."""
    b, a, _ = signal.cont2discrete(([W**2], [1, 2 * Z * W, W**2]), 1 / RATE, "zoh")
    return np.roll(signal.lfilter(b[0], a, u), LATE) * (np.arange(u.size) >= LATE)


def table(path, u, seed, noise=0.02):
    y = 5.0 + system(u) + noise * np.random.default_rng(seed).standard_normal(u.size)
    lines = [f"{t:.4f},{a:.6f},{b:.6f}" for t, a, b in zip(T, u, y, strict=True)]
    path.write_text("time [s],u,y\n" + "\n".join(lines) + "\n", encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    folder = tmp_path_factory.mktemp("tables")
    runs = [read_run(table(folder / f"s{k}.csv", SWEEP, k), "u", "y") for k in range(4)]
    unseen = [read_run(table(folder / "step.csv", STEP, 9), "u", "y")]
    return table_study(runs, unseen, ("u", "y"))


def test_the_truth_comes_back_though_the_runs_are_short_and_still_ring(study):
    model = study.found.model
    assert study.found.fit.order == Order(2, 0)
    assert abs(model.poles[0]) == pytest.approx(W, rel=0.003)
    assert -model.poles[0].real / W == pytest.approx(Z, rel=0.03)
    assert model.delay == pytest.approx(LATE / RATE, abs=5e-4)


def test_the_measured_response_holds_the_truth_in_its_band(study):
    found = study.response
    s = 2j * np.pi * found.frequency
    # An input that is held and read at its samples: the discrete system is the truth.
    z = np.exp(s / RATE)
    b, a, _ = signal.cont2discrete(([W**2], [1, 2 * Z * W, W**2]), 1 / RATE, "zoh")
    truth = np.polyval(b[0], z) / np.polyval(a, z) * z**-LATE
    inside = np.abs(np.abs(found.value) - np.abs(truth)) < found.gain_band + 0.01 * np.abs(truth)
    assert np.mean(inside) > 0.9


def test_an_unseen_step_is_predicted_down_to_its_noise(study):
    assert study.unseen[0].error == pytest.approx(0.02, rel=0.25)
    assert study.unseen[0].fit > 95


def test_it_is_said_how_much_of_an_unseen_input_the_runs_do_not_excite(study):
    assert outside(np.sin(2 * np.pi * 3 * T), RATE, (1.0, 5.0)) < 0.01
    assert outside(np.sin(2 * np.pi * 8 * T), RATE, (1.0, 5.0)) > 0.99
    assert study.beyond[0] > 0.5  # a step is mostly its steady part
    assert any("step (9" in sentence for sentence in study.words), study.words


def test_runs_that_do_not_repeat_give_a_model_and_say_why_no_response(tmp_path):
    runs = [
        read_run(table(tmp_path / f"{k}.csv", (k + 1.0) * SWEEP, k), "u", "y") for k in range(2)
    ]
    found = table_study(runs, [], ("u", "y"))
    assert found.response is None
    assert any("do not repeat" in sentence for sentence in found.words)
    assert abs(found.found.model.poles[0]) == pytest.approx(W, rel=0.005)


def test_an_input_that_stands_still_is_refused(tmp_path):
    run = read_run(table(tmp_path / "still.csv", 0 * T, 1), "u", "y")
    with pytest.raises(InputError, match="stands still"):
        table_study([run], [], ("u", "y"))


def test_uneven_samples_and_few_of_them_are_refused(tmp_path):
    path = table(tmp_path / "a.csv", SWEEP, 1)
    lines = path.read_text().splitlines()
    path.write_text("\n".join(lines[:500] + lines[700:]))
    with pytest.raises(InputError, match="evenly"):
        read_run(path, "u", "y")
    path.write_text("\n".join(lines[:100]))
    with pytest.raises(InputError, match="too few"):
        read_run(path, "u", "y")


def test_a_column_that_is_not_there_is_named(tmp_path):
    with pytest.raises(InputError, match="no column"):
        read_run(table(tmp_path / "a.csv", SWEEP, 1), "v", "y")


def test_the_flexible_link_is_modelled_by_the_command(tmp_path):
    folder = recording("flexible_link")
    sweeps = sorted(str(path) for path in folder.glob("swept*.txt"))
    unseen = [
        x
        for p in sorted(folder.glob("[sf]*[123]*.txt"))
        if "swept" not in p.name
        for x in ("--held-out", str(p))
    ]
    told = CliRunner().invoke(
        command.app,
        [
            "model",
            *sweeps,
            "--input",
            "u",
            "--output",
            r"$\theta$",
            *unseen,
            "--out",
            str(tmp_path),
        ],
    )
    assert told.exit_code == 0, told.output
    fits = {
        line.split()[0]: float(line.split()[4])
        for line in told.output.splitlines()
        if line.startswith("  ") and " held-out " in line
    }
    assert len(fits) == 6
    # Sweeps swing by 50, steps by 100, where the drive saturates: what is left there is curvature.
    assert all(fits[f"step{k}"] > 75 for k in (1, 2, 3))
    assert all(fits[f"fixed{k}-5hz"] > 88 for k in (1, 2, 3))
    page = (tmp_path / "model.html").read_text(encoding="utf-8")
    assert "coherence" in page
    assert "Held-out runs" in page


def test_what_comes_to_rest_under_a_steady_input_is_not_given_a_steady_gain():
    b, a, _ = signal.cont2discrete(([W, 0], [1, 2 * Z * W, W**2]), 1 / RATE, "zoh")
    u = np.sin(2 * np.pi * (T + 0.5 * T**2)) * (T < 7)  # nothing slow
    tried = (Order(2, 1), Order(2, 2))
    for steady, held in ((0.0, 1), (1.0, 0)):
        y = signal.lfilter(np.polyadd(b[0], steady * a), a, u)
        y = y + 0.02 * np.random.default_rng(3).standard_normal(u.size) * (T > 0)
        found = output_error(u[None], y[None], RATE, (0.8, 8.0), ("u", "y"), tried)
        assert found.fit.order.at_rest == held, found.fit.order
        gain = found.model.response(np.array([1e-6]))[0].real
        assert gain == pytest.approx(steady, abs=0.05 if steady else 1e-3)


@pytest.mark.parametrize("column", ["u", "y"])
@pytest.mark.parametrize("value", ["-1e300", "1e31"])
def test_a_value_that_nothing_measures_is_named(tmp_path, column, value):
    rows = [[f"{0.02 * n:.2f}", "1", "2"] for n in range(400)]
    rows[50][1 + "uy".index(column)] = value
    table = tmp_path / "run.csv"
    table.write_text("time,u,y\n" + "".join(",".join(row) + "\n" for row in rows))
    with pytest.raises(InputError, match=rf"column '{column}' is too large[^$]*at 1 s"):
        read_run(table, "u", "y")
