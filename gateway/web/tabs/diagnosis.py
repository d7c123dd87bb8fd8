"""Tab Diagnosis: why the force of a recording is off, by `force-gateway diagnose` in a process of its own."""

import asyncio
from dataclasses import dataclass
from typing import Annotated, Any

from annotated_types import Ge, Le
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from gateway import defaults
from gateway.extras import is_installed, missing_note
from gateway.web.context import WebContext
from gateway.web.tabs.answers import (
    Nothing,
    TabRefusedError,
    answers,
    number_in_path,
    read_body,
    report_page,
)
from gateway.web.tabs.diagnosis_job import DiagnosisJobs, kept_diagnoses, read_report
from gateway.web.tabs.recording_files import recording_path


@dataclass(frozen=True, slots=True, kw_only=True)
class WantedDiagnosis:
    """keep_plant: keep the extended plant as the rig's next number, as `diagnose --save` does."""

    __pydantic_config__ = defaults.STRICT
    recording: Annotated[int, Ge(1), Le(999_999)]
    keep_plant: bool = False


class DiagnosisTab:
    """What the tab asks of the server."""

    def __init__(self, context: WebContext) -> None:
        self._state = context.state
        self._jobs = DiagnosisJobs(context)

    async def status(self, request: Request) -> dict[str, Any]:
        """Return the diagnosis under way or the last one, and the reports that are kept."""
        kept = await asyncio.to_thread(kept_diagnoses, self._state)
        missing = "" if is_installed("numba") else missing_note("numba", "a diagnosis")
        return {"job": self._jobs.status(), "kept": kept, "missing": missing}

    async def begin(self, request: Request) -> dict[str, Any]:
        """Begin a diagnosis of one recording of the list."""
        wanted = await read_body(request, WantedDiagnosis)
        if not is_installed("numba"):
            raise TabRefusedError(missing_note("numba", "a diagnosis"))
        await asyncio.to_thread(recording_path, self._state, wanted.recording)
        await self._jobs.begin(wanted.recording, keeps_plant=wanted.keep_plant)
        return {"job": self._jobs.status()}

    async def cancel(self, request: Request) -> dict[str, Any]:
        """Cancel the one under way; nothing of it is kept."""
        await read_body(request, Nothing)
        await self._jobs.cancel()
        return {"job": self._jobs.status()}

    async def report(self, request: Request) -> Response:
        """Return the report of a recording, as a page."""
        return report_page(await asyncio.to_thread(read_report, self._state, number_in_path(request)))


def routes(context: WebContext) -> list[Route]:
    """Return the addresses of this tab."""
    tab = DiagnosisTab(context)
    return [
        Route("/api/v1/diagnosis", answers(tab.status)),
        Route("/api/v1/diagnosis/begin", answers(tab.begin), methods=["POST"]),
        Route("/api/v1/diagnosis/cancel", answers(tab.cancel), methods=["POST"]),
        Route("/api/v1/diagnosis/{number}/report", answers(tab.report)),
    ]
