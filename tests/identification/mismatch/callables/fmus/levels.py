"""The FMU of two levels: its description, its file, and recordings of its exact solution."""

from pathlib import Path

import numpy as np
from scipy import linalg

from slipbench.protocol.recording.channel import Channel
from slipbench.protocol.recording.recording import Recording
from slipbench.protocol.recording.role_map import RoleMap, Source
from tests.identification.mismatch.callables.fmus.building import packed

PERIOD = 0.05  # s
COUPLED = np.array([[1.2, -0.7], [0.1, 0.6]])  # K, 1/s
CLOCK = '<Clock name="tick" valueReference="30" causality="input" intervalVariability="triggered"/>'
CLOCKED = """<Float64 name="sampled" valueReference="31" causality="output" variability="discrete"
 clocks="32"/><Clock name="own" valueReference="32" causality="output"
 intervalVariability="triggered"/>"""
DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="Levels" instantiationToken="{levels}">
<ModelExchange modelIdentifier="spring"/>
<CoSimulation modelIdentifier="spring" canHandleVariableCommunicationStepSize="true"/>
<TypeDefinitions><EnumerationType name="Mode"><Item name="slow" value="1"/><Item name="fast" value="2"/>
</EnumerationType></TypeDefinitions>
<ModelVariables>
<Float64 name="time" valueReference="0" causality="independent"/>
<UInt64 name="n" valueReference="20" causality="structuralParameter" variability="fixed" start="2"/>
<Float64 name="K" valueReference="1" causality="parameter" variability="fixed" start="1 0 0 1">
<Dimension valueReference="20"/><Dimension start="2"/></Float64>
<Float64 name="u" valueReference="2" causality="input" start="1"><Dimension start="2"/></Float64>
<Float64 name="x" valueReference="3" causality="output" initial="exact" start="0 0">
<Dimension start="2"/></Float64>
<Float64 name="der(x)" valueReference="4" causality="local" derivative="3"><Dimension start="2"/>
</Float64>
<Boolean name="open" valueReference="5" causality="input" start="true"/>
<Int32 name="gear" valueReference="6" causality="input" start="1"/>
<UInt8 name="events" valueReference="7" causality="output"/>
<Float32 name="single" valueReference="8" causality="output"/>
<Float64 name="pulse" valueReference="9" causality="parameter" variability="fixed" start="1e9"/>
<Enumeration name="mode" declaredType="Mode" valueReference="10" causality="parameter"
 variability="fixed" start="1"/>
<String name="label" valueReference="11" causality="input"><Start value="none"/></String>
</ModelVariables>
<ModelStructure>
<Output valueReference="3"/><Output valueReference="7"/><Output valueReference="8"/>
<ContinuousStateDerivative valueReference="4"/>
<InitialUnknown valueReference="4"/><InitialUnknown valueReference="7"/>
<InitialUnknown valueReference="8"/>
</ModelStructure>
</fmiModelDescription>"""
BESIDE = """
step = "5 ms"
period = "50 ms"
stretch = "1 s"

[parameters]
k11 = { variable = "K[1,1]", value = 1.2, plus_minus = 0.2 }
k12 = { variable = "K[1,2]", value = -0.7, plus_minus = 0.2 }
k21 = { variable = "K[2,1]", value = 0.1, plus_minus = 0.05 }
k22 = { variable = "K[2,2]", value = 0.6, plus_minus = 0.1 }

[inputs.first]
variable = "u[1]"
role = "first"
size = { value = 1 }

[outputs.upper]
variable = "x[1]"
role = "upper"
size = { value = 1 }

[outputs.lower]
variable = "x[2]"
role = "lower"
size = { value = 1 }
"""
ROLES = ("first", "open", "upper", "lower")


def build(folder: Path, name: str = "levels", more: str = "") -> Path:
    """Compile and pack the levels. more: variables of the description; returns its path."""
    text = DESCRIPTION.replace("</ModelVariables>", f"{more}</ModelVariables>")
    return packed(folder / f"{name}.fmu", 3, ("levels3.c", "levels_others3.c"), text)


def recorded(seed: int, rates: np.ndarray, sensed=lambda x: x, noise: float = 3e-3) -> Recording:
    """Record both levels while the first is filled at random. sensed: sensor of the second."""
    print(f"seed {seed}")
    rng = np.random.default_rng(seed)
    first = np.repeat(rng.uniform(0.0, 2.0, 61), 10)[:601]
    opened = np.repeat(rng.uniform(0.0, 1.0, 41) < 0.7, 15)[:601].astype(float)
    levels = solution(rates, np.column_stack((first, np.ones(601))) * opened[:, None])[:-1]
    levels = np.concatenate((np.zeros((1, 2)), levels))
    columns = {"first": first, "open": opened, "upper": levels[:, 0], "lower": sensed(levels[:, 1])}
    for role in ("upper", "lower"):
        columns[role] = columns[role] + noise * rng.standard_normal(601)
    time = PERIOD * np.arange(601)
    roles = {role: Source(column=role, unit="1") for role in ROLES}
    channels = {r: Channel(r, time, y, "1", "bus", "made") for r, y in columns.items()}
    described = RoleMap(title="levels", quantities=dict.fromkeys(ROLES, "1"), roles=roles)
    return Recording(Path(f"levels{seed}"), {}, None, described, channels, {})


def solution(rates: np.ndarray, inputs: np.ndarray, start=(0.0, 0.0)) -> np.ndarray:
    """Levels at the ends of rows, (rows, 2), for held inputs (rows, 2). rates: K, (2, 2)."""
    block = np.zeros((4, 4))
    block[:2, :2], block[:2, 2:] = -rates, np.eye(2)
    step = linalg.expm(PERIOD * block)
    found, x = [], np.array(start)
    for u in inputs:
        x = step[:2, :2] @ x + step[:2, 2:] @ u
        found.append(x)
    return np.array(found)
