"""The grammar of the fuzzing target: every command, its valid command lines, and hostile cases."""

import os
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from random import Random
from signal import Signals

from tests.hostile.fuzz_materials import LOG_ENDINGS, exists, link_materials
from tests.hostile.fuzz_mutations import (
    SPARSE,
    damaged_file,
    hostile_input,
    hostile_output,
    hostile_value,
)


@dataclass(frozen=True)
class Line:
    """A valid command line.

    argv: its words. files: what it reads beside the words. out: words that name what it writes,
    each with the file that proves the work was done. weight: how often it is drawn.
    """

    argv: str
    files: tuple[str, ...] = ()
    out: dict[str, str] = field(default_factory=dict)
    weight: float = 1.0
    interrupt_after: float | None = None  # s of processor; then Ctrl-C: it would take minutes


@dataclass
class Disturbance:
    """What happens to the process of a case from outside."""

    signal: Signals | None = None  # to the whole group
    after: float = 0.0  # s of processor
    open_files: int | None = None  # at most
    new_interpreter: bool = False


@dataclass(frozen=True)
class Case:
    """One command line in a folder of its own."""

    argv: list[str]
    line: Line
    folder: Path
    out: dict[str, str]
    changes: tuple[str, ...]
    disturbance: Disturbance = field(default_factory=Disturbance)


TRIAL = ("vehicle.toml", "controller.toml")

LINES = [
    Line("init new", out={"new": "README.md"}, weight=0.3),
    Line("doctor", weight=0.1),
    Line("trial trial.toml --out new --dbc motorbike.dbc", TRIAL, {"new": "frames.log"}, 4),
    Line("trial slip_trial.toml --out new", TRIAL, {"new": "frames.log"}, 2),
    Line("trial trial.toml --out new --interface virtual --channel v0", TRIAL, {}, 0.3, 1.0),
    Line("vehicle trial.toml --interface virtual --duration 0.2 --bitrate 500000", TRIAL),
    Line(
        "replay drive.log --interface virtual --channel v0 --speed 1000 --report r.toml"
        " --only 0x10,0x20-0x7FF --passes 1 --start 0.1",
        out={"r.toml": ""},
    ),
    Line("identify run --out new --figures figures", (), {"new": "report.html", "figures": ""}, 3),
    Line(
        "identify table_run --window 0:11.9 --input motor_voltage --output pulley_speed --out new",
        (),
        {"new": "report.html"},
    ),
    Line("model main.csv --input u --output y --out new", (), {"new": "model.json"}, 2),
    Line(
        "model main.csv main.parquet --held-out main.csv --input u --output y --out new",
        out={"new": "model.json"},
    ),
    Line(
        "explain run --vehicle vehicle.toml --json v.json --report memo",
        (),
        {"v.json": "", "memo": ""},
        1.5,
        3.0,
    ),
    Line("explain table_run@0:6 --vehicle model.toml --json v.json", out={"v.json": ""}, weight=2),
    Line(
        "explain table_run@0:6 --vehicle model.toml --held-out table_run@6:11.9 --json v.json",
        out={"v.json": ""},
        weight=1.5,
        interrupt_after=5.0,
    ),
    Line("explain-fleet fleet.toml --out new --workers 1", ("vehicle.toml",), weight=0.7),
    Line(
        "design run --actuator throttle --out new.toml --report report --gain-margin 6"
        " --phase-margin 40 --sensitivity 2 --period 1 --law pid",
        (),
        {"new.toml": "", "report": ""},
        0.7,
        5.0,
    ),
    Line(
        "design run --actuator throttle --out new.toml --period 1 --law pid",
        out={"new.toml": ""},
        weight=0.3,
    ),
    Line(
        "compare controller.toml mixed.toml --page new.md --vehicle vehicle.toml --bandwidth 10",
        (),
        {"new.md": ""},
        1.5,
        3.0,
    ),
    Line(
        "prove --cases 1 --seed 1 --out study --workers 1 --score-only --page new.md",
        out={"new.md": ""},
        weight=0.5,
    ),
    Line("prove --cases 1 --seed 1 --out new --workers 1", weight=0.2, interrupt_after=3.0),
    Line(
        "paper --out new --nominal vehicle.toml --trials trials --bandwidth 10",
        weight=0.3,
        interrupt_after=3.0,
    ),
    *(
        Line(
            f"import drive{ending} --dbc motorbike.dbc --roles roles.toml --out new",
            out={"new": "frames.log"},
            weight=0.7,
        )
        for ending in (".log", *LOG_ENDINGS)
    ),
    Line(
        "import drive.log --dbc motorbike.dbc --roles two_loggers.toml --table gps=main.csv --out new",
        out={"new": "frames.log"},
    ),
    *(
        Line(f"import main{e} --roles table_roles.toml --out new", out={"new": "run.toml"})
        for e in (".csv", ".parquet")
    ),
    *(
        Line(f"decode drive{e} --dbc motorbike.dbc --out new.csv", out={"new.csv": ""}, weight=0.5)
        for e in (".log", *LOG_ENDINGS)
    ),
    Line(
        "decode drive.log --dbc motorbike.dbc --out new.parquet --signals EcuStatus",
        out={"new.parquet": ""},
    ),
    *(
        Line(f"export run --format {form} --out new.{form}", out={f"new.{form}": ""}, weight=0.6)
        for form in ("mf4", "blf", "asc", "parquet", "mcap")
    ),
]


