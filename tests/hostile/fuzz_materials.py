"""Small valid files of every kind that slipbench reads, made once and linked into every case."""

import contextlib
import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from random import Random

import can
import pandas as pd

from slipbench import dbc
from slipbench.plant.vehicles import DEMONSTRATION
from slipbench.studies.blind_validation.generator.case import answer, draw_case
from slipbench.studies.blind_validation.hidden_cases import store_ground_truth
from slipbench.studies.blind_validation.study import result_path
from tests.paths import CONTROLLERS, MODELS, TRIALS, with_full_paths

SWEEP = "throttle_sweep.toml"
STEPS = "slip_steps_throttle.toml"
FRAMES = 3000
LOG_ENDINGS = (".asc", ".blf", ".trc", ".csv", ".mf4")
IMPORTED_ROLES = """
title = "Two motors and a belt"

[tables.main]
time_unit = "s"

[quantities]
motor_voltage = "V"
pulley_speed = "V"

[roles.motor_voltage]
column = "u"
unit = "V"

[roles.pulley_speed]
column = "y"
unit = "V"
"""
SECOND_LOGGER = """
[tables.gps]
time_unit = "s"
align = "start"

[roles.yaw_rate]
table = "gps"
column = "y"
unit = "rad/s"
"""
FLEET = """
[[analyses]]
name = "first"
vehicle = "vehicle.toml"
training = ["missing_run"]

[[analyses]]
name = "second"
vehicle = "vehicle.toml"
training = ["missing_run"]
held_out = ["another"]
"""

Command = Callable[[list[str], Path], None]


def make_materials(folder: Path, command: Command) -> None:
    """Write all valid files into `folder`; `command` runs a slipbench command line there."""
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copy(dbc.MOTORBIKE, folder / "motorbike.dbc")
    shutil.copy(dbc.MOTORBIKE.parent / "motorbike_roles.toml", folder / "roles.toml")
    shutil.copy(DEMONSTRATION, folder / "vehicle.toml")
    shutil.copy(CONTROLLERS / "throttle.toml", folder / "controller.toml")
    shutil.copy(CONTROLLERS / "mixed.toml", folder / "mixed.toml")
    shutil.copy(MODELS / "coupled_drives.toml", folder / "model.toml")
    (folder / "table_roles.toml").write_text(IMPORTED_ROLES)
    roles = (folder / "roles.toml").read_text(encoding="utf-8")
    (folder / "two_loggers.toml").write_text(roles + SECOND_LOGGER, encoding="utf-8")
    (folder / "fleet.toml").write_text(FLEET)
    _write_trial(folder / "trial.toml", SWEEP, "200 ms")
    _write_trial(folder / "long_trial.toml", SWEEP, "6 s")
    _write_trial(folder / "slip_trial.toml", STEPS, "200 ms")
    _write_tables(folder)
    _write_study(folder / "study")
    shutil.copytree(TRIALS, folder / "trials")
    for path in (folder / "trials").glob("*.toml"):
        path.write_text(with_full_paths(path.read_text(encoding="utf-8")), encoding="utf-8")
    command(["trial", "long_trial.toml", "--out", "run", "--dbc", "motorbike.dbc"], folder)
    imported = ["import", "main.csv", "--roles", "table_roles.toml", "--out", "table_run"]
    command(imported, folder)
    _write_logs(folder)


def _write_trial(path: Path, example: str, duration: str) -> None:
    text = (TRIALS / example).read_text(encoding="utf-8")
    for old, new in (
        ("../../plant/vehicles/demonstration.toml", "vehicle.toml"),
        ("../controllers/throttle.toml", "controller.toml"),
        ('duration = "30 s"', f'duration = "{duration}"'),
        ('duration = "8 s"', f'duration = "{duration}"'),
        ('presses_button_after = "5 s"', 'presses_button_after = "500 ms"'),
        ('steady_for = "500 ms"', 'steady_for = "100 ms"'),
    ):
        text = text.replace(old, new)
    path.write_text(f'settling = "200 ms"\n{text}', encoding="utf-8")


def _write_study(folder: Path) -> None:
    """Write a blind validation of one case, whose analysis failed."""
    (folder / "results").mkdir(parents=True)
    fingerprint = store_ground_truth([answer(draw_case(1, 0))], folder)
    result = {"answers": fingerprint, "source": "", "case": 0, "failed": "an error", "trace": ""}
    result_path(folder, 0).write_text(json.dumps(result, indent=1), encoding="utf-8")


def _write_tables(folder: Path) -> None:
    rng, y, rows = Random(1), 0.0, []
    for n in range(600):
        u = 1.0 if n // 40 % 2 else -1.0
        y += 0.04 * (1.5 * u - y) if n > 50 else 0.0
        rows.append((round(n * 0.02, 3), u if n > 50 else 0.0, y + 0.001 * rng.gauss(0, 1)))
    table = pd.DataFrame(rows, columns=["time", "u", "y"])
    table.to_csv(folder / "main.csv", index=False)
    table.to_parquet(folder / "main.parquet")


def _write_logs(folder: Path) -> None:
    lines = (folder / "run" / "frames.log").read_text(encoding="ascii").splitlines()[:FRAMES]
    (folder / "drive.log").write_text("\n".join(lines) + "\n", encoding="ascii")
    messages = [_message(line) for line in lines]
    for ending in LOG_ENDINGS:
        with can.Logger(folder / f"drive{ending}") as logger:
            for message in messages:
                logger.on_message_received(message)


def _message(line: str) -> can.Message:
    time, _, frame = line.split()[:3]
    identifier, data = frame.split("#")
    return can.Message(
        timestamp=float(time.strip("()")),
        arbitration_id=int(identifier, 16),
        is_extended_id=len(identifier) > 3,
        data=bytes.fromhex(data),
        channel=0,
    )


def link_materials(source: Path, target: Path, names: tuple[str, ...]) -> None:
    """Link files and folders of `source` into `target`; a file is replaced before it is changed."""
    for name in names:
        for path in [source / name, *(source / name).rglob("*")]:
            new = target / path.relative_to(source)
            if path.is_dir():
                new.mkdir(parents=True, exist_ok=True)
            else:
                with contextlib.suppress(FileExistsError):
                    os.link(path, new)


def exists(path: Path) -> bool:
    """Whether there is a file or a folder of this name; False for names that cannot be."""
    try:
        path.stat()
    except (OSError, ValueError):
        return False
    return True
