"""Laws of the kernel's cache: its place can be chosen, and a text is compiled once."""

import os
import platform
import re
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from slipbench.plant.compiled import (
    cache_folder,
    entry,
    inlined,
    load,
    made_once,
    text_of,
    unsigned,
)

ADD_ROWS = """
def add_rows(w, table, first, second, n):
    for c in range(n):
        w[first + c] += 2.0 * w[second + c] + table[c, 1] + w[0]
"""

PROGRAM = """
from slipbench.plant.compiled import entry, load
module = load(entry("def twice(x):\\n    return 2.0 * x", "f8(f8)"))
print(module.twice(21.0), sum(module.twice.stats.cache_hits.values()))
"""


def triple(x: float) -> float:
    """Docstring, annotations and comments do not belong to the compiled text."""
    return 3.0 * x  # nor does this


def started(folder: Path) -> subprocess.Popen[str]:
    root = Path(__file__).parents[2]
    env = {**os.environ, "SLIPBENCH_CACHE": str(folder), "PYTHONPATH": str(root)}
    return subprocess.Popen([sys.executable, "-c", PROGRAM], env=env, stdout=-1, text=True)


def test_several_processes_at_once_compile_once(tmp_path):
    running = [started(tmp_path) for _ in range(2)]
    told = sorted(process.communicate(timeout=60)[0].split()[-1] for process in running)
    assert told == ["0", "1"]
    assert len(list(tmp_path.glob("slipbench_*.py"))) == 1
    assert not list(tmp_path.glob("*.tmp"))


def test_the_folder_follows_the_environment(tmp_path, monkeypatch):
    monkeypatch.setenv("SLIPBENCH_CACHE", str(tmp_path / "deep" / "folder"))
    assert cache_folder() == tmp_path / "deep" / "folder"
    assert cache_folder().is_dir()


def test_a_folder_that_cannot_be_made_is_told_with_a_remedy(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("SLIPBENCH_CACHE", str(tmp_path / "file" / "below"))
    with pytest.raises(OSError, match="set SLIPBENCH_CACHE"):
        cache_folder()


def test_the_text_is_bare(tmp_path, monkeypatch):
    monkeypatch.setenv("SLIPBENCH_CACHE", str(tmp_path))
    assert text_of(triple, "thrice") == "def thrice(x):\n    return 3.0 * x"
    text = inlined(text_of(triple)) + entry("def nine(x):\n    return triple(triple(x))", "f8(f8)")
    module = load(text)
    assert module.nine(1.0) == 9.0
    assert load(text) is module


@pytest.mark.skipif(platform.machine() != "x86_64", reason="reads the assembler of x86-64")
def test_loops_over_rows_of_one_array_are_vectorized(tmp_path, monkeypatch):
    """With signed indices this loop has no packed operation."""
    monkeypatch.setenv("SLIPBENCH_CACHE", str(tmp_path))
    module = load(entry(ADD_ROWS, "void(f8[::1],f8[:,::1],i8,i8,i8)"))
    assert re.search(
        r"v?fmadd\w+pd|v?mulpd|v?addpd", "".join(module.add_rows.inspect_asm().values())
    )
    w, table = np.arange(200.0), np.ones((40, 2))
    expected = w[100:140] + 2.0 * w[10:50] + 1.0
    module.add_rows(w, table, 100, 10, 40)
    np.testing.assert_array_equal(w[100:140], expected)
    np.testing.assert_array_equal(w[:100], np.arange(100.0))


def test_constants_and_slices_keep_their_sign():
    kept = "a[0] + a[1:n] + b[:, 2]"
    assert unsigned(kept) == kept
    assert unsigned("a[i]") == "a[np.uint64(i)]"
    assert unsigned("a[i, 0] + a[b[j]]") == "a[np.uint64(i), 0] + a[np.uint64(b[np.uint64(j)])]"


def test_threads_wait_for_a_module_that_another_one_loads(tmp_path, monkeypatch):
    """A module is among the loaded ones before its code has run."""
    monkeypatch.setenv("SLIPBENCH_CACHE", str(tmp_path))
    text = f"import time\ntime.sleep(0.3)\nready = {str(tmp_path)!r}\n"
    with ThreadPoolExecutor(4) as pool:
        assert {m.ready for m in pool.map(load, [text] * 4)} == {str(tmp_path)}


def test_one_thread_at_a_time_makes_a_kernel_from_text():
    """Parsers of two threads disturb each other."""
    running, most = [], []

    def make(number):
        running.append(number)
        most.append(len(running))
        time.sleep(0.02)
        running.remove(number)
        return ModuleType(f"made_{number}")

    one = made_once(make)
    with ThreadPoolExecutor(4) as pool:
        made = list(pool.map(one, [1, 2, 1, 3]))
    assert max(most) == 1
    assert len(most) == 3
    assert made[0] is made[2]
