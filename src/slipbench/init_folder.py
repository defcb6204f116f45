"""Write a folder to start from: trials, vehicle, databases, bindings, role maps, controllers, models."""

import re
from importlib.resources import files
from pathlib import Path

from slipbench.protocol.errors import InputError
from slipbench.protocol.shipped_files import shipped_files

START = Path(str(files("slipbench"))) / "start"
VEHICLE = "motorcycle"  # the vehicle file's name in the new folder
FOLDERS = {
    "trial": "trials",
    "controller": "controllers",
    "model": "models",
    "role map": "roles",
    "binding": "bindings",
    "database": "database",
}
VEHICLE_COMMENTS = {
    "gears": "engine speed over rear-wheel speed",
    "throttle_servo": "second-order response and dead time, from command to position",
    "intake": "from throttle position to torque",
    "engine": "torque over speed and opening, friction, effect of spark advance",
    "driveline": "torsional stiffness and damping, engine to rear wheel; torque at which the clutch slips",
    "rear_wheel": "with sprocket and brake disc",
    "tyre": "rear tyre: longitudinal force over slip, and load",
    "body": "motorcycle with rider",
    "front_wheel": "it rolls without slip",
    "rear_encoder": "tooth wheel and its errors",
    "front_encoder": "tooth wheel and its errors",
}


def init_folder(folder: Path) -> list[Path]:
    """Write the files to start from into `folder`; returns their paths.

    Raises InputError where a file of that name is there already, before anything is written, and
    where the folder cannot be written.
    """
    contents = _contents()
    try:
        if there := [name for name in contents if (folder / name).exists()]:
            raise InputError(
                f"{len(there)} of the files are there already; nothing was written",
                where=str(folder),
                found=", ".join(there[:4]),
                remedy="choose a new folder, or move them away",
            )
        for name, text in contents.items():
            _write(folder / name, text)
    except (OSError, ValueError) as cause:
        raise InputError(
            "the folder cannot be written",
            where=str(folder)[:300],
            found=str(cause)[:300],
            remedy="choose another folder",
        ) from cause
    return [folder / name for name in contents]


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("x", encoding="utf-8", newline="") as file:
        file.write(text)


def _contents() -> dict[str, str]:
    """Return path, relative to the folder, and text of every file."""
    contents = {
        "README.md": _text(START / "README.md"),
        "trials/my_trial.toml": _text(START / "my_trial.toml"),
        f"vehicles/{VEHICLE}.toml": _commented(_text(shipped_files("vehicle")["demonstration"])),
    }
    for kind, name in FOLDERS.items():
        for path in shipped_files(kind).values():
            contents[f"{name}/{path.name}"] = _with_own_files(_text(path))
    return contents


def _text(path: Path) -> str:
    return path.read_bytes().decode("utf-8")


def _with_own_files(text: str) -> str:
    """Return a file's text with the folder's vehicle file and databases in place of the shipped."""
    text = re.sub(r'(?m)^vehicle = ".*"$', f'vehicle = "../vehicles/{VEHICLE}.toml"', text)
    return re.sub(r'(?m)^database = "(?=\w)', f'database = "../{FOLDERS["database"]}/', text)


def _commented(text: str) -> str:
    """Return a vehicle file's text with a comment above each section."""
    text = re.sub(r'(?m)^name = ".*"$', f'name = "{VEHICLE}"', text, count=1)
    for section, comment in VEHICLE_COMMENTS.items():
        text = text.replace(f"\n[{section}]\n", f"\n# {comment}\n[{section}]\n")
    effects = "# physics beyond the nominal equations; each effect has a page in the documentation"
    return text.replace("\n[[effects]]\n", f"\n{effects}\n[[effects]]\n", 1)
