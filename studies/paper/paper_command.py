"""Reproduce the paper: trials, identification, sections, page."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from slipbench.identification.response.identify import identify
from slipbench.plant.errors import VehicleFileError
from slipbench.plant.vehicle_file import load_vehicle
from slipbench.protocol.errors import InputError
from slipbench.studies.paper.claims import Claim
from slipbench.studies.paper.context import Context
from slipbench.studies.paper.paper import paper
from slipbench.studies.paper.paper_document import write_document
from slipbench.studies.paper.paper_report import write_paper
from slipbench.studies.paper.paper_trials import PAPER, record_all


@dataclass(frozen=True)
class Reproduced:
    """Result: every claim, the answer to the paper's question, and the page."""

    claims: tuple[Claim, ...]
    answer: str
    page: Path


def reproduce(
    out: Path,
    runs: Path,
    nominal: Path,
    trials: Path,
    bandwidth: float,
    report: Callable[[str], None] = lambda _: None,
    document: Path | None = None,
) -> Reproduced:
    """Claims, answer and page; trials without a recording in `runs` are run first.

    bandwidth: w_c of the throttle servo, Hz. report: called with each step's description. document:
    Markdown page to write as well. Raises InputError where the vehicle file is invalid, or a trial
    cannot be run or trips.
    """
    try:
        vehicle = load_vehicle(nominal)
    except VehicleFileError as fault:
        raise InputError(str(fault)) from fault
    recordings = record_all(list(PAPER), runs, trials, lambda name: report(f"recorded {name}"))
    found = {}
    for name, recording in recordings.items():
        report(f"identifying {name}")
        found[name] = identify(recording)
    report("evaluating the claims")
    context = Context(vehicle.motorcycle, 2 * math.pi * bandwidth, vehicle.plus_minus)
    made = paper(found, context)
    page = write_paper(made, recordings, out)
    if document is not None:
        write_document(made, document)
    return Reproduced(made.claims, made.answer, page)
