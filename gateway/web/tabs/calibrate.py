"""Tab Calibrate: the guided ladder as `force-gateway calibrate` runs it, from the questions to the result.

All that a wizard needs to know stands in control and in the state directory, so a page that is loaded again goes on where it
was. Using the new calibration is a step of its own (tab Calibrations).
"""

import asyncio
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Annotated, Any, Final

from annotated_types import MaxLen
from starlette.requests import Request
from starlette.routing import Route

from gateway import defaults
from gateway.control.runs.ladder_stairs import QUICK, CalibrationPlan
from gateway.control.runs.preconditions import preconditions
from gateway.processes.durable_file import read_object
from gateway.processes.state_directory import CALIBRATIONS
from gateway.recording.label import LONGEST_NAME, check_name
from gateway.web.context import WebContext
from gateway.web.tabs.answers import Nothing, TabRefusedError, answers, read_body
from gateway.web.tabs.run_follower import RunFollower

_PLANS: Final = {"quick": QUICK, "full": CalibrationPlan()}
_OFFERED: Final = ("step_v", "groups", "minor_points", "response_steps")


@dataclass(frozen=True, slots=True, kw_only=True)
class WantedRun:
    """A plan's fields, as a plan file has them; control judges them. name: of the calibration."""

    __pydantic_config__ = defaults.STRICT
    plan: dict[str, Any] = field(default_factory=dict)
    name: Annotated[str, MaxLen(LONGEST_NAME)] = ""


class CalibrateTab:
    """What the wizard asks of the server."""

    def __init__(self, context: WebContext) -> None:
        self._state = context.state
        self._follower = RunFollower(context)

    async def status(self, request: Request) -> dict[str, Any]:
        """Return how the run is, what plans there are, and the fit's table once there is one."""
        status = await self._follower.look()
        plans = {name: {key: asdict(plan)[key] for key in _OFFERED} for name, plan in _PLANS.items()}
        document = (status.get("result") or {}).get("document")
        fit = await asyncio.to_thread(_read_fit, self._state, document) if document else None
        return status | {"plans": plans, "fit": fit, "recording": _number_of(status.get("recording"))}

    async def preview(self, request: Request) -> dict[str, Any]:
        """Return what a plan would do and how long it takes, and what a person is asked before; nothing moves."""
        wanted = await read_body(request, WantedRun)
        preview = await self._follower.preview(wanted.plan)
        asked = preconditions(preview["force_max_n"], preview["v_max_v"], has_check=preview["check"])
        return preview | {"questions": [*asked, *preview["questions"]]}

    async def start(self, request: Request) -> dict[str, Any]:
        """Begin the run."""
        wanted = await read_body(request, WantedRun)
        return await self._follower.begin(wanted.plan, _checked_name(wanted.name))

    async def stop(self, request: Request) -> dict[str, Any]:
        """Stop it: the force goes to 0, the data are kept."""
        await read_body(request, Nothing)
        return await self._follower.stop()


def routes(context: WebContext) -> list[Route]:
    """Return the addresses of this tab."""
    tab = CalibrateTab(context)
    return [
        Route("/api/v1/calibrate", answers(tab.status)),
        Route("/api/v1/calibrate/preview", answers(tab.preview), methods=["POST"]),
        Route("/api/v1/calibrate/start", answers(tab.start), methods=["POST"]),
        Route("/api/v1/calibrate/stop", answers(tab.stop), methods=["POST"]),
    ]


def _checked_name(text: str) -> str:
    """Return a calibration's name, empty for none."""
    try:
        return check_name(text) if text.strip() else ""
    except ValueError as error:
        raise TabRefusedError(str(error), 400) from None


def _number_of(recording: str | None) -> int | None:
    stem = Path(recording).stem if recording else ""
    return int(stem) if stem.isdecimal() else None


def _read_fit(state: Path, document: str) -> dict[str, Any] | None:
    """Return the fit's document; None for one that is gone, or is not in this state directory."""
    path = state / CALIBRATIONS / Path(document).name
    try:
        fit: dict[str, Any] = read_object(path)
    except (OSError, ValueError):
        return None
    return fit
