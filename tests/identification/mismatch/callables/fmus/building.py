"""FMUs of the mass on a spring, compiled by the tests that need them."""

import platform
import shutil
import subprocess
import zipfile
from pathlib import Path

import numpy as np
import pytest

from slipbench.protocol.extras import optional_library
from slipbench.protocol.recording.import_log import Capture, import_capture
from tests.identification.mismatch.laws.spring import swung

HERE = Path(__file__).parent
PARAMETERS = {"gain": 0, "frequency": 1, "damping": 2, "start": 3}
FORCE, POSITION, VELOCITY, RATE, ACCELERATION, ORDER = range(4, 10)
UNITS = {"gain": "N/kg/V", "frequency": "rad/s", "damping": "1", "start": "m"}
STARTS = {"gain": 100.0, "frequency": 10.0, "damping": 0.1, "start": 0.0}
BESIDE = """
step = "10 ms"
period = "10 ms"
stretch = "1 s"
time_limit = "60 s"

[parameters]  # as in the model file of this spring
gain = { value = 100, unit = "N/kg/V", plus_minus = 20 }
frequency = { value = 10, unit = "rad/s", plus_minus = 1 }
damping = { value = 0.1, unit = "1", plus_minus = 0.05 }

[inputs.force]
role = "force"
size = { value = 1, unit = "V" }

[outputs.place]
role = "place"
variable = "position"
size = { value = 1, unit = "m" }
"""
WITHOUT_INPUT = BESIDE.replace(
    BESIDE[BESIDE.index("[inputs.force]") : BESIDE.index("[outputs.place]")],
    'start = { value = 0.5, unit = "m", plus_minus = 0.1 }\n\n',
)
ROLES = """
title = "spring"
[quantities]
force = "V"
place = "m"
[roles.force]
column = "force"
unit = "V"
[roles.place]
column = "place"
unit = "m"
"""
needs_compiler = pytest.mark.skipif(
    shutil.which("gcc") is None or platform.system() != "Linux",
    reason="FMUs are compiled with gcc, on Linux",
)


def build(folder: Path, version: int = 2, name: str = "spring", *defined: str) -> Path:
    """Compile and pack the spring. defined: macros, as in "CUBE=0.15"; returns its path."""
    text = description(version)
    if any(one.startswith("WALL") for one in defined):
        text = text.replace('numberOfEventIndicators="0"', 'numberOfEventIndicators="1"')
    sources = (f"spring{version}.c", f"others{version}.c")
    return packed(folder / f"{name}.fmu", version, sources, text, *defined)


def packed(path: Path, version: int, sources: tuple[str, ...], text: str, *defined: str) -> Path:
    """Compile C files of this folder to an FMU. text: its description, of the library `spring`."""
    pytest.importorskip("fmpy", reason="pip install 'slipbench[fmu]'")
    made = path.parent / f"{path.stem}-build"
    bits = "linux64" if version == 2 else "x86_64-linux"
    library = made / "binaries" / bits / "spring.so"
    library.parent.mkdir(parents=True)
    headers = Path(optional_library("fmpy").__file__).parent / "c-code"
    macros = [f"-D{one}" for one in defined]
    flags = ["-O2", "-shared", "-fPIC", *macros, f"-I{headers}"]
    files = [HERE / one for one in sources]
    subprocess.run(["gcc", *flags, *files, "-o", library, "-lm"], check=True)
    (made / "resources").mkdir()
    (made / "modelDescription.xml").write_text(text, encoding="utf-8")
    with zipfile.ZipFile(path, "w") as archive:
        for file in made.rglob("*"):
            archive.write(file, file.relative_to(made))
    return path


def with_file(fmu: Path, text: str = BESIDE) -> Path:
    """Write the model file of an FMU; returns the FMU."""
    fmu.with_suffix(".toml").write_text(text, encoding="utf-8")
    return fmu


def description(version: int) -> str:
    return DESCRIPTION2() if version == 2 else DESCRIPTION3()


