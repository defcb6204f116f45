"""A recording of another machine than a motorcycle: its report has its own signals, units and nothing else."""

import re
from html import unescape

import numpy as np
import pytest
import typer
from scipy.signal import lfilter
from typer.testing import CliRunner

from slipbench.identification.commands import register, studied, summary, write_report
from slipbench.identification.models.roots import oscillating, real_poles
from slipbench.identification.report.report import interactive
from slipbench.identification.response.from_folder import identified
from slipbench.identification.response.selection import Selection
from slipbench.identification.session.run_verdict import run_verdict
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.from_arrays import recording_of
from slipbench.protocol.recording.table_recording import read_recording

FOREIGN = (
    *(
        "slip",
        "motorcycle",
        "rider",
        "throttle",
        "spark",
        "gear",
        "wheel",
        "axle",
        "tyre",
        "engine",
    ),
    *(
        "ECU",
        "trial",
        "frames",
        "bus",
        "tick",
        "combustion",
        "wind",
        "road",
        "driveline",
        "controller",
    ),
)
"""Words of the motorcycle and its bench that say nothing about a servo or an oven."""
MACHINES = {
    "servo": ("time [s],command [V],motor speed [rad/s]", 0.01, 0.05, 10.0, 0.0, 6.0),
    "oven": ("time [s],heater power [W],plate temperature [degC]", 1.0, 5.0, 0.08, 22.0, 300.0),
    "drone": ("time [s],command [%],motor speed [rpm]", 0.005, 0.06, 160.0, 0.0, 15.0),
    "valve": ("time [s],command [1],opening [1]", 0.01, 0.05, 0.9, 0.0, 0.4),
}
"""Title, sample period (s), time constant (s), gain, offset and amplitude of each machine."""


def table(folder, name, seed=1, lag=None, **changed):
    """Path of the table of a machine: a first order system under a sweep from 2 to 200 % of its pole."""
    title, step, usual, gain, offset, amplitude = MACHINES[name]
    lag = lag or usual
    rng = np.random.default_rng(seed)
    time = step * np.arange(3000)
    pole = 1 / (2 * np.pi * usual)
    phase = 2 * np.pi * pole * (0.02 + 0.99 * time / time[-1]) * time
    u, y, kept = amplitude * np.sin(phase), np.zeros(time.size), np.exp(-step / lag)
    for k in range(time.size - 1):
        y[k + 1] = kept * y[k] + (1 - kept) * gain * u[k]
    y += offset + 2e-3 * gain * amplitude * rng.standard_normal(y.size)
    time = time + step * changed.get("jitter", 0.0) * rng.uniform(-1, 1, time.size)
    rows = np.column_stack((time - time[0], u, y))
    path = folder / changed.get("file", f"{name}.csv")
    lines = [",".join(f"{value:.6g}" for value in row) for row in rows]
    path.write_text("\n".join([changed.get("title", title), *lines]) + "\n", encoding="utf-8")
    return path


def selected(path):
    """Identification from the first column to the second, over the whole recording."""
    recording = read_recording(path)
    given, taken = recording.channels
    return identified(recording, Selection((0.0, recording.duration), given, taken))


def visible(path):
    """Text of a page as a reader sees it."""
    html = path.read_text(encoding="utf-8")
    return unescape(re.sub(r"<(svg|style|script).*?</\1>|<[^>]+>", " ", html, flags=re.DOTALL))


@pytest.fixture(scope="module")
def reports(tmp_path_factory):
    folder, made = tmp_path_factory.mktemp("machines"), {}
    for name in MACHINES:
        found = selected(table(folder, name))
        study = studied(found)
        made[name] = found, study, write_report(found, study, folder / name, None)
    return made


@pytest.mark.parametrize("name", MACHINES)
def test_no_word_of_the_motorcycle_is_in_the_report_or_in_the_terminal(reports, name):
    found, study, page = reports[name]
    text = visible(page) + "\n".join(summary(found, study))
    words = set(re.findall(r"[A-Za-z]+", text.replace("slipbench", "")))
    assert {w for w in words if w.casefold() in map(str.casefold, FOREIGN)} == set()


