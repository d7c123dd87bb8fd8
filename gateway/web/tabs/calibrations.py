"""Tab Calibrations and plants: what there is, two compared, use one, and back to what was in use before.

Lists are read from the stores; what changes or compares is done by the verbs `calibration` and `plant`, so that page and
terminal say the same and a running gateway is asked in the same way.
"""

import asyncio
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from gateway.processes.durable_file import read_object, read_regular
from gateway.processes.state_directory import CALIBRATIONS
from gateway.web.context import WebContext
from gateway.web.tabs.answers import (
    NOT_FOUND,
    TabRefusedError,
    answers,
    number_in_path,
    number_in_query,
    report_page,
)
from gateway.web.tabs.own_command import ask_verb, run_verb, state_words
from gateway.web.tabs.stored_documents import Change, calibration_facts, change_words, plant_facts, read_change


class CalibrationsTab:
    """What the tab asks of the server."""

    def __init__(self, context: WebContext) -> None:
        self._context = context
        self._state = context.state

    async def calibrations(self, request: Request) -> dict[str, Any]:
        """Return the calibrations, the newest first, and which is in use."""
        return await asyncio.to_thread(calibration_facts, self._context)

    async def plants(self, request: Request) -> dict[str, Any]:
        """Return the plants, the newest first, and which is in use."""
        return await asyncio.to_thread(plant_facts, self._context)

    async def report(self, request: Request) -> Response:
        """Return the report of the fit that a calibration came from."""
        return report_page(await asyncio.to_thread(_read_report, self._state, number_in_path(request)))

    async def comparison(self, request: Request) -> Response:
        """Return two calibrations side by side, as a page."""
        a, b = number_in_query(request, "a"), number_in_query(request, "b")
        with TemporaryDirectory(prefix="force-gateway-compare-") as folder:
            page = Path(folder) / "compare.html"
            words = ("calibration", "compare", str(a), str(b), "--plot", str(page))
            await run_verb(*words, *state_words(self._context))
            return report_page(page.read_text(encoding="utf-8"))

    async def plant_comparison(self, request: Request) -> dict[str, Any]:
        """Return every number in which two plants differ."""
        a, b = number_in_query(request, "a"), number_in_query(request, "b")
        return await ask_verb(self._context, "plant", "compare", str(a), str(b))

    async def plant_preview(self, request: Request) -> dict[str, Any]:
        """Return what control would compensate of a plant, and of what not and why."""
        return await ask_verb(self._context, "plant", "use", str(number_in_path(request)), "--dry-run")

    async def change_calibration(self, request: Request) -> dict[str, Any]:
        """Use another calibration, or go back."""
        return await self._change("calibration", await read_change(request))

    async def change_plant(self, request: Request) -> dict[str, Any]:
        """Use another plant, or go back."""
        return await self._change("plant", await read_change(request))

    async def _change(self, noun: str, change: Change) -> dict[str, Any]:
        answer = await ask_verb(self._context, noun, *change_words(noun, change))
        return {"said": answer.get("said", ""), "reference": answer.get("reference", "")}


def routes(context: WebContext) -> list[Route]:
    """Return the addresses of this tab."""
    tab = CalibrationsTab(context)
    return [
        Route("/api/v1/calibrations", answers(tab.calibrations)),
        Route("/api/v1/calibrations/compare", answers(tab.comparison)),
        Route("/api/v1/calibrations/change", answers(tab.change_calibration), methods=["POST"]),
        Route("/api/v1/calibrations/{number}/report", answers(tab.report)),
        Route("/api/v1/plants", answers(tab.plants)),
        Route("/api/v1/plants/compare", answers(tab.plant_comparison)),
        Route("/api/v1/plants/change", answers(tab.change_plant), methods=["POST"]),
        Route("/api/v1/plants/{number}/preview", answers(tab.plant_preview)),
    ]


def _read_report(state: Path, number: int) -> str:
    """Return the report of a calibration; the document beside it says whose it is."""
    folder = state / CALIBRATIONS
    try:
        document = read_object(folder / f"{number:04d}.json")
        text = read_regular(folder / f"{number:04d}.html").decode()
    except (OSError, ValueError):
        raise TabRefusedError(f"calibration {number} has no report: it was not fitted here", NOT_FOUND) from None
    if document.get("calibration") != number:
        raise TabRefusedError(f"the report beside calibration {number} is of another one", NOT_FOUND)
    return text
