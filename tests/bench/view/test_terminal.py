"""Laws of the view in a terminal, with textual's own pilot."""

import asyncio

import pytest

from slipbench.bench.loop.clock import MonotonicClock
from slipbench.bench.view.live_run import LiveView
from slipbench.bench.view.replay_run import ReplayRun
from slipbench.bench.view.terminal import blocks, terminal_app
from tests.bench.view.recordings import recorded
from tests.bench.view.test_observer import HandClock

pytest.importorskip("textual", reason="pip install 'slipbench[view]'")


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return recorded(tmp_path_factory.mktemp("terminal"))


def shown(app, name):
    return str(app.query_one(f"#{name}").render())


def test_a_replay_is_shown_paused_and_sought(run):
    clock = HandClock()
    replay = ReplayRun(run, clock)
    app = terminal_app(replay.update, replay.control)

    async def session():
        async with app.run_test() as pilot:
            clock.now = 200_000_000
            app.renew()
            assert shown(app, "phase") == "run  IDLE"
            await pilot.press("space")
            clock.now += 1_000_000_000
            app.renew()
            assert app.state["position"] == 0.2
            await pilot.press("right")
            app.renew()
            assert app.state["position"] == 5.2
            assert shown(app, "phase") == "run  SETTLING"
            assert "rpm" in shown(app, "numbers")
            assert "slip" in shown(app, "limits")
            await pilot.press("left")
            app.renew()
            assert app.state["position"] == pytest.approx(0.2)
            await pilot.press("q")
        assert app.return_value is None

    asyncio.run(session())
    replay.close()


def test_it_follows_a_run_while_it_is_recorded(run, tmp_path):
    growing, lines = tmp_path / "run", (run / "frames.log").read_bytes().splitlines(keepends=True)
    growing.mkdir()
    for name in ("trial.toml", "vehicle.toml", "roles.toml", "database.dbc"):
        (growing / name).write_bytes((run / name).read_bytes())
    live = LiveView(growing, MonotonicClock())
    app = terminal_app(lambda: live.update()[1])
    described = (run / "run.toml").read_text().partition("[outcome]")[0]

    async def session():
        async with app.run_test() as pilot:
            assert shown(app, "line") == "the recording has not begun"
            (growing / "run.toml").write_text(described)
            (growing / "frames.log").write_bytes(b"".join(lines[: len(lines) // 2]))
            while "EXCITING" not in shown(app, "phase"):
                app.renew()
            await pilot.press("space", "right")  # there is nothing to control
            (growing / "run.toml").write_text((run / "run.toml").read_text())
            (growing / "frames.log").write_bytes(b"".join(lines))
            while "DONE" not in shown(app, "phase"):
                app.renew()
            await pilot.press("q")

    asyncio.run(session())


def test_silence_and_limits_that_are_near_are_marked():
    state = {"running": True, "silent": 2.0, "limits": {"slip": 0.8, "speed": 1.2, "grip": 0.1}}
    found = blocks(state)
    assert found["alarm"] == "no frame for 2.0 s"
    marks = [line.rpartition("%")[2].strip() for line in found["limits"].splitlines()]
    assert marks == ["near", "beyond", ""]
    assert found["numbers"].count("–") == 5