@pytest.mark.parametrize(
    ("name", "output", "gain"),
    [
        ("servo", "motor speed / rad/s", "gain / (rad/s\u2009/\u2009V)"),
        ("oven", "°C", "gain / (°C\u2009/\u2009W)"),
        ("drone", "motor speed / rpm", "gain / (rpm\u2009/\u2009%)"),
        ("valve", "opening", "gain"),
    ],
)
def test_axes_are_in_the_units_of_the_titles(reports, name, output, gain):
    """A pure number has none; a name too long for its panel is in the legend alone."""
    charts = interactive(*reports[name][:2])
    assert [panel.y_label for panel in charts["overview"].panels][1] == output
    assert charts["response"].panels[0].y_label == gain


def test_values_on_the_axes_are_those_of_the_table(reports):
    for name in MACHINES:
        found, study, _ = reports[name]
        table = np.loadtxt(found.recording.folder, delimiter=",", skiprows=1)
        drawn = interactive(found, study)["overview"].panels
        for panel, column in zip(drawn, table.T[1:], strict=True):
            trace = panel.traces[0]
            assert np.interp(table[:, 0], trace.x, trace.y) == pytest.approx(column, rel=1e-9)


@pytest.mark.parametrize("name", MACHINES)
def test_the_time_constant_is_in_the_interval_of_the_real_pole_that_is_listed(reports, name):
    """A second pole and the dead time stand for the sample that the output is held behind the input."""
    _, study, page = reports[name]
    fit = study.models[0].fit
    assert oscillating(fit) == []
    frequency, half_width = real_poles(fit)[0]
    truth = 1 / (2 * np.pi * MACHINES[name][2])
    assert abs(frequency - truth) < half_width + 0.02 * truth
    assert "Real pole" in visible(page)


def test_times_of_a_slow_plant_are_in_seconds(reports):
    found, study, page = reports["oven"]
    shown = visible(page) + "\n".join(summary(found, study))
    assert re.search(r"Group delay, heater power to plate temperature\s+\d+(\.\d+)? s", shown)
    assert not re.search(r"\d{4,} ms|e\+\d+ ms", shown)