def DESCRIPTION2() -> str:  # noqa: N802
    scalars = "\n".join(
        f'<ScalarVariable name="{name}" valueReference="{number}" {attributes}><Real {more}/>'
        "</ScalarVariable>"
        for name, number, attributes, more in _variables("derivative", 1)
    )
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Spring" guid="{{spring}}" numberOfEventIndicators="0">
<ModelExchange modelIdentifier="spring"/>
<CoSimulation modelIdentifier="spring" canHandleVariableCommunicationStepSize="true"/>
<UnitDefinitions><Unit name="V"><BaseUnit kg="1" m="2" s="-3" A="-1"/></Unit>
<Unit name="m"><BaseUnit m="1"/></Unit><Unit name="rad/s"><BaseUnit rad="1" s="-1"/></Unit>
</UnitDefinitions>
<ModelVariables>
{scalars}
<ScalarVariable name="order" valueReference="{ORDER}" causality="parameter" variability="fixed">
<Integer start="2"/></ScalarVariable>
</ModelVariables>
<ModelStructure>
<Outputs><Unknown index="6"/></Outputs>
<Derivatives><Unknown index="8"/><Unknown index="9"/></Derivatives>
<InitialUnknowns><Unknown index="6"/><Unknown index="8"/><Unknown index="9"/></InitialUnknowns>
</ModelStructure>
</fmiModelDescription>"""


def DESCRIPTION3() -> str:  # noqa: N802
    variables = "\n".join(
        f'<Float64 name="{name}" valueReference="{number}" {attributes} {more}/>'
        for name, number, attributes, more in _variables("derivative", 0)
    )
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="Spring" instantiationToken="{{spring}}">
<ModelExchange modelIdentifier="spring"/>
<CoSimulation modelIdentifier="spring" canHandleVariableCommunicationStepSize="true"/>
<UnitDefinitions><Unit name="V"><BaseUnit kg="1" m="2" s="-3" A="-1"/></Unit>
<Unit name="m"><BaseUnit m="1"/></Unit><Unit name="rad/s"><BaseUnit rad="1" s="-1"/></Unit>
</UnitDefinitions>
<ModelVariables>
{variables}
<UInt64 name="order" valueReference="{ORDER}" causality="structuralParameter" variability="fixed"
 start="2"/>
</ModelVariables>
<ModelStructure>
<Output valueReference="{POSITION}"/>
<ContinuousStateDerivative valueReference="{RATE}"/>
<ContinuousStateDerivative valueReference="{ACCELERATION}"/>
<InitialUnknown valueReference="{POSITION}"/>
</ModelStructure>
</fmiModelDescription>"""


def _variables(derivative: str, index: int) -> list[tuple[str, int, str, str]]:
    """Name, value reference, attributes, attributes of the type. index: 1 where FMI counts so."""
    fixed = 'causality="parameter" variability="fixed"'
    state = 'variability="continuous" initial="calculated"'
    ends = {"gain": 'min="0" max="1000"', "damping": 'min="0" max="1"'}
    found = [
        (n, k, fixed, f'start="{STARTS[n]}" unit="{UNITS[n]}" {ends.get(n, "")}')
        for n, k in PARAMETERS.items()
    ]
    at = [POSITION, VELOCITY] if index == 0 else [POSITION + 1, VELOCITY + 1]
    return [
        *found,
        ("force", FORCE, 'causality="input" variability="continuous"', 'start="0" unit="V"'),
        ("position", POSITION, f'causality="output" {state}', 'unit="m"'),
        ("velocity", VELOCITY, f'causality="local" {state}', 'unit="m/s"'),
        ("der(position)", RATE, f'causality="local" {state}', f'{derivative}="{at[0]}"'),
        ("der(velocity)", ACCELERATION, f'causality="local" {state}', f'{derivative}="{at[1]}"'),
    ]


def dead(force):
    return force - np.clip(force, -0.3, 0.3)


def recorded(folder, seed):
    """A run folder of a spring whose force has a dead zone."""
    recording = swung(seed, felt=dead)
    table, roles = folder / f"{seed}.csv", folder / "roles.toml"
    time, force, place = (
        recording.channels["force"].time,
        recording.channels["force"].value,
        recording.channels["place"].value,
    )
    rows = np.column_stack((time, force, place))
    np.savetxt(table, rows, delimiter=",", header="time,force,place", comments="")
    roles.write_text(ROLES, encoding="utf-8")
    import_capture(Capture(table, roles), folder / f"run{seed}")
    return folder / f"run{seed}"
