"""Read the system file and the run folders of an analysis, and check their consistency."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from slipbench.identification.mismatch.analysis import Analysis, begin
from slipbench.identification.mismatch.callables.fmu.fmu_file import is_of_an_fmu
from slipbench.identification.mismatch.callables.fmu.fmu_system import load_fmu_system
from slipbench.identification.mismatch.motorcycle.system import MotorcycleSystem
from slipbench.identification.mismatch.simulation.piece import Piece
from slipbench.identification.mismatch.simulation.record import Record
from slipbench.identification.mismatch.simulation.system import System
from slipbench.identification.mismatch.systems.system import ModelSystem
from slipbench.protocol.configuration import load_toml
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.recording import Recording


def read_system(path: Path) -> System:
    """Load the file of the nominal simulation: an FMU, the file beside it, a model or vehicle file.

    A model file is recognized by the key `outputs`, which the file beside an FMU has too.
    """
    if is_of_an_fmu(path):
        return load_fmu_system(path)
    if "outputs" in load_toml(path):
        return ModelSystem.load(path)
    return MotorcycleSystem.load(path)


def open_analysis(file: Path, training: Sequence[Path], held_out: Sequence[Path]) -> Analysis:
    """Read the system and all runs. Raises InputError where they are inconsistent."""
    training_pieces, held_out_pieces = (
        [Piece.of(p) for p in paths] for paths in (training, held_out)
    )
    overlapping = [a for a in training_pieces for b in held_out_pieces if a.meets(b)]
    if overlapping:
        raise InputError(
            "a held-out run is a training run as well: it cannot validate the result",
            where=", ".join(sorted(p.folder.name for p in overlapping)),
            remedy="hold out recordings, or segments of them, that are not used for training",
        )
    system = read_system(file)
    return analysis_of(
        system, *([p.read() for p in pieces] for pieces in (training_pieces, held_out_pieces))
    )


def analysis_of(
    system: System, training: Sequence[Recording], held_out: Sequence[Recording]
) -> Analysis:
    """Begin an analysis of recordings. Raises InputError where they do not fit the system."""
    records = [[system.prepare(r) for r in recordings] for recordings in (training, held_out)]
    for record in (*records[0], *records[1]):
        system.check(record)
    _reject_copies(*records)
    analysis = begin(system, *records)
    analysis.runs = tuple(str(recording.folder) for recording in (*training, *held_out))
    return analysis


def _reject_copies(training: Sequence[Record], held_out: Sequence[Record]) -> None:
    """Reject a held-out recording that is a copy of a training recording."""
    for held_out_record in held_out:
        for training_record in training:
            if same_recording(held_out_record, training_record):
                raise InputError(
                    "a held-out run is a copy of a training run: it cannot validate the result",
                    where=held_out_record.name,
                    found=f"the same samples as {training_record.name}",
                    remedy="hold out recordings that are not used for training",
                )


def same_recording(a: Record, b: Record) -> bool:
    """Return whether two recordings hold the same samples."""
    shared = a.sensors.keys() & b.sensors.keys()
    return bool(shared) and all(
        np.array_equal(a.sensors[s].value, b.sensors[s].value) for s in shared
    )
