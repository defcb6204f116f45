"""Which file may import which library: what import-linter has no words for."""

import ast
from collections.abc import Iterator
from pathlib import Path

PACKAGES = (
    "dbc",
    "examples",
    "protocol",
    "plant",
    "controllers",
    "bench",
    "identification",
    "studies",
)

# A library, and the files that may import it.
ALLOWED = {
    # The bus and logs of it.
    "can": (
        "protocol/logs/*.py",
        "bench/bus/opening.py",
        "bench/check/*.py",
        "bench/gateway/gateway.py",
        "bench/gateway/gateway_bus.py",
        "bench/bus/simulated_bus.py",
        "bench/loop/loop_process.py",
        "bench/vehicle/virtual_motorcycle.py",
        "bench/vehicle/port.py",
        "bench/replay/replay.py",
        "bench/bus/messages.py",
        "bench/bus/python_can.py",
        "bench/gateway/controller_state.py",
        "bench/replay/replay_process.py",
        "bench/loop/button_wait.py",
        "bench/loop/exit_status.py",
        "bench/testing/*.py",
        "bench/testing/xcp/session.py",
        "examples/hil_tests/broken_devices.py",
    ),
    # The pytest plugin.
    "pytest": ("bench/testing/plugin.py", "bench/testing/summary.py", "examples/hil_tests/*.py"),
    "cantools": ("protocol/database/database.py",),
    "e2e": ("protocol/codec/e2e.py", "protocol/codec/protection.py"),
    # Files that others wrote.
    "asammdf": ("protocol/logs/*.py", "protocol/tables/*.py", "protocol/export/mf4.py"),
    "pyarrow": (
        "protocol/*.py",
        "protocol/*/*.py",
        "protocol/tables/*.py",
        "protocol/export/asc.py",
        "protocol/export/parquet.py",
        "identification/season/*.py",
    ),
    "duckdb": ("identification/season/season.py",),
    "gpxpy": ("protocol/tables/gpx_file.py",),
    "fitdecode": ("protocol/tables/fit_file.py",),
    "libxrk": ("protocol/tables/xrk_file.py",),
    "mcap": ("protocol/export/mcap_file.py", "protocol/tables/mcap_file.py"),
    "rosbags": ("protocol/tables/ros_bag.py", "protocol/tables/ros_types.py"),
    "lupa": ("identification/ecu/lua_machine.py",),
    "fmpy": ("identification/mismatch/callables/fmu/*.py", "src/slipbench/fmu_check.py"),
    # Mathematics.
    "control": (
        "plant/linear.py",
        "controllers/*.py",
        "identification/response/response.py",
        "identification/models/rational_model.py",
        "identification/models/uncertainty_set.py",
        "identification/models/switched.py",
        "identification/models/scheduled.py",
        "identification/design/mixed_sensitivity.py",
    ),
    "llvmlite": ("plant/fmu/kernel_object.py",),
    "numba": (
        "plant/*.py",
        "plant/fmu/kernel_object.py",
        "identification/models/switched.py",
        "studies/blind_validation/generator/*.py",
        "identification/mismatch/simulation/regressor.py",
    ),
    "pint": ("protocol/units.py", "plant/units.py", "plant/parameters.py"),
    # Drawing and talking.
    "matplotlib": (
        "identification/report/report.py",
        "identification/report/drawing.py",
        "identification/report/bode.py",
        "identification/report/chart.py",
        "identification/report/close_ups.py",
        "identification/report/distributions.py",
        "identification/report/model_figure.py",
        "identification/report/operation.py",
        "identification/report/overview.py",
        "identification/report/slip_control.py",
        "identification/report/table_report.py",
        "studies/paper/*_figures.py",
        "studies/paper/paper_section.py",
        "identification/design/figures.py",
        "identification/closed_loop_simulation/figures.py",
        "studies/blind_validation/figures.py",
        "identification/mismatch/reporting/evidence_figure.py",
        "identification/mismatch/reporting/pictures.py",
        "identification/season/trend_figure.py",
    ),
    "jinja2": (
        "identification/report/report.py",
        "identification/report/table_report.py",
        "studies/paper/paper_report.py",
        "identification/mismatch/reporting/memo_page.py",
        "identification/design/report.py",
        "identification/session/page.py",
        "identification/session/comparison_page.py",
    ),
    "typer": ("*/commands.py", "src/slipbench/*.py"),
    "rich": ("*/commands.py", "protocol/recording/summary.py", "src/slipbench/*.py"),
    # Time, and whatever runs beside the loop.
    "time": (
        "bench/loop/clock.py",
        "bench/loop/loop.py",
        "bench/loop/recorder.py",
        "bench/trials/live_trial.py",
        "bench/commands.py",
        "bench/bus/broker.py",
        "bench/bus/python_can.py",
        "studies/blind_validation/one_case.py",
        "studies/day/rehearsal.py",
        "identification/mismatch/callables/simulator.py",
        "identification/mismatch/predictive_check/stopwatch.py",
    ),
    "threading": (
        "bench/loop/loop.py",
        "bench/loop/recorder.py",
        "bench/commands.py",
        "bench/check/commands.py",
        "bench/trials/live_*.py",
        "bench/vehicle/live_*.py",
        "bench/loop/loop_process.py",
        "bench/loop/finalizer_interrupt.py",
        "bench/loop/interrupts.py",
        "bench/bus/python_can.py",
        "bench/view/view_process.py",
        "bench/view/table_server.py",
        "bench/view/view_folder.py",
        "bench/view/web.py",
        "bench/foxglove/replay_thread.py",
        "bench/foxglove/streams.py",
        "bench/foxglove/stream_process.py",
        "plant/compiled.py",
        "identification/mismatch/callables/simulator.py",
        "identification/mismatch/callables/worker.py",
        "identification/mismatch/motorcycle/simulate.py",
        "identification/mismatch/simulation/threads.py",
    ),
    "multiprocessing": (
        "bench/loop/ring.py",
        "bench/loop/recorder.py",
        "bench/trials/live_*.py",
        "bench/vehicle/live_*.py",
        "bench/loop/loop_process.py",
        "bench/replay/replay_process.py",
        "bench/loop/button_wait.py",
        "bench/loop/process_watch.py",
        "bench/loop/interrupts.py",
        "bench/loop/exit_status.py",
        "bench/view/view_process.py",
        "bench/view/side_process.py",
        "bench/foxglove/stream_process.py",
        "identification/mismatch/callables/worker.py",
    ),
    # The page of the live view.
    "starlette": (
        "bench/view/guard.py",
        "bench/view/server.py",
        "bench/view/table_server.py",
        "bench/view/web.py",
    ),
    "uvicorn": ("bench/view/web.py",),
    "textual": ("bench/view/terminal.py",),
    "foxglove": ("bench/foxglove/server.py",),
    # Many cases at once.
    "distributed": ("identification/cluster.py",),
    "dask": ("identification/cluster.py",),
    "asyncio": ("bench/view/sources.py", "bench/view/server.py", "bench/view/web.py"),
}


def breaches(root: Path) -> list[str]:
    """Name every import below `root` that is not allowed, wherever in its file it stands."""
    return [
        f"{path.relative_to(root)}:{line} imports {library}"
        for path in _files(root)
        for library, line in _imports(path)
        if not any(path.relative_to(root).match(where) for where in ALLOWED.get(library, ("*",)))
    ]


def _files(root: Path) -> list[Path]:
    packages = [path for package in PACKAGES for path in (root / package).rglob("*.py")]
    return sorted([*packages, *(root / "src" / "slipbench").glob("*.py")])


def _imports(path: Path) -> Iterator[tuple[str, int]]:
    """Yield the libraries that a file imports, by name or as an extra's, and on which line."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"), str(path))):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield alias.name.partition(".")[0], node.lineno
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield node.module.partition(".")[0], node.lineno
        elif isinstance(node, ast.Call) and getattr(node.func, "id", "") == "optional_library":
            for argument in node.args:
                if isinstance(argument, ast.Constant):
                    yield str(argument.value).partition(".")[0], node.lineno
