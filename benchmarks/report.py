"""Time of `slipbench identify` from run folder to report, for a trial of 60 s.

`python benchmarks/report.py` runs a throttle sweep of 60 s on the simulated clock, over CAN, and
identifies it twice: the second time all compiled code is cached. Limit: 10 s on two cores.
"""

import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parents[1]
LIMIT = 10.0  # s


def command(*arguments: str) -> tuple[float, float]:
    """Run a sub-command of this checkout. Returns wall and processor time, s."""
    begun, used = time.perf_counter(), os.times()
    subprocess.run(
        [sys.executable, "-m", "slipbench", *arguments],
        cwd=ROOT,
        check=True,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    now = os.times()
    spent = now.children_user + now.children_system - used.children_user - used.children_system
    return time.perf_counter() - begun, spent


def main() -> None:
    """Print the times."""
    with tempfile.TemporaryDirectory() as folder:
        text = (ROOT / "examples" / "trials" / "throttle_sweep.toml").read_text(encoding="utf-8")
        text = re.sub(r'duration = "[^"]+"', 'duration = "60 s"', text)
        text = re.sub(r'distance = "[^"]+"', 'distance = "5000 m"', text)
        vehicle = ROOT / "plant" / "vehicles" / "demonstration.toml"
        text = re.sub(r'vehicle = "[^"]+"', f'vehicle = "{vehicle}"', text)
        trial = Path(folder) / "sweep_60_s.toml"
        trial.write_text(text, encoding="utf-8")
        run = Path(folder) / "run"
        print(f"trial of 60 s over CAN: {command('trial', str(trial), '--out', str(run))[0]:.1f} s")
        command("identify", str(run))
        wall, used = command("identify", str(run))
        spent = f"{wall:.1f} s, {used:.1f} s of processor"
        print(f"run folder to full report: {spent} (limit {LIMIT:g} s)")


if __name__ == "__main__":
    main()
