"""Tab Configuration: every value of the rig with where it comes from, read-only."""

import asyncio
from typing import Any

from starlette.requests import Request
from starlette.routing import Route

from gateway.web.context import WebContext
from gateway.web.tabs.answers import TabRefusedError, answers
from gateway.web.tabs.rig_values import rig_document


def routes(context: WebContext) -> list[Route]:
    """Return the addresses of this tab."""

    async def configuration(request: Request) -> dict[str, Any]:
        return await asyncio.to_thread(_configuration, context)

    return [Route("/api/v1/configuration", answers(configuration))]


def _configuration(context: WebContext) -> dict[str, Any]:
    from gateway.profiles import ProfileError

    try:
        document = rig_document(context.rig, simulated=context.simulated)
    except ProfileError as error:
        raise TabRefusedError(str(error)) from None
    other = context.why_other(document["fingerprint"])
    return document | {"warnings": [*([other] if other else []), *document["warnings"]]}
