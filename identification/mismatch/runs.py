"""The file of a system and the run folders of an analysis, read and checked against each other."""

from collections.abc import Sequence
from pathlib import Path

from identification.mismatch.explain import Analysis, begin
from identification.mismatch.motorcycle.system import MotorcycleSystem
from identification.mismatch.piece import Piece
from identification.mismatch.system import System
from identification.mismatch.systems.system import ModelSystem
from protocol.configuration import load_toml
from protocol.errors import InputError


def read_system(path: Path) -> System:
    """Load the file that tells the nominal simulation: a model file has outputs, a vehicle none."""
    if "outputs" in load_toml(path):
        return ModelSystem.load(path)
    return MotorcycleSystem.load(path)


def open_analysis(file: Path, training: Sequence[Path], held_out: Sequence[Path]) -> Analysis:
    """Read everything. Raises InputError where it does not belong together."""
    learnt, proof = ([Piece.of(p) for p in paths] for paths in (training, held_out))
    both = [a for a in learnt for b in proof if a.meets(b)]
    if both:
        raise InputError(
            "a held-out run is a training run as well, so it would prove nothing",
            where=", ".join(sorted(p.folder.name for p in both)),
            remedy="hold out recordings, or pieces of them, that the analysis does not learn from",
        )
    system = read_system(file)
    records = [[system.prepare(p.read()) for p in pieces] for pieces in (learnt, proof)]
    for record in (*records[0], *records[1]):
        system.check(record)
    return begin(system, *records)
