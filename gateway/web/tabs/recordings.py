"""Tab Recordings: start and stop, the list, a picture of each, and the whole file as CSV or Parquet."""

import asyncio
from typing import Any, Final

from starlette.background import BackgroundTask
from starlette.requests import Request
from starlette.responses import FileResponse, Response
from starlette.routing import Route

from gateway.extras import is_installed, missing_note
from gateway.live.control_link import ask_once
from gateway.web.context import WebContext
from gateway.web.tabs.answers import (
    NOT_FOUND,
    Nothing,
    TabRefusedError,
    answers,
    number_in_path,
    read_body,
    report_page,
)
from gateway.web.tabs.recording_files import FORMS, draw_recording, export_recording, recording_facts

_TYPES: Final = {"csv": "text/csv; charset=utf-8", "parquet": "application/vnd.apache.parquet"}


class RecordingsTab:
    """What the tab asks of the server."""

    def __init__(self, context: WebContext) -> None:
        self._state = context.state

    async def list(self, request: Request) -> dict[str, Any]:
        """Return the recordings, the newest first, and the one under way."""
        facts = await asyncio.to_thread(recording_facts, self._state)
        try:
            status = await ask_once(self._state, {"do": "record"})
        except OSError:
            status = {"recording": None}
        missing = "" if is_installed("pyarrow") else missing_note("pyarrow", "Parquet")
        return {"recordings": facts, "recording": status, "no_parquet": missing}

    async def start(self, request: Request) -> dict[str, Any]:
        """Begin a recording."""
        await read_body(request, Nothing)
        return await ask_once(self._state, {"do": "record", "on": True})

    async def stop(self, request: Request) -> dict[str, Any]:
        """End the recording."""
        await read_body(request, Nothing)
        return await ask_once(self._state, {"do": "record", "on": False})

    async def download(self, request: Request) -> Response:
        """Send the whole recording in another form, from the disk."""
        form = request.path_params["form"]
        if form not in FORMS:
            raise TabRefusedError(f"{form[:20]!r}: recordings come as {' or '.join(FORMS)}", NOT_FOUND)
        exported = await asyncio.to_thread(export_recording, self._state, number_in_path(request), form)
        remove = BackgroundTask(exported.folder.cleanup)
        return FileResponse(exported.path, media_type=_TYPES[form], filename=exported.path.name, background=remove)

    async def plot(self, request: Request) -> Response:
        """Return the drawings of a recording, as a page."""
        return report_page(await asyncio.to_thread(draw_recording, self._state, number_in_path(request)))


def routes(context: WebContext) -> list[Route]:
    """Return the addresses of this tab."""
    tab = RecordingsTab(context)
    return [
        Route("/api/v1/recordings", answers(tab.list)),
        Route("/api/v1/recordings/start", answers(tab.start), methods=["POST"]),
        Route("/api/v1/recordings/stop", answers(tab.stop), methods=["POST"]),
        Route("/api/v1/recordings/{number}/plot", answers(tab.plot)),
        Route("/api/v1/recordings/{number}/download.{form}", answers(tab.download)),
    ]
