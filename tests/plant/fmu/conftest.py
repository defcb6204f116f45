"""FMUs of the demonstration motorcycle, written once, and one instance of them at a time."""

import contextlib
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from slipbench.plant.fmu.export import write_fmu
from slipbench.plant.fmu.model import FmuModel, model_at
from slipbench.plant.motorcycle import Motorcycle
from slipbench.plant.simulation import Simulation
from slipbench.protocol.extras import optional_library

STEP, CRANK_SPEED = 0.25e-3, 1466.0  # s, rad/s


@pytest.fixture(scope="session")
def headers() -> Path:
    if shutil.which("cc") is None:
        pytest.skip("an FMU is linked by a C compiler")
    fmpy = pytest.importorskip("fmpy", reason="pip install 'slipbench[fmu]'")
    return Path(fmpy.__file__).parent / "c-code"


@pytest.fixture(scope="session")
def model(demonstration: Motorcycle) -> FmuModel:
    return model_at("demonstration", Simulation(demonstration, STEP), 2, CRANK_SPEED)


@pytest.fixture(scope="session", params=[2, 3], ids=["FMI 2.0", "FMI 3.0"])
def fmu(
    request: pytest.FixtureRequest,
    headers: Path,
    model: FmuModel,
    tmp_path_factory: pytest.TempPathFactory,
) -> Path:
    path = tmp_path_factory.mktemp("fmu") / f"motorcycle{request.param}.fmu"
    write_fmu(path, model, request.param, headers)
    return path


class Slave:
    """An instance with variables by name; `said` holds what it logged."""

    def __init__(self, path: Path, folder: Path) -> None:
        fmpy = optional_library("fmpy")
        self.description = fmpy.read_model_description(str(path))
        self.version = self.description.fmiVersion[0]
        self.references = {v.name: v.valueReference for v in self.description.modelVariables}
        self.said: list[str] = []
        module = optional_library(f"fmpy.fmi{self.version}")
        self.slave: Any = getattr(module, f"FMU{self.version}Slave")(
            guid=self.description.guid or self.description.instantiationToken,
            unzipDirectory=fmpy.extract(str(path), str(folder)),
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName="one",
        )
        self.begin()

    def begin(self) -> None:
        if self.version == "3":
            self.slave.instantiate(logMessage=self._keep)
        else:
            self.slave.instantiate(callbacks=None)

    def _keep(self, _: Any, __: int, ___: bytes, message: bytes) -> None:
        self.said.append(message.decode())

    def initialize(self, **values: float) -> None:
        for name, value in values.items():
            self.set(name, value)
        if self.version == "2":
            self.slave.setupExperiment(startTime=0.0)
        self.slave.enterInitializationMode()
        self.slave.exitInitializationMode()

    def set(self, name: str, value: float) -> None:
        set_real = self.slave.setReal if self.version == "2" else self.slave.setFloat64
        set_real([self.references[name]], [value])

    def get(self, name: str) -> float:
        get_real = self.slave.getReal if self.version == "2" else self.slave.getFloat64
        return float(get_real([self.references[name]])[0])

    def step(self, time: float, step: float = 1e-3) -> None:
        self.slave.doStep(time, step)


@pytest.fixture
def slave(fmu: Path, tmp_path: Path) -> Iterator[Callable[[], Slave]]:
    made: list[Slave] = []

    def make() -> Slave:
        made.append(Slave(fmu, tmp_path / f"instance{len(made)}"))
        return made[-1]

    yield make
    for one in made:
        with contextlib.suppress(Exception):
            one.slave.freeInstance()
