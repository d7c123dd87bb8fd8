"""The page as a process: `python -m gateway.web.web_process LINK '{"rig": ..., "state": ..., "listen": descriptor, ...}'`.

It shares with control nothing but the sample ring, which it can only read, and control's socket: all its callers have a
tenth of that loop. Its priority is below control's; it ends with the guardian, and one that dies is started again on the same
listening socket, which the guardian keeps.
"""

import contextlib
import socket
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from gateway.processes.beside_control import serve_until_guardian_ends
from gateway.processes.event_log import EventLog


async def serve(options: dict[str, Any], _: EventLog) -> None:
    """Serve the page until the process ends. options: as the guardian gives them."""
    import uvicorn

    from gateway.live.control_link import ControlLink
    from gateway.live.ring_rows import RingRows
    from gateway.web.bounded_http import BoundedHttpProtocol
    from gateway.web.context import WebContext
    from gateway.web.security import PageAccess
    from gateway.web.server import make_app

    class QuietServer(uvicorn.Server):
        """Answers no signal: it ends with the guardian, at once, for open streams never end by themselves."""

        @contextlib.contextmanager
        def capture_signals(self) -> Iterator[None]:
            yield

    state = Path(options["state"])
    rig = (options["rig"], options["simulated"])
    context = WebContext(state, *rig, ControlLink(state), options["fingerprint"], options.get("kept_rig"))
    web = context.profile.web
    access = PageAccess(options["settings"]["host"], options["settings"]["port"], web.token if web else None)
    rows = None if options["ring"] is None else RingRows(options["ring"])
    config = uvicorn.Config(
        make_app(context, access, rows),
        http=BoundedHttpProtocol,
        log_config=None,
        access_log=False,
        server_header=False,
        date_header=False,
        ws="none",
        limit_concurrency=256,
        timeout_keep_alive=30,
    )
    await QuietServer(config).serve(sockets=[socket.socket(fileno=options["listen"])])


def main(arguments: list[str]) -> int:
    """Serve until the guardian ends. arguments: descriptor of the link, options as JSON."""
    return serve_until_guardian_ends("web", arguments, serve)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
