"""Kernels are made by one thread at a time: threads that parse Python at once disturb each other."""

import threading
import time
from concurrent.futures import ThreadPoolExecutor

from slipbench.identification.mismatch.systems import kernel


def test_threads_make_kernels_one_after_the_other(monkeypatch):
    """Regression: SystemError, "AST constructor recursion depth mismatch" (CPython issue 106905)."""
    making, most = [0], [0]
    lock = threading.Lock()

    def made(*_):
        with lock:
            making[0] += 1
            most[0] = max(most[0], making[0])
        time.sleep(0.02)
        with lock:
            making[0] -= 1
        return ""

    monkeypatch.setattr(kernel, "kernel_text", made)
    monkeypatch.setattr(kernel, "load", lambda text: text)
    monkeypatch.setattr(kernel, "effects_module", lambda: kernel)
    equations = [object() for _ in range(6)]
    with ThreadPoolExecutor(6) as pool:
        assert list(pool.map(kernel.compose, equations)) == [""] * 6
    assert most[0] == 1
