"""Processor time of each tick of the gateway in a trial on the simulated clock.

`python -m timing.tick TRIAL` prints it in ns, a tick a line. It measures the slipbench that
PYTHONPATH names, without garbage collection, as in the loop's process.
"""

import gc
import sys
import tempfile
import time
from pathlib import Path

from slipbench.bench.gateway.gateway import Gateway
from slipbench.bench.trials.preparation import prepare
from slipbench.bench.trials.run import run_trial
from slipbench.dbc import MOTORBIKE


def main(trial: Path) -> None:
    """Run the trial and print the times."""
    spent, tick = [], Gateway.tick

    def timed(gateway: Gateway, number: int, due: int) -> bool:
        begin = time.thread_time_ns()
        goes_on = tick(gateway, number, due)
        spent.append(time.thread_time_ns() - begin)
        return goes_on

    Gateway.tick = timed  # type: ignore[method-assign]
    prepared = prepare(trial, MOTORBIKE)
    gc.collect()
    gc.disable()
    with tempfile.TemporaryDirectory() as folder:
        outcome = run_trial(prepared, Path(folder) / "run", None)
    assert outcome.done, outcome.trip
    print(*spent, sep="\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