SLOW = ("identify", "model", "design", "vehicle", "explain")
QUICK = [
    line
    for line in LINES
    if line.interrupt_after is None and not line.argv.startswith((*SLOW, "export run --format mf4"))
]


def draw(number: int, rng: Random, materials: Path, folder: Path, lines: list[Line]) -> Case:
    """Make case `number` in `folder`: the first ones are the valid lines, unchanged."""
    unchanged = number < len(lines)
    weights = [line.weight for line in lines]
    line = lines[number] if unchanged else rng.choices(lines, weights)[0]
    argv = line.argv.split()
    named = [word.partition("=")[2] or word.partition("@")[0] for word in argv]
    reads = [word for word in named if exists(materials / word)]
    link_materials(materials, folder, tuple(dict.fromkeys([*reads, *line.files])))
    case = Case(argv, line, folder, dict(line.out), ())
    if unchanged:
        return case
    changes = [rng.choices(*zip(*CHANGES, strict=True))[0] for _ in range(rng.choice([1, 1, 1, 2]))]
    return replace(case, changes=tuple(change(case, rng) for change in changes))


def _change_a_file(case: Case, rng: Random) -> str:
    files = sorted(
        path
        for path in case.folder.rglob("*")
        if path.is_file() and not path.is_symlink() and path.stat().st_size < SPARSE
    )
    small = [p for p in files if p.suffix in (".toml", ".dbc")]
    if not files:
        return "nothing"
    path = rng.choice(small if small and rng.random() < 0.7 else files)
    data = path.read_bytes()
    path.unlink()
    try:
        data = damaged_file(rng, data, path.suffix == ".toml")
    except ValueError:  # no TOML any more after an earlier change
        data = damaged_file(rng, data, toml=False)
    path.write_bytes(data)
    return f"content of {path.relative_to(case.folder)}"


def _change_an_input_path(case: Case, rng: Random) -> str:
    """Put something that cannot be read in the place of a path: a word, or a file of a folder."""
    places = [n for n, word in enumerate(case.argv) if exists(case.folder / word)]
    if not places:
        return "nothing"
    at = rng.choice(places)
    inside = case.folder / case.argv[at]
    new = hostile_input(rng, case.folder, case.argv[at])
    if inside.is_dir() and rng.random() < 0.6:
        return _put_into(inside, case.folder / new, rng)
    case.argv[at] = new
    return f"input path {new[:40]!r}"


def _put_into(run: Path, new: Path, rng: Random) -> str:
    files = sorted(path for path in run.iterdir() if path.is_file())
    if not files:  # a folder that an earlier change made
        return "nothing"
    old = rng.choice(files)
    old.unlink()
    if new.parent == run.parent and len(new.name) < 255 and os.path.lexists(new):
        new.rename(old)
    return f"{old.name} of the run is {new.name[:40]!r}"


def _change_an_output_path(case: Case, rng: Random) -> str:
    places = [n for n, word in enumerate(case.argv) if word in case.line.out or word == "new"]
    if not places:
        return "nothing"
    at = rng.choice(places)
    new = hostile_output(rng, case.folder, case.argv[at])
    proof = case.out.pop(case.argv[at], None)
    if proof is not None:
        case.out[new] = proof
    case.argv[at] = new
    return f"output path {new[:40]!r}"


def _change_an_option(case: Case, rng: Random) -> str:
    places = [n for n, word in enumerate(case.argv) if word.startswith("--")]
    if not places:
        return "nothing"
    at = rng.choice(places)
    match rng.randrange(8):
        case 0:
            for word in case.argv[at : at + 2]:
                case.out.pop(word, None)
            del case.argv[at : at + 2]
            return "an option is missing"
        case 1:
            case.argv.extend(case.argv[at : at + 2])
            return "an option twice"
        case 2:
            case.argv.insert(at, rng.choice(["--nonsense", "--help", "-h", "--", "extra"]))
            return "a word too many"
    old = case.argv[at + 1 : at + 2]
    if not old or old[0] in case.line.out or exists(case.folder / old[0]) or old == ["new"]:
        return _change_an_output_path(case, rng)
    case.out.pop(old[0], None)
    text = str(hostile_value(rng, old[0]))[:100_000]
    case.argv[at + 1] = text
    return f"{case.argv[at]} {text[:40]!r}"


def _disturb(case: Case, rng: Random) -> str:
    """A signal while the case starts, or few open files; half of them in a new interpreter."""
    disturbance = case.disturbance
    disturbance.new_interpreter = rng.random() < 0.5
    if rng.random() < 0.3:
        disturbance.open_files = 12
        return "at most 12 open files"
    disturbance.signal = rng.choice([Signals.SIGINT, Signals.SIGINT, Signals.SIGHUP])
    disturbance.after = rng.uniform(0.0, 0.3 if disturbance.new_interpreter else 0.1)
    return f"{disturbance.signal.name} after {disturbance.after:.2f} s of processor"


CHANGES: list[tuple[Callable[[Case, Random], str], float]] = [
    (_change_a_file, 6.0),
    (_change_an_input_path, 2.0),
    (_change_an_output_path, 1.0),
    (_change_an_option, 1.5),
    (_disturb, 0.5),
]
