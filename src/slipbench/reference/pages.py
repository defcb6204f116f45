"""The pages of the reference, one for each kind of file, and their index."""

from pathlib import Path

from slipbench.bench.session.plan_file import SessionPlan
from slipbench.identification.fleet.fleet_file import FleetFile
from slipbench.identification.mismatch.callables.fmu.fmu_file import FmuFile
from slipbench.identification.mismatch.systems.expression import (
    ARGUMENTS,
    DEEPEST,
    DELAY,
    FUNCTIONS,
    LONGEST,
    OF_VECTORS,
)
from slipbench.identification.mismatch.systems.model_file import ModelFile
from slipbench.identification.mismatch.systems.vectors.element import MOST_ELEMENTS
from slipbench.identification.report.identification_file import (
    FILES,
    ComparisonFile,
    IdentificationFile,
    schema_text,
)
from slipbench.protocol.binding.missing import needs
from slipbench.protocol.configuration import load_toml
from slipbench.protocol.controller_file import ControllerFile
from slipbench.protocol.recording.message_rules import Degraded
from slipbench.protocol.recording.role_map import RoleMap
from slipbench.protocol.recording.roles import ROLES
from slipbench.protocol.trial_file import TrialFile
from slipbench.reference.models import tables
from slipbench.reference.page import Page, grid
from slipbench.reference.places import EXAMPLE
from slipbench.reference.vehicle import effect_tables, model_effect_tables, vehicle_tables

WITH_UNIT = (
    "A quantity with several units in the second column is a text with one of them:"
    ' `"14000 rpm"`, `"2 %"`.'
)
IN_SI = (
    "A quantity with one unit in the second column is a number in it, or a text with another unit of"
    ' the same kind: `0.005`, `"5 ms"`.'
)
THREE_PARTS = (
    'A quantity is `{ value = 245, unit = "kg", plus_minus = 5 }`: any unit of the same kind;'
    " `plus_minus`, which may be absent, is the half width of what is reliable with 95 %. Defaults"
    " and bounds are in the unit of the second column."
)


def pages() -> tuple[Page, ...]:
    """Every page."""
    return (
        Page(
            "trial.md",
            "Trial file",
            f"What is excited, when, and within which limits. {WITH_UNIT}",
            "protocol/trial_file.py",
            tables(TrialFile),
        ),
        Page(
            "session_plan.md",
            "Session plan",
            "Which trials a session runs, how often and in which order. `slipbench plan` proposes one;"
            f" `slipbench session` runs it. {WITH_UNIT}",
            "bench/session/plan_file.py",
            tables(SessionPlan),
        ),
        Page(
            "binding.md",
            "Binding file and role map",
            "Which signals of a database have which role. A binding file also names what the bench"
            f" sends (`throttle_request` and the like); a role map only reads recordings. {IN_SI}"
            f" {WITH_UNIT}",
            "protocol/recording/role_map.py",
            (*tables(RoleMap), "## Roles", _roles()),
        ),
        Page(
            "vehicle.md",
            "Vehicle file",
            f"Parameters of one motorcycle, and how well they are known. {THREE_PARTS} A"
            " number without `plus_minus` is taken as good to 5 %, a 0 as exact; `plus_minus = 0` is"
            " exact. What is left out keeps its default. [Effects](vehicle_effects.md) have a page of their own.",
            "plant/vehicle_file.py",
            vehicle_tables(),
        ),
        Page(
            "vehicle_effects.md",
            "Effects of a vehicle file",
            "Physics beyond the nominal equations. An effect is a table `[[effects]]` with its `name`"
            f" and its parameters. {THREE_PARTS}",
            "plant/effects/library.py",
            effect_tables(),
        ),
        Page(
            "model.md",
            "Model file",
            "Any system in equations: states, inputs, outputs, and seams at which effects may act."
            " Equations are text over the names of parameters, inputs, states and seams."
            " [Vectors and matrices](#vectors-and-matrices) are allowed. A quantity is"
            ' `{ value = 3, unit = "mm", plus_minus = 1 }`. An `effects`'
            " entry names an [effect of model files](model_effects.md). The examples are those of one"
            " [file](#example). `slipbench explain --model FILE RUN...` analyses it.",
            "identification/mismatch/systems/model_file.py",
            (
                *tables(ModelFile, load_toml(EXAMPLE)),
                "## Equations",
                _equations(),
                "## Vectors and matrices",
                _vectors(),
                "## Example",
                _example(),
            ),
        ),
        Page(
            "model_effects.md",
            "Effects of a model file",
            "An effect acts at a seam, an input, the rate of a state, or an output. Defaults and bounds"
            " are relative: `[seam]` is the `size` of the quantity at which the effect acts, `[other]`"
            " that of the quantity that it uses besides, `[time]` the `period` of the model. The places"
            " of the example are those of a [model file](model.md#example).",
            "identification/mismatch/systems/effects/library.py",
            model_effect_tables(),
        ),
        Page(
            "fmu.md",
            "File beside an FMU",
            "What is uncertain in an FMU, what drives it and what was recorded of it, for"
            " `slipbench explain model.fmu`. A quantity is"
            ' `{ value = 3, unit = "mm", plus_minus = 1 }`. Units convert to those of the FMU. An'
            " `effects` entry names an [effect of model files](model_effects.md) at an input or an"
            " output.",
            "identification/mismatch/callables/fmu/fmu_file.py",
            tables(FmuFile),
        ),
        Page(
            "controller.md",
            "Controller file",
            f"A slip controller, as `slipbench design` writes it and a trial runs it. {IN_SI}",
            "protocol/controller_file.py",
            tables(ControllerFile),
        ),
        Page(
            "fleet.md",
            "Fleet file",
            "Vehicles with their recordings, for `slipbench explain-fleet`.",
            "identification/fleet/fleet_file.py",
            tables(FleetFile),
        ),
        Page(
            "identification.md",
            "identification.json",
            "What `slipbench identify RUN` writes beside the report, in JSON. For programs:"
            " [JSON schema](identification.schema.json).",
            "identification/report/identification_file.py",
            tables(IdentificationFile),
        ),
        Page(
            "comparison.md",
            "comparison.json",
            "What `slipbench identify RUN RUN ...` writes beside the comparison, in JSON. For programs:"
            " [JSON schema](comparison.schema.json).",
            "identification/report/identification_file.py",
            tables(ComparisonFile),
        ),
    )


