"""The day, step by step, with the commands that an engineer types.

plan        trials that fit into the straight, simulated with margin
session     eight runs; one trips, one is bad: both are repeated
explain     simulation against recordings, with what it left open
next        the trial that settles it, added to the plan and ridden
design      a slip controller from the recorded runs
trial       the controller, ridden; identify: its report
"""

import os
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import tomli_w

from slipbench.plant.vehicles import DEMONSTRATION, NOMINAL
from slipbench.protocol.configuration import load_toml
from slipbench.protocol.errors import InputError
from slipbench.protocol.output_folders import make_folders
from slipbench.studies.day.mishaps import record, silent_sensors, soft_tyre

STRAIGHT = "900m"
REPEATS = 4  # of two trials: eight runs
TRIPPED, BAD = "throttle_response-2", "spark_response-3"
DESIGNED = "designed"
Say = Callable[[str], None]


@dataclass(frozen=True)
class Day:
    """Folder of the day, and who receives its lines. nominal: vehicle file before the day."""

    folder: Path
    say: Say
    nominal: Path = NOMINAL

    @property
    def plan(self) -> Path:
        """The session plan."""
        return self.folder / "day.toml"

    @property
    def session(self) -> Path:
        """Folder of the session."""
        return self.folder / "session"

    @property
    def pages(self) -> dict[str, Path]:
        """Pages of the day, by name."""
        return {
            "day_report": self.session / "report.html",
            "day_memo": self.session / "memo" / "memo.html",
            "day_controller": self.folder / "controller" / "design.html",
            "day_slip_control": self.folder / "slip_steps" / "report.html",
        }


def rehearse(day: Day) -> None:
    """Rehearse the whole day into its folder. Raises InputError where a step fails or it is not empty."""
    if day.folder.exists() and any(day.folder.iterdir()):
        raise InputError(
            "the folder is not empty", where=str(day.folder), remedy="give a new folder"
        )
    make_folders(day.folder)
    plan(day)
    day.say("-- something goes wrong in two of the runs: a loose connector, a tyre without air")
    record(day.plan, day.session, (silent_sensors(TRIPPED), soft_tyre(BAD)))
    run_session(day)
    experiment(day)
    control(day)


def plan(day: Day) -> None:
    """Propose the plan of eight runs."""
    asked = "throttle_response,spark_response"
    _slipbench(
        day, "plan", DEMONSTRATION, "--straight", STRAIGHT, "--questions", asked, "--out", day.plan
    )
    text = day.plan.read_text(encoding="utf-8")
    day.plan.write_text(re.sub(r"repeats = \d+", f"repeats = {REPEATS}", text), encoding="utf-8")


def run_session(day: Day) -> None:
    """Run what is planned and not done yet, and write the report."""
    arguments = ("--out", day.session, "--simulate", "--explain", day.nominal)
    _slipbench(day, "session", day.plan, *arguments)


def experiment(day: Day) -> None:
    """Design the trial that settles what is open, add it to the plan, and go on with the session."""
    file = day.folder / f"{DESIGNED}.toml"
    _slipbench(day, "next", day.session, "--straight", STRAIGHT, "--out", file)
    added = f'\n[[trial]]\nname = "{DESIGNED}"\nfile = "{file.name}"\nrepeats = 2\n'
    with day.plan.open("a", encoding="utf-8") as text:
        text.write(added)
    run_session(day)


def control(day: Day) -> None:
    """Design a slip controller from the usable runs of the day and ride it."""
    runs = [day.session / "runs" / f"throttle_response-{n}" for n in (1, 3, 4)]
    controller = day.folder / "controller.toml"
    report = day.folder / "controller"
    _slipbench(
        day, "design", *runs, "--actuator", "throttle", "--out", controller, "--report", report
    )
    trial, run = day.folder / "slip_steps.toml", day.folder / "slip_steps"
    trial.write_text(tomli_w.dumps(_slip_steps(day, controller)), encoding="utf-8")
    _slipbench(day, "trial", trial, "--out", run)
    _slipbench(day, "identify", run)


def _slip_steps(day: Day, controller: Path) -> dict[str, object]:
    """Trial file of steps of the slip about the operating point of the day, in its limits."""
    tree = load_toml(day.session / "trials" / "throttle_response-1.toml")
    excitation = {
        "actuator": "slip",
        "waveform": "square",
        "amplitude": "0.1 %",
        "frequency": "0.5 Hz",
        "duration": "8 s",
    }
    return {
        **tree,
        "name": "slip_steps",
        "description": "Steps of the slip under control",
        "vehicle": os.path.relpath(DEMONSTRATION, day.folder),
        "excitation": excitation,
        "controller": {"file": controller.name},
        "rider": {"presses_button_after": "5 s"},
    }


def _slipbench(day: Day, *arguments: object) -> None:
    """Run a command in a process of its own. Raises InputError where it fails."""
    shown = " ".join(_short(day, str(a)) for a in arguments)
    day.say(f"$ slipbench {shown}")
    command = [sys.executable, "-m", "slipbench", *map(str, arguments)]
    done = subprocess.run(
        command, check=False, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    for line in done.stdout.splitlines():
        day.say(line)
    if done.returncode:
        raise InputError(
            "a step of the day failed",
            where=f"slipbench {shown}",
            found=f"status {done.returncode}",
        )


def _short(day: Day, text: str) -> str:
    """An argument as an engineer in the folder of the day types it."""
    return os.path.relpath(text, day.folder) if text.startswith(str(day.folder)) else text
