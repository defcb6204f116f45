"""The commands of the bench at the command line."""

import os
import signal
import subprocess
import sys
from contextlib import contextmanager

import can
import pytest

from slipbench import command
from slipbench.protocol.recording.run_folder import read
from tests.paths import DEMONSTRATION, TRIALS


def run(monkeypatch, capsys, *arguments):
    """Exit status, standard output, standard error."""
    monkeypatch.setattr("sys.argv", ["slipbench", *map(str, arguments)])
    with pytest.raises(SystemExit) as end:
        command.main()
    told = capsys.readouterr()
    return end.value.code or 0, told.out, told.err


@pytest.fixture
def short(tmp_path):
    """The default trial file, its excitation shortened and its paths made absolute."""

    def write(*changes):
        text = (TRIALS / "throttle_sweep.toml").read_text()
        vehicle = DEMONSTRATION
        for old, new in (
            ('vehicle = "../../plant/vehicles/demonstration.toml"', f'vehicle = "{vehicle}"'),
            ('duration = "30 s"', 'duration = "1 s"'),
            ('stop = "12 Hz"', 'stop = "5 Hz"'),
            *changes,
        ):
            assert old in text
            text = text.replace(old, new)
        (tmp_path / "trial.toml").write_text(text)
        return tmp_path / "trial.toml"

    return write


def test_a_trial_prints_its_run_folder_and_ends_with_0(monkeypatch, capsys, short, tmp_path):
    monkeypatch.chdir(tmp_path)
    status, out, _ = run(monkeypatch, capsys, "trial", short())
    assert (status, out) == (0, "runs/throttle_sweep-001\n")
    assert read(tmp_path / out.strip()).frame_count > 10_000
    _, again, _ = run(monkeypatch, capsys, "trial", short())
    assert again == "runs/throttle_sweep-002\n"


def test_a_tripped_trial_ends_with_3_and_says_why(monkeypatch, capsys, short, tmp_path):
    file = short(('slip = "8 %"', 'slip = "1.2 %"'))
    status, _, err = run(monkeypatch, capsys, "trial", file, "--out", tmp_path / "run")
    assert status == 3
    assert "tripped: slip of " in err


def test_ctrl_c_after_the_trial_costs_no_outcome(monkeypatch, capsys, short, tmp_path):
    """A page may ask for a trip while the trial ends by itself."""

    @contextmanager
    def late(*_args, **_options):
        yield
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr("slipbench.bench.view.view_process.live_view", late)
    file = short(('slip = "8 %"', 'slip = "1.2 %"'))
    status, out, err = run(monkeypatch, capsys, "trial", file, "--out", tmp_path / "run")
    assert (status, out) == (3, f"{tmp_path / 'run'}\n")
    assert "tripped: slip of " in err


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (('stop = "5 Hz"', 'stpo = "5 Hz"'), "unknown key 'excitation.stpo'; did you mean 'stop'?"),
        (('stop = "5 Hz"', 'stop = "80 Hz"'), "lower it or shorten command.period"),
        (('stop = "5 Hz"', 'stop = "5 bananas"'), "one of: Hz, mHz, kHz"),
        (('amplitude = "2 %"', 'amplitude = "9 %"'), "limits.throttle_deviation"),
        (("gear = 2", "gear = 6"), "no steady state at the operating point"),
        (("gear = 2", 'gear = "second"'), "operating_point.gear"),
        (("[limits]", "[limits"), "not valid TOML"),
        (('duration = "1 s"', 'duration = "3600 s"'), "more than the 3600000 ticks"),
        (('slip = "8 %"', ""), "limits.slip is missing"),
    ],
)
def test_a_users_mistake_ends_with_2_and_the_remedy(
    monkeypatch, capsys, short, tmp_path, change, words
):
    status, out, err = run(monkeypatch, capsys, "trial", short(change), "--out", tmp_path / "run")
    assert (status, out) == (2, "")
    assert words in err
    assert "Traceback" not in err
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    "option",
    [
        "--speed=inf",
        "--speed=nan",
        "--speed=1e30",
        "--speed=0",
        "--start=inf",
        "--start=-1",
        "--passes=99999999999999999999",
        "--bitrate=0",
    ],
)
def test_a_number_that_no_replay_can_have_ends_with_2_and_the_range(
    monkeypatch, capsys, tmp_path, option
):
    (tmp_path / "x.log").write_text("(1.000000) can0 123#00\n")
    status, out, err = run(
        monkeypatch, capsys, "replay", tmp_path / "x.log", "--interface", "virtual", option
    )
    assert (status, out) == (2, "")
    assert option.split("=")[0] in err
    assert "Traceback" not in err


def test_the_vehicle_reports_that_it_is_ready_and_then_sends(short, tmp_path):
    """Its first line states vehicle and bus, and is printed once the bus is open."""
    channel = f"ready-{os.getpid()}"
    options = ("--interface", "slipbench", "--channel", channel, "--duration", "60")
    process = subprocess.Popen(
        [sys.executable, "-m", "slipbench", "vehicle", short(), *options],
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
    )
    with process:
        try:
            line = process.stdout.readline()
            with can.Bus(interface="slipbench", channel=channel) as listener:
                assert listener.recv(60.0) is not None
        finally:
            process.send_signal(signal.SIGINT)
        rest, _ = process.communicate(timeout=60.0)
    assert line == (
        f"simulating demonstration on slipbench, channel {channel}, at 1000000 bit/s; "
        "Ctrl-C ends the simulation\n"
    )
    assert (process.returncode, rest) == (0, "")


def test_a_missing_trial_or_vehicle_file_is_named(monkeypatch, capsys, short):
    status, _, err = run(monkeypatch, capsys, "trial", "nowhere.toml")
    assert (status, "nowhere.toml: no such file" in err) == (2, True)
    file = short(("demonstration.toml", "nobody.toml"))
    status, _, err = run(monkeypatch, capsys, "trial", file)
    assert (status, "nobody.toml" in err) == (2, True)


@pytest.mark.parametrize("command", ["trial", "vehicle", "replay", "decode", "import", "identify"])
def test_the_help_of_every_command_has_an_example(monkeypatch, capsys, command):
    status, out, _ = run(monkeypatch, capsys, command, "--help")
    assert status == 0
    assert f"slipbench {command}" in " ".join(out.replace("│", " ").split())


@pytest.mark.parametrize("command", ["trial", "vehicle", "replay"])
def test_the_help_of_interface_names_our_own_bus(monkeypatch, capsys, command):
    _, out, _ = run(monkeypatch, capsys, command, "--help")
    words = " ".join(out.replace("│", " ").split())
    assert "or slipbench (this project's own bus)" in words
