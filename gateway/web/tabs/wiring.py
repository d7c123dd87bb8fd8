"""Tab Wiring: the page of `force-gateway wiring` for the rig that runs."""

import asyncio
import contextlib
from dataclasses import asdict
from typing import Any

from starlette.requests import Request
from starlette.routing import Route

from gateway.web.context import WebContext
from gateway.web.tabs.answers import TabRefusedError, answers


def routes(context: WebContext) -> list[Route]:
    """Return the addresses of this tab."""

    async def wiring(request: Request) -> dict[str, Any]:
        port = None
        with contextlib.suppress(OSError, ValueError):  # the page is worth showing while control is away, too
            port = (await context.questions.ask({"do": "running"})).get("port")
        return await asyncio.to_thread(wiring_document, context, port)

    return [Route("/api/v1/wiring", answers(wiring))]


def wiring_document(context: WebContext, port: int | None = None) -> dict[str, Any]:
    """Return title and sections as `wiring --json` has them, and why they are not of the rig that runs, if they are not.
    port: where plain Modbus TCP is served, None: nowhere, or not known. TabRefusedError where the rig cannot be read any
    more."""
    from gateway.clients import MissingRegisterError
    from gateway.clients.wiring import wiring_page
    from gateway.profiles import ProfileError, load_rig

    try:
        rig = load_rig(context.rig, simulated=context.simulated)
        title, sections = wiring_page(rig, context.rig)
    except (ProfileError, MissingRegisterError) as error:
        raise TabRefusedError(str(error)) from None
    other = context.why_other(rig.fingerprint)
    if not other and port not in (None, rig.network.port):
        other = f"started with --bind: Modbus TCP is on port {port} now, where the lines below say {rig.network.port}"
    return {"title": title, "sections": [asdict(each) for each in sections], "other": other}