def _equations() -> str:
    """What may stand in an equation."""
    two = ", ".join(f"`{name}`" for name in ARGUMENTS if name in FUNCTIONS)
    one = ", ".join(f"`{name}`" for name in FUNCTIONS if name not in ARGUMENTS)
    return (
        "Numbers, names, `+ - * / **`, and `a if b > c else d` with `<`, `<=`, `>`, `>=`. A seam may use"
        f" the seams before it. Functions of one argument: {one}; of two: {two}. Quantities are in base"
        " units of SI, whatever unit the file has for them: rad, m/s, Pa.\n\n"
        f"`{DELAY}(quantity, time)` is what a quantity, an expression, was that time ago. The time is a"
        " parameter or a number of seconds, 0 or more and shorter than the recording. Before the"
        " recording begins a quantity had its first value.\n\n"
        f"An equation has at most {LONGEST} characters and {DEEPEST} operations one within the other."
    )


def _vectors() -> str:
    """How vectors are declared, named and calculated with."""
    functions = ", ".join(
        f"`{name}({', '.join('uv'[:count]) if name != 'transpose' else 'A'})`"
        for name, count in OF_VECTORS.items()
    )
    rows = (
        ("parameter", "`value` is a list, or a list of rows: `[[200, -90], [-90, 150]]`"),
        ("input", "`role` is a list, one role for each element"),
        ("state", "`length` is the number of elements: `length = 3`"),
        ("seam", "its equation gives a vector or a matrix"),
        ("output", "its equation gives a vector, and `role` is a list, one for each element"),
    )
    return (
        "A quantity may be a vector or a matrix. The file is read as the same file of numbers:"
        " the elements of `angle` are `angle_1`, `angle_2`, those of a matrix `stiffness_1_2` (row,"
        " column). These names stand in messages and results, and effects and curves act at them:"
        ' `at = "speed_2_rate"`. `examples/models/three_carts.toml` is an example.\n\n'
        + grid(("table", "a vector where"), rows)
        + "\n\nEvery other key of a vector is one for all elements, or a list of one for each:"
        ' `size = { value = [1, 2], unit = "m" }`, `low = [{ value = 0 }, "open"]`. The name of a vector'
        ' of the same shape stands for its elements: `start = "shown"`, `along = "speed"`. Entries of a'
        " matrix are independent unknowns. What they share is a parameter of its own, in a literal"
        " matrix: `[[k + c, -c], [-c, k + c]] @ angle`.\n\n"
        "In equations `+ - * / **` and functions act on each element; a number goes with every element,"
        " other shapes must agree. `@` is the product of matrices and vectors, of two vectors the scalar"
        " product. `angle[1]` is the first element, `stiffness[1, 2]` an entry, `stiffness[1]` a row,"
        " `angle[2:4]` the second to the fourth element, `stiffness[:, 1]` a column."
        f" `[a, b]` is a vector, a list of rows a matrix. Functions: {functions}; `cross` of three"
        " elements. A comparison has numbers on both sides.\n\n"
        f"A vector or matrix, and all states of a file with vectors together, have at most"
        f" {MOST_ELEMENTS} elements."
    )


def _example() -> str:
    """Text of a model file that uses every key."""
    text = EXAMPLE.read_text(encoding="utf-8")
    return f"`examples/models/{EXAMPLE.name}` uses every key.\n\n```toml\n{text}```"


def _roles() -> str:
    needed = {need.role: need for need in needs(Degraded(), set(), spark=True)}
    rows = (
        (
            f"`{role.name}`",
            role.unit,
            role.meaning,
            needed[role.name].without if role.name in needed else "",
            needed[role.name].instead if role.name in needed else "",
        )
        for role in ROLES.values()
    )
    return grid(
        ("role", "unit", "meaning", "a trial without it", "accepted by, in `degraded`"), rows
    )


def index() -> str:
    """Text of the index."""
    rows = (
        (f"[{page.title}]({page.file})", page.text.removesuffix(".").split(". ")[0])
        for page in pages()
    )
    return (
        "# Reference of the files\n\nMade by `make reference` from the models that read the files."
        " Files that a user writes are TOML; there an unknown key is an error that names the nearest known one.\n\n"
        + grid(("file", "content"), rows)
        + "\n\nA title such as `roles.NAME` stands for a table `[roles.rear_wheel_speed]`,"
        " `road[]` for each entry `[[road]]` of a list.\n"
    )


def texts() -> dict[str, str]:
    """Text of every file of the reference, by file name."""
    schemas = {f"{name}.schema.json": schema_text(name) for name in FILES}
    return {"README.md": index(), **{page.file: page.markdown() for page in pages()}, **schemas}


def write(folder: Path) -> None:
    """Write the reference into a folder, in place of the pages that are there."""
    folder.mkdir(parents=True, exist_ok=True)
    made = texts()
    for old in {*folder.glob("*.md"), *folder.glob("*.schema.json")} - {
        folder / name for name in made
    }:
        old.unlink()
    for name, text in made.items():
        (folder / name).write_text(text, encoding="utf-8")
