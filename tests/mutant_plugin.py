"""A pytest plugin that runs the tests once for each mutant, in forks of the process that collected them.

mutmut writes every mutant of a function beside it, behind a switch. mutmut's own runner starts
pytest anew for each mutant, which costs more than most of the tests here do. A fork has everything
imported and nothing cached: the clean run, which finds which tests reach which function, is a fork
as well.

`--mutants FILE`: a list of mutants, JSON. FILE.codes gets a line for each, its name and exit code:
0 it survives, 1 a test failed, 3 pytest failed, 33 no test reaches it, negative a signal (-24: more
processor time than ten times the clean run's and 10 s).
"""

import json
import math
import os
import resource
import signal
import time
from collections import defaultdict
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest
from _pytest.runner import runtestprotocol
from mutmut.mutation import trampoline

FAILED, BROKEN, UNREACHED = 1, 3, 33
MOST_SECONDS = 600  # of wall time, for one that sleeps


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the two options."""
    parser.addoption("--mutants", type=Path, help="JSON list of mutants")
    parser.addoption("--mutant-workers", type=int, default=1, help="forks at once")


def pytest_runtestloop(session: pytest.Session) -> bool:
    """Run the clean tests, then each mutant's. Ends where a file of tests cannot be imported."""
    if session.testsfailed:
        raise session.Interrupted("a file of tests cannot be imported")
    file: Path = session.config.getoption("--mutants")
    reached = file.with_suffix(".reached")
    trampoline.set_mutant_under_test("stats")
    _wait({_fork(lambda: _clean(session.items, reached)): "clean"}, stop=True)
    tests = json.loads(reached.read_text(encoding="utf-8"))
    running: dict[int, str] = {}
    with file.with_suffix(".codes").open("w", encoding="utf-8", buffering=1) as codes:
        for mutant in json.loads(file.read_text(encoding="utf-8")):
            times = tests.get(mutant.rpartition("__mutmut_")[0], {})
            if not times:
                codes.write(f"{mutant} {UNREACHED}\n")
                continue
            while len(running) >= session.config.getoption("--mutant-workers"):
                codes.write(_wait(running))
            items = [session.items[int(index)] for index in sorted(times, key=times.__getitem__)]
            limit = math.ceil(10.0 + 10.0 * sum(times.values()))
            running[_fork(lambda m=mutant, i=items, n=limit: _mutated(m, i, n))] = mutant
        while running:
            codes.write(_wait(running))
    return True


def _fork(run: Callable[[], int]) -> int:
    """Process id of a child that runs `run` and exits with what it returns."""
    child = os.fork()
    if child:
        return child
    code = BROKEN
    try:
        code = run()
    finally:
        os._exit(code)


def _wait(running: dict[int, str], *, stop: bool = False) -> str:
    """Line with the exit code of the child that ends next; it is taken out of `running`."""
    child, status = os.wait()
    code = os.waitstatus_to_exitcode(status)
    if stop and code:
        pytest.exit("the tests fail without a mutant", returncode=1)
    return f"{running.pop(child)} {code}\n"


def _clean(items: Sequence[pytest.Item], reached: Path) -> int:
    """Run every test; write, by function, the tests that reach it and their processor time."""
    hits: set[str] = set()
    trampoline.record_trampoline_hit = lambda name, caller=None: hits.add(name)
    tests: dict[str, dict[int, float]] = defaultdict(dict)
    for index, item in enumerate(items):
        hits.clear()
        began = time.process_time()
        if not _passes(item):
            os.write(2, f"{item.nodeid} fails\n".encode())
            return FAILED
        for name in hits:
            tests[name][index] = time.process_time() - began
    reached.write_text(json.dumps(tests), encoding="utf-8")
    return 0


def _mutated(mutant: str, items: Sequence[pytest.Item], limit: int) -> int:
    trampoline.set_mutant_under_test(mutant)
    resource.setrlimit(resource.RLIMIT_CPU, (limit, limit + 1))
    signal.alarm(MOST_SECONDS)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.dup2(nowhere, 2)
    return 0 if all(_passes(item) for item in items) else FAILED


def _passes(item: Any) -> bool:
    """Whether a test passes or skips, its fixtures set up for it alone."""
    return not any(report.failed for report in runtestprotocol(item, log=False, nextitem=None))
