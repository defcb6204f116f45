"""`make other-fmus`: FMUs of other tools read, simulated and explained; writes docs/other_fmus.md.

    python -m benchmarks.other_fmus.run [CASE... | page]

Without a name all is done; `page` writes the page alone. Results stay in build/other_fmus/results; the page is made from them. Where
the packages with the FMUs cannot be had, it says so and leaves the page as it is.
"""

import json
import sys
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from benchmarks.other_fmus.cases import CASES
from benchmarks.other_fmus.comparison import compared
from benchmarks.other_fmus.explained import explained
from benchmarks.other_fmus.fetch import FMUS, FOLDER, AbsentError, fetch
from benchmarks.other_fmus.page import page
from slipbench.identification.mismatch.callables.fmu.unpacked import INTERFACES, unpacked

RESULTS = FOLDER / "results"
PAGE = Path("docs/other_fmus.md")


def main(requested: list[str]) -> None:
    """Run the requested cases, all where none is named, and write the page."""
    known = [*(case.name for case in CASES), "page"]
    if unknown := [name for name in requested if name not in known]:
        sys.exit(f"no such case: {', '.join(unknown)}; expected: {', '.join(known)}")
    try:
        fetch()
    except AbsentError as reason:
        print(f"skipped, {PAGE} stays as it is: {reason}")
        return
    RESULTS.mkdir(parents=True, exist_ok=True)
    if not requested:
        _keep("simulated", [simulated(one) for one in FMUS])
    for case in CASES:
        if not requested or case.name in requested:
            result = explained(case)
            _keep(case.name, result)
            named = ", ".join(result.get("named", [])) or "nothing"
            print(f"{case.title}: {result.get('problem', named)}", flush=True)
    PAGE.write_text(page(_kept("simulated") or [], _by_case()), encoding="utf-8")


def simulated(one: Any) -> dict[str, Any]:
    """Return what an FMU is, and how its simulation compares with that of fmpy."""
    fmu = unpacked(one.path)
    description = fmu.description
    types = sorted({v.type for v in description.modelVariables})
    return {
        "name": one.name,
        "tool": str(description.generationTool),
        "version": fmu.version,
        "interfaces": [name for name, own in INTERFACES.items() if getattr(description, own)],
        "types": types,
        "arrays": any(v.dimensions for v in description.modelVariables),
        "compared": [asdict(c) for c in compared(one)],
    }


def _by_case() -> dict[str, Any]:
    found: Iterable[tuple[str, Any]] = ((case.name, _kept(case.name)) for case in CASES)
    return {name: result for name, result in found if result is not None}


def _keep(name: str, result: Any) -> None:
    (RESULTS / f"{name}.json").write_text(json.dumps(result, indent=1), encoding="utf-8")


def _kept(name: str) -> Any:
    path = RESULTS / f"{name}.json"
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else None


if __name__ == "__main__":
    main(sys.argv[1:])
