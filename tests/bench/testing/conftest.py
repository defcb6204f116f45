"""An inner pytest with the plugin of slipbench, as a user has it."""

from collections.abc import Callable
from importlib.metadata import entry_points

import pytest

# Imported before the inner runs, which forget what they import.
from slipbench.bench.testing import report_page, setup  # noqa: F401
from slipbench.plant.compiled import cache_folder

CACHE = str(cache_folder())  # of compiled equations; pytester has a home folder of its own
PLUGIN = "slipbench.bench.testing.plugin"

Run = Callable[..., pytest.RunResult]


def plugin_options() -> list[str]:
    """Options that load the plugin, where the installation does not."""
    installed = any(each.value == PLUGIN for each in entry_points(group="pytest11"))
    return [] if installed else ["-p", PLUGIN]


@pytest.fixture
def run(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Run the text of a test file with the plugin; options follow."""
    monkeypatch.setenv("SLIPBENCH_CACHE", CACHE)

    def run_text(text: str, *options: str) -> pytest.RunResult:
        pytester.makepyfile(text)
        return pytester.runpytest_inprocess(*plugin_options(), "-p", "no:cacheprovider", *options)

    return run_text
