"""The file of a system and the run folders of an analysis, read and checked against each other."""

from collections.abc import Sequence
from pathlib import Path

from identification.mismatch.explain import Analysis, begin
from identification.mismatch.motorcycle.system import MotorcycleSystem
from identification.mismatch.system import System
from protocol.errors import InputError
from protocol.run_folder import read


def read_system(path: Path) -> System:
    """Load the file that tells the nominal simulation."""
    return MotorcycleSystem.load(path)


def open_analysis(file: Path, training: Sequence[Path], held_out: Sequence[Path]) -> Analysis:
    """Read everything. Raises InputError where it does not belong together."""
    both = {p.resolve() for p in training} & {p.resolve() for p in held_out}
    if both:
        raise InputError(
            "a held-out run is a training run as well, so it would prove nothing",
            where=", ".join(sorted(p.name for p in both)),
            remedy="hold out recordings that the analysis does not learn from",
        )
    system = read_system(file)
    records = [[system.prepare(read(p)) for p in paths] for paths in (training, held_out)]
    for record in (*records[0], *records[1]):
        system.check(record)
    return begin(system, *records)
