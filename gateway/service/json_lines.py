"""A local socket that answers one JSON object per line: the control socket of a gateway, and that of a simulated rig."""

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


class JsonLineServer:
    """Serves PATH (mode 0600): each line {"do": NAME, ...} goes to handlers[NAME], whose answer gets "ok": true.

    A handler refuses by raising ValueError; the caller reads {"ok": false, "error": sentence}.
    """

    def __init__(self, path: Path, handlers: dict[str, Handler]) -> None:
        self._path = path
        self._handlers = handlers
        self._server: asyncio.Server | None = None
        self._writers: set[asyncio.StreamWriter] = set()

    async def start(self) -> None:
        self._path.unlink(missing_ok=True)
        previous = os.umask(0o177)
        try:
            self._server = await asyncio.start_unix_server(self._serve, str(self._path), limit=_LONGEST_LINE)
        finally:
            os.umask(previous)

    async def close(self) -> None:
        if self._server:
            self._server.close()
            for writer in tuple(self._writers):
                writer.close()
            await self._server.wait_closed()
        self._path.unlink(missing_ok=True)

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._writers.add(writer)
        try:
            while line := await reader.readline():
                writer.write(json.dumps(self._answer(line)).encode() + b"\n")
                await writer.drain()
        except (ValueError, ConnectionError, asyncio.IncompleteReadError):
            pass  # an overlong line or a caller that left: nobody is there to answer
        finally:
            self._writers.discard(writer)
            writer.close()
            with contextlib.suppress(ConnectionError):
                await writer.wait_closed()

    def _answer(self, line: bytes) -> Answer:
        try:
            request = json.loads(line)
            handler = self._handlers[request["do"]]
        except (ValueError, KeyError, TypeError):
            return {"ok": False, "error": f'expected {{"do": one of {", ".join(sorted(self._handlers))}, ...}}'}
        try:
            return {"ok": True} | handler(request)
        except (ValueError, OSError) as error:
            return {"ok": False, "error": str(error)}