def test_intervals_of_a_slow_plant_hold_its_response_also_at_its_lowest_frequencies():
    """Heated in steps at random for two hours; the band spans more than two decades."""
    rng = np.random.default_rng(3)
    lag, late, gain = 300.0, 20, 0.08
    time = np.arange(7200.0)
    level = np.repeat(rng.choice([200.0, 800.0], time.size // 120), 120)
    delayed = np.concatenate((np.full(late, level[0]), level[:-late]))
    kept = np.exp(-1 / lag)
    plate = 22 + lfilter([0, gain * (1 - kept)], [1, -kept], delayed)
    values = {"power": level, "plate": plate + 0.05 * rng.standard_normal(time.size)}
    recorded = recording_of("plate", time, values, {"power": "W", "plate": "degC"})
    main = identified(recorded, Selection((0.0, 7199.0), "power", "plate")).main
    s = 2j * np.pi * main.frequency
    truth = gain / (1 + lag * s) * np.exp(-s * (late + 0.5))
    inside = np.abs(main.value - truth) < main.quantile * main.deviation
    assert np.mean(inside[main.frequency < 0.006]) > 0.7
    assert np.mean(inside) > 0.85


def test_a_column_in_degrees_celsius_is_compared_as_a_difference(reports):
    """The residual is a difference of temperatures: no offset of 273.15."""
    _, study, page = reports["oven"]
    error = study.validations[0].error
    assert f"{error:.3g} °C" in visible(page)


def test_two_runs_of_one_servo_do_not_differ_and_another_motor_does(tmp_path):
    runs = [
        table(tmp_path, "servo", 1, file="one.csv"),
        table(tmp_path, "servo", 2, file="two.csv"),
        table(tmp_path, "servo", 3, lag=0.08, file="other.csv"),
    ]
    window = ("--window", "0:29.9", "--input", "command", "--output", "motor speed")
    same = command(tmp_path, *map(str, runs[:2]), *window)
    assert "do not differ" in same.output
    assert "slowest real pole / Hz" in same.output
    assert "natural frequency" not in same.output
    other = command(tmp_path, str(runs[0]), str(runs[2]), *window)
    assert "one.csv and other.csv differ" in other.output
    shown = visible(tmp_path / "comparison" / "comparison.html")
    assert not re.search(r"\b(throttle|spark|rider|gear)\b", shown)


def test_runs_of_different_quantities_are_not_compared(tmp_path):
    torque = "time [s],command [V],motor speed [Nm]"
    runs = table(tmp_path, "servo"), table(tmp_path, "servo", title=torque, file="torque.csv")
    window = ("--window", "0:29.9", "--input", "command", "--output", "motor speed")
    found = command(tmp_path, *map(str, runs), *window)
    assert found.exit_code != 0
    assert "other units" in str(found.exception)


@pytest.mark.parametrize(
    ("chosen", "words"),
    [
        (Selection((0.0, 29.0), "comand", "motor speed"), "did you mean 'command'"),
        (Selection((0.0, 29.0), "command", "Motor Sped"), "did you mean 'motor speed'"),
        (Selection((0.0, 29.0), "command"), "--output must be given"),
        (Selection((0.0, 29.0), None, "motor speed"), "--input must be given"),
        (Selection((0.0, 29.0), "command", "slip"), "there is no signal slip"),
        (Selection(None, "command", "motor speed"), "--window 0:29.99 for the whole recording"),
        (Selection((0.0, 90.0), "command", "motor speed"), "between 0 s and 29.99 s"),
        (Selection(), "--input, --output and --window must be given"),
    ],
)
def test_a_wrong_selection_is_refused_with_the_signals_or_the_times_that_there_are(
    tmp_path, chosen, words
):
    with pytest.raises(InputError) as refused:
        identified(read_recording(table(tmp_path, "servo")), chosen)
    assert words in str(refused.value)


@pytest.mark.parametrize(
    ("title", "name", "words"),
    [
        ("time [s],command,motor speed [rpm]", "command", "no unit is stated"),
        ("time [s],command [foo],motor speed [rpm]", "command", "'foo' is not known"),
    ],
)
def test_a_column_that_cannot_be_used_says_why(tmp_path, title, name, words):
    path = table(tmp_path, "servo", title=title)
    with pytest.raises(InputError) as refused:
        identified(read_recording(path), Selection((0.0, 29.0), name, "motor speed"))
    assert f"the signal {name} cannot be used" in str(refused.value)
    assert words in str(refused.value)


def test_a_step_without_a_model_is_no_good_run_and_noise_has_no_empty_chart(tmp_path):
    """A step excites few independent lines; unrelated noise gives no reliable one."""
    rng = np.random.default_rng(4)
    time = 0.01 * np.arange(3000)
    step = 6.0 * (time >= 10.0)
    answer = 60.0 * (1 - np.exp(-np.maximum(time - 10.0, 0.0) / 0.05))
    noise = rng.standard_normal((2, time.size))
    units = {"command": "V", "speed": "rad/s"}
    whole = Selection((0.0, 29.9), "command", "speed")
    pairs = {"step": (step, answer), "noise": (noise[0], noise[1])}
    verdicts, charts = {}, {}
    for name, values in pairs.items():
        found = identified(
            recording_of(name, time, dict(zip(units, values, strict=True)), units), whole
        )
        study = studied(found)
        assert not study.models
        verdicts[name] = run_verdict(found, study)
        charts[name] = interactive(found, study)
    assert verdicts["step"].word == "usable with reservations"
    assert "there is no model from command to speed" in str(verdicts["step"])
    assert verdicts["noise"].word == "not usable"
    assert "nichols" in charts["step"]
    assert "nichols" not in charts["noise"]


@pytest.mark.parametrize(("jitter", "uneven"), [(0.0, False), (0.4, True)])
def test_uneven_samples_are_stated_with_their_steps(tmp_path, jitter, uneven):
    path = table(tmp_path, "servo", jitter=jitter)
    found = selected(path)
    page = write_report(found, studied(found), tmp_path / "report", None)
    assert ("uneven: steps of" in visible(page)) == uneven


@pytest.mark.parametrize("window", [(-5.0, 5.0), (3.0, 2.0), (float("nan"), 5.0), (5.0, 5.5)])
def test_a_window_that_is_none_is_refused(tmp_path, window):
    recording = read_recording(table(tmp_path, "servo"))
    with pytest.raises(InputError, match="the window does not fit the recording"):
        identified(recording, Selection(window, "command", "motor speed"))


def test_a_recording_below_a_second_is_too_short_whatever_the_window(tmp_path):
    path = table(tmp_path, "servo")
    path.write_text("\n".join(path.read_text().splitlines()[:60]) + "\n")
    with pytest.raises(InputError, match="the recording is too short"):
        identified(read_recording(path), Selection((0.0, 1.0), "command", "motor speed"))


def command(folder, *arguments):
    """Result of `identify` in a folder."""
    app = typer.Typer()
    app.callback()(lambda: None)
    register(app)
    out = ("--out", str(folder / "comparison"))
    return CliRunner().invoke(app, ["identify", *arguments, *out])
