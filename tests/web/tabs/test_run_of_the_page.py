"""A run that the page has begun: kept alive while somebody looks, let go when nobody does, and never anybody else's."""

import asyncio
import json

import pytest

from gateway.live.control_link import ControlLink
from gateway.web.context import WebContext
from gateway.web.events import EventSource
from gateway.web.security import PageAccess
from gateway.web.server import make_app
from gateway.web.tabs import run_follower
from gateway.web.tabs.run_follower import ABANDONED_S, RunFollower
from tests.web.tabs.scripted_control import IDLE

PLAN = {"plan": {"step_v": 1.0}, "name": "first"}


def test_a_run_is_kept_alive_without_a_browser_that_asks(page, control) -> None:
    assert page.post("/api/v1/calibrate/start", PLAN).status == 200
    asked = control.count("calibrate")
    control.wait_for("calibrate", asked + 3)  # nobody looks meanwhile
    assert page.get("/api/v1/calibrate").json["mine"] is True
    assert page.post("/api/v1/calibrate/stop").status == 200
    assert {"do": "calibrate", "stop": True} in control.asked


def test_a_second_run_is_refused_while_one_is_under_way(page, control) -> None:
    page.post("/api/v1/calibrate/start", PLAN)
    assert page.post("/api/v1/calibrate/start", PLAN).json["error"].startswith("E177 ")
    page.post("/api/v1/calibrate/stop")


def test_a_run_that_nobody_looks_at_is_let_go(state, control) -> None:
    now_s = [0.0]

    async def begin_and_leave() -> int:
        follower = RunFollower(WebContext(state, "demo", True, ControlLink(state)), lambda: now_s[0])
        await follower.begin(PLAN["plan"], "")
        now_s[0] = ABANDONED_S + 1.0
        async with asyncio.timeout(10.0):
            while follower.is_following:
                await asyncio.sleep(0.01)
        return control.count("calibrate")

    asked = asyncio.run(begin_and_leave())
    assert asked <= 2
    assert not any(request.get("stop") for request in control.asked)  # control ends it by itself, with its own sentence


def test_a_run_goes_on_while_a_page_is_open_whatever_tab_it_shows(state, control) -> None:
    """Whoever looked at the live view for a minute and a half lost the run: its own tab alone counted."""
    now_s, pages = [0.0], [1]

    async def begin_and_look_elsewhere() -> None:
        context = WebContext(state, "demo", True, ControlLink(state), viewers=lambda: pages[0])
        follower = RunFollower(context, lambda: now_s[0])
        await follower.begin(PLAN["plan"], "")
        for now_s[0] in (ABANDONED_S, 5.0 * ABANDONED_S):
            asked = control.count("calibrate")
            await asyncio.to_thread(control.wait_for, "calibrate", asked + 2)
            assert follower.is_following
        pages[0] = 0
        now_s[0] += ABANDONED_S
        async with asyncio.timeout(10.0):
            while follower.is_following:
                await asyncio.sleep(0.01)

    asyncio.run(begin_and_look_elsewhere())


def test_who_begins_a_run_has_looked_however_long_ago_anybody_else_did(state, control) -> None:
    """A browser that came back after minutes began a run, and it was let go with its first stair."""
    now_s = [0.0]

    async def come_back_and_begin() -> None:
        follower = RunFollower(WebContext(state, "demo", True, ControlLink(state)), lambda: now_s[0])
        now_s[0] = 10.0 * ABANDONED_S
        await follower.begin(PLAN["plan"], "")
        await asyncio.to_thread(control.wait_for, "calibrate", control.count("calibrate") + 2)
        assert follower.is_following
        now_s[0] += ABANDONED_S
        async with asyncio.timeout(10.0):
            while follower.is_following:
                await asyncio.sleep(0.01)

    asyncio.run(come_back_and_begin())


@pytest.mark.parametrize("error", [ConnectionResetError(), TimeoutError(), ValueError("internal error")], ids=repr)
def test_one_question_that_came_to_nothing_does_not_end_a_run(state, control, monkeypatch, error) -> None:
    """Control takes a run whose page is silent for abandoned: one answer that was lost on a busy machine stopped it."""

    async def begin_and_lose_an_answer() -> None:
        context = WebContext(state, "demo", True, ControlLink(state))
        follower = RunFollower(context)
        await follower.begin(PLAN["plan"], "")
        ask, errors = run_follower.ask_once, [error]

        async def lose_once(*words):
            if errors:
                raise errors.pop()
            return await ask(*words)

        monkeypatch.setattr(run_follower, "ask_once", lose_once)
        await asyncio.to_thread(control.wait_for, "calibrate", control.count("calibrate") + 3)
        assert not errors and follower.is_following
        await context.end_work()

    asyncio.run(begin_and_lose_an_answer())


def test_the_page_counts_who_looks(state, monkeypatch: pytest.MonkeyPatch) -> None:
    context = WebContext(state, "demo", True, ControlLink(state))
    assert context.viewers() == 0
    make_app(context, PageAccess("127.0.0.1", 8080), None)
    monkeypatch.setattr(EventSource, "viewers", property(lambda events: 3))
    assert context.viewers() == 3


def test_a_look_at_anothers_run_does_not_keep_it_alive(page, control) -> None:
    control.status = IDLE | {"running": True, "phase": "ladder", "progress": 0.4}
    status = page.get("/api/v1/calibrate").json
    assert (status["mine"], status["running"], status["progress"]) == (False, True, 0.4)
    assert (status["force_n"], status["voltage_v"]) == (12.5, 1.6)
    assert control.count("calibrate") == 0


def test_the_result_is_that_of_the_fits_document(page, control, state) -> None:
    (state / "calibrations").mkdir()
    (state / "calibrations" / "0002.json").write_text(json.dumps({"calibration": 2, "fits": []}))
    document = "/somewhere/else/../0002.json"  # only its name counts: nothing is read outside of the state directory
    recording = str(state / "recordings" / "0005.fgr")
    control.status = IDLE | {"phase": "stored", "result": {"stored": 2, "document": document}, "recording": recording}
    status = page.get("/api/v1/calibrate").json
    assert status["fit"] == {"calibration": 2, "fits": []}
    assert status["recording"] == 5


def test_a_preview_asks_what_the_terminal_asks(page, control) -> None:
    preview = page.post("/api/v1/calibrate/preview", PLAN).json
    assert len(preview["questions"]) == 3
    assert "58 N" in preview["questions"][0]
    assert {"do": "calibrate", "plan": PLAN["plan"], "dry_run": True} in control.asked
    assert control.status["running"] is False


@pytest.mark.parametrize("name", ["12", "two\u0007lines", "x" * 61])
def test_a_name_that_no_calibration_may_have_is_refused(page, control, name) -> None:
    assert page.post("/api/v1/calibrate/start", PLAN | {"name": name}).status == 400
    assert control.status["running"] is False
