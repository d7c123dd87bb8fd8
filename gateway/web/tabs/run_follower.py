"""Follows a calibration run that was begun on the page, so that it goes on while the page is loaded again.

Control stops a run that nobody has asked about for three seconds: a closed terminal must not leave a tool climbing stairs. The
page's process asks instead of the browser, for as long as a page is open, whatever tab it shows, or some browser has asked it
within ABANDONED_S; after that it falls silent, and control stops the run with the data kept (A330). A run that was begun
elsewhere is looked at without being kept alive.
"""

import asyncio
import contextlib
import time
from collections.abc import Callable
from typing import Any, Final

from gateway.live.control_link import ask_once
from gateway.web.context import WebContext

ABANDONED_S: Final = 90.0
"""Browsers let a page in the background ask once a minute."""
_ASKED_EVERY_S: Final = 0.3
_BUSY: Final = ("zero", "check", "ladder", "minor_loops", "fitting", "experiment")
_BEGUN_WITHIN_S: Final = 2.0
Status = dict[str, Any]


class RunFollower:
    """The run that the page has begun, if any. clock: monotonic seconds."""

    def __init__(self, context: WebContext, clock: Callable[[], float] = time.monotonic) -> None:
        self._context = context
        self._state = context.state
        self._clock = clock
        self._seen_s = clock()
        self._last: Status = {}
        self._task: asyncio.Task[None] | None = None

    @property
    def is_following(self) -> bool:
        """Decide whether a run of the page's own is under way."""
        return self._task is not None and not self._task.done()

    async def preview(self, plan: Status) -> Status:
        """Return what the gateway would do, without a motion. ValueError with control's refusal."""
        return await self._ask({"plan": plan, "dry_run": True})

    async def begin(self, plan: Status, name: str) -> Status:
        """Begin a run and follow it. ValueError with control's refusal."""
        if self.is_following:
            raise ValueError("E177 a run of this page is under way: stop it first, or wait for its end")
        self._seen_s = self._clock()
        self._last = await self._ask({"plan": plan, "name": name})
        self._task = self._context.begin(self._follow())
        return self._last

    async def stop(self) -> Status:
        """Stop the run, whoever has begun it; the force goes to 0 and the data are kept."""
        return await self._ask({"stop": True})

    async def look(self) -> Status:
        """Return how the run is, as control answers `calibrate`, with `mine`: it was begun on the page."""
        self._seen_s = self._clock()
        if self.is_following:
            return self._last | {"mine": True}
        state = await ask_once(self._state, {"do": "state"})
        shown = _run_shown_in(state) if state["run"]["running"] else await self._ask({})
        return shown | {"mine": False}

    async def _follow(self) -> None:
        began_s = self._clock()
        while not self._is_abandoned():
            with contextlib.suppress(OSError, ValueError):  # control is restarted: it has ended the run then
                self._last = await self._ask({})
            is_starting = self._last["phase"] == "idle" and self._clock() - began_s < _BEGUN_WITHIN_S
            if not (self._last["running"] or self._last["phase"] in _BUSY or is_starting):
                return
            await asyncio.sleep(_ASKED_EVERY_S)

    def _is_abandoned(self) -> bool:
        if self._context.viewers():
            self._seen_s = self._clock()
        return self._clock() - self._seen_s >= ABANDONED_S

    async def _ask(self, request: Status) -> Status:
        return await ask_once(self._state, {"do": "calibrate"} | request)


def _run_shown_in(state: Status) -> Status:
    """Return what `calibrate` would answer of a run, from what `state` answers, which keeps no run alive."""
    run, force = state["run"], state["force"]
    return {
        "running": True,
        "phase": run["phase"],
        "progress": run["share"],
        "eta_s": run["eta_s"],
        "force_n": force["measured_n"],
        "voltage_v": force["voltage_v"],
    }
