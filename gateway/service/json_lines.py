"""A local socket that answers one JSON object per line: the control socket of a gateway, and that of a simulated rig.

A gateway works without it, so a place where no socket can be made is a sentence and no exception.
"""

import asyncio
import contextlib
import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

Answer = dict[str, Any]
Handler = Callable[[dict[str, Any]], Answer]
_LONGEST_LINE = 65536
_LONGEST_PATH = 107  # bytes, of a Unix socket's address


class JsonLineServer:
    """Serves PATH (mode 0600): each line {"do": NAME, ...} goes to handlers[NAME], whose answer gets "ok": true.

    A handler refuses by raising ValueError; the caller reads {"ok": false, "error": sentence}.
    """

    def __init__(self, path: Path, handlers: dict[str, Handler]) -> None:
        self._path = path
        self._handlers = handlers
        self._server: asyncio.Server | None = None
        self._callers: dict[asyncio.StreamWriter, asyncio.Task[None]] = {}

    async def start(self) -> str:
        """Begin to serve; empty, or a sentence that says why nothing is served."""
        if (length := len(os.fsencode(self._path))) > _LONGEST_PATH:
            why = f"{length} bytes of path, a socket takes {_LONGEST_PATH}: give a shorter --state DIR"
            return f"{self._path} is not served, its tools will not find this gateway: {why}"
        previous = os.umask(0o177)
        try:
            self._path.unlink(missing_ok=True)
            self._server = await asyncio.start_unix_server(self._serve, str(self._path), limit=_LONGEST_LINE)
        except OSError as error:
            return f"{self._path} is not served, its tools will not find this gateway: {error.strerror or error}"
        finally:
            os.umask(previous)
        return ""

    async def close(self) -> None:
        if self._server:
            self._server.close()
            await asyncio.sleep(0)  # who has just been accepted is served from here on, and so known
            for writer in self._callers:
                writer.transport.abort()  # a caller that reads nothing would never let go of a polite close
            await asyncio.gather(*self._callers.values())
            await self._server.wait_closed()
            self._path.unlink(missing_ok=True)

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task
        self._callers[writer] = task
        try:
            while line := await reader.readline():
                writer.write(json.dumps(self._answer(line)).encode() + b"\n")
                await writer.drain()
        except (ValueError, ConnectionError, asyncio.IncompleteReadError):
            pass  # an overlong line or a caller that left: nobody is there to answer
        finally:
            writer.close()
            with contextlib.suppress(ConnectionError):
                await writer.wait_closed()
            del self._callers[writer]

    def _answer(self, line: bytes) -> Answer:
        try:
            request = json.loads(line)
            handler = self._handlers[request["do"]]
        except (ValueError, KeyError, TypeError, RecursionError):
            return {"ok": False, "error": f'expected {{"do": one of {", ".join(sorted(self._handlers))}, ...}}'}
        try:
            return {"ok": True} | handler(request)
        except (ValueError, OSError) as error:
            return {"ok": False, "error": str(error)}
