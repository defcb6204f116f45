"""Let python-can's own test-suite judge our bus: fetch it, run it, and name all that it skips.

The suite comes from python-can's source distribution, of the version that is installed, with the
hash that requirements.lock has for it. Its tests of buses, logs, player and synchronisation run as
they are, and those that can be given another interface run on "slipbench" (`on_slipbench.py`).
Some of them skip themselves on CI servers; they are told that this is none.

    python -m tests.conformance.judge        needs pip's index, unless build/conformance is filled

Exit status 1 where a test fails, one skips that is not expected to, or a group did not run.
"""

import os
import re
import subprocess
import sys
import tarfile
from collections import Counter
from importlib.metadata import version
from pathlib import Path
from xml.etree import ElementTree

from tests.paths import ROOT

HERE = Path(__file__).parent
BUILD = ROOT / "build" / "conformance"
THEIRS = ("logformats_test.py", "test_player.py", "test_message_sync.py")  # as they are
LIMIT = 600.0  # s for all of it; it takes about one minute
CI_MARKS = ("CI", "CONTINUOUS_INTEGRATION", "GITHUB_ACTIONS", "TRAVIS")

# Groups on our bus that must have been judged, whatever the suite's next version calls its own.
WANTED = (
    "TestBackToBack",
    "TestThreadSafe",
    "TestLogOfTheBus",
    "TestPlayer",
    "TestPlayerOfCompressedFile",
)

# Skips that are right, by the reason that the suite gives.
EXPECTED = {
    "TODO: how shall this be treated if sending messages locally? should be done uniformly": "open between python-can's own interfaces",
    "not implemented": "python-can's SQLite log in a file-like object",
    "do not test append mode": "formats of python-can that cannot append",
}


def main() -> int:
    """Fetch, run, report."""
    fetch()
    results = BUILD / "results.xml"
    status = run(results)
    unexpected = report(results)
    return 1 if status or unexpected else 0


def fetch() -> None:
    """Lay the suite and what it needs into build/conformance; nothing where it is there."""
    wanted = f"python-can=={version('python-can')}"
    done = BUILD / "fetched"
    if done.exists() and done.read_text(encoding="utf-8") == wanted:
        return
    BUILD.mkdir(parents=True, exist_ok=True)
    locked = BUILD / "python-can.txt"
    locked.write_text(locked_with_hashes(wanted), encoding="utf-8")
    pip("download", "--no-deps", "--no-binary", "python-can", "--dest", BUILD, "-r", locked)
    needs = HERE / "requirements.txt"
    pip("install", "--no-deps", "--upgrade", "--target", BUILD / "needs", "-r", needs)
    [archive] = BUILD.glob(f"python_can-{version('python-can')}.tar.gz")
    with tarfile.open(archive) as source:
        members = [each for each in source if "/test/" in each.name]
        for each in members:
            each.name = each.name.partition("/")[2]
        source.extractall(BUILD / "suite", members, filter="data")
    done.write_text(wanted, encoding="utf-8")


def locked_with_hashes(wanted: str) -> str:
    """Give the lines that requirements.lock has for one requirement."""
    lock = (ROOT / "requirements.lock").read_text(encoding="utf-8")
    found = re.search(rf"^{re.escape(wanted)} \\\n(    --hash=\S+( \\)?\n)+", lock, re.MULTILINE)
    if found is None:
        sys.exit(f"requirements.lock has no {wanted}, which is installed; run: make setup")
    return found.group()


def pip(*arguments: str | Path) -> None:
    """Run pip; every file must have a hash that is known."""
    common = ("--quiet", "--disable-pip-version-check", "--require-hashes")
    command, *rest = arguments
    subprocess.run([sys.executable, "-m", "pip", command, *common, *rest], check=True)


def run(results: Path) -> int:
    """Run the suite, with results as JUnit XML; returns pytest's exit status."""
    environment = {name: value for name, value in os.environ.items() if name not in CI_MARKS}
    environment["PYTHONPATH"] = os.pathsep.join(
        str(path)
        for path in (BUILD / "suite", ROOT, BUILD / "needs", os.environ.get("PYTHONPATH", ""))
        if str(path)
    )
    suite = [BUILD / "suite" / "test" / name for name in THEIRS]
    command = [
        sys.executable,
        "-m",
        "pytest",
        "--quiet",
        "-p",
        "no:cacheprovider",
        "-c",
        os.devnull,
        "--rootdir",
        BUILD,
        "--import-mode=importlib",
        "--timeout=60",
        f"--junit-xml={results}",
        HERE / "on_slipbench.py",
        *suite,
    ]
    try:
        return subprocess.run(
            command, cwd=BUILD, env=environment, check=False, timeout=LIMIT
        ).returncode
    except subprocess.TimeoutExpired:
        sys.exit(f"the suite has not ended within {LIMIT:g} s: a test of it hangs")


def report(results: Path) -> list[str]:
    """Print what was judged and name every skip.

    Returns the skips that nobody expected, and the groups on our bus of which no test passed.
    """
    cases = list(ElementTree.parse(results).getroot().iter("testcase"))
    tally: dict[str, Counter[str]] = {}
    skips: dict[str, list[str]] = {}
    for case in cases:
        group = case.get("classname", "").removeprefix(".")
        outcome = case[0].tag if len(case) and case[0].tag in ("skipped", "failure") else "passed"
        outcome = "error" if case.find("error") is not None else outcome
        tally.setdefault(group, Counter())[outcome] += 1
        if outcome == "skipped":
            skips.setdefault(case[0].get("message", ""), []).append(f"{group}.{case.get('name')}")
    total = sum(tally.values(), Counter())
    print(f"python-can {version('python-can')}, {total.total()} tests: {words(total)}")
    for group, counts in sorted(tally.items()):
        print(f"{group}: {words(counts)}")
    for reason, names in sorted(skips.items()):
        why = EXPECTED.get(reason, "NOT EXPECTED")
        print(f"skipped {len(names)}: {reason} ({why})")
        print("  " + "\n  ".join(sorted(names)))
    unjudged = [f"{group}: no test of it ran" for group in WANTED if not tally[group]["passed"]]
    print("".join(f"{each}\n" for each in unjudged), end="")
    return [*unjudged, *(reason for reason in skips if reason not in EXPECTED)]


def words(counts: "Counter[str]") -> str:
    """Say how many tests ended how."""
    return ", ".join(f"{n} {what}" for what, n in sorted(counts.items()))


if __name__ == "__main__":
    sys.exit(main())
