"""The way from a process beside control to its control socket, on asyncio: one JSON line out, one in.

`ControlLink` keeps its connection, for who asks many times a second; `ask_once` opens one for one question. Control answers
one request of a connection at a time, so that requests wait here, in order, and not there.
"""

import asyncio
import json
from pathlib import Path
from typing import Any, Final

from gateway.plain_file import is_directory
from gateway.processes.json_socket.messages import LONGEST_ANSWER
from gateway.processes.state_directory import CONTROL_SOCKET

ANSWER_S: Final = 2.0
"""A control that is being restarted answers nobody; its callers must be able to say so. What they ask of the force says until
when they wait (`until_s`), for it may still be carried out behind that."""


class RemovedStateError(FileNotFoundError):
    """The state directory was removed, and with it the way to control, which may be pressing; its text says what to do."""

    def __init__(self, state: Path) -> None:
        super().__init__(
            f"E152 {state} is gone, and with it the way to the gateway: make it again (mkdir); until then stop by Modbus"
        )


class ControlLink:
    """A connection to the gateway that runs on this state directory; opened when it is needed, and anew after a loss."""

    def __init__(self, state_directory: Path) -> None:
        self._path = state_directory / CONTROL_SOCKET
        self._turn = asyncio.Lock()
        self._streams: tuple[asyncio.StreamReader, asyncio.StreamWriter] | None = None
        self._is_sent = False  # the question that is asked now

    async def ask(self, request: dict[str, Any]) -> dict[str, Any]:
        """Return the answer, without its "ok". OSError where nobody answers, ValueError with the reason of a refusal."""
        async with self._turn:
            try:
                async with asyncio.timeout(ANSWER_S):
                    answer = await self._exchange(json.dumps(request).encode() + b"\n", presses="until_s" in request)
            except BaseException as error:
                await self._drop()  # a late answer must not be taken for that of the next question
                if isinstance(error, TimeoutError):
                    raise TimeoutError(f"the gateway has not answered within {ANSWER_S:g} s") from None
                raise
        if not answer.pop("ok", False):
            raise ValueError(str(answer.get("error", "the gateway refused without a reason")))
        return answer

    async def close(self) -> None:
        """Close the connection."""
        async with self._turn:
            await self._drop()

    async def _exchange(self, line: bytes, *, presses: bool) -> dict[str, Any]:
        was_open, self._is_sent = self._streams is not None, False
        try:
            return await self._say(line)
        except (ConnectionError, EOFError):
            await self._drop()
            if not was_open or (presses and self._is_sent):  # it may have obeyed before it died
                raise ConnectionError(f"no gateway answers on {self._path}") from None
        return await self._say(line)  # control closes what has been idle, and a restarted one knows nobody

    async def _say(self, line: bytes) -> dict[str, Any]:
        if self._streams is None:
            self._streams = await self._open()
        reader, writer = self._streams
        writer.write(line)
        await writer.drain()
        self._is_sent = True
        answer = await reader.readline()
        if not answer.endswith(b"\n"):
            raise EOFError
        decoded = json.loads(answer)
        if not isinstance(decoded, dict):
            raise ValueError("the gateway's answer is no object")
        return decoded

    async def _open(self) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
        try:
            return await asyncio.open_unix_connection(str(self._path), limit=LONGEST_ANSWER)
        except FileNotFoundError:
            if is_directory(self._path.parent):
                raise
            raise RemovedStateError(self._path.parent) from None

    async def _drop(self) -> None:
        if self._streams is None:
            return
        _, writer = self._streams
        self._streams = None
        writer.transport.abort()


async def ask_once(state_directory: Path, request: dict[str, Any]) -> dict[str, Any]:
    """Return the answer to one question; errors as `ControlLink.ask`."""
    link = ControlLink(state_directory)
    try:
        return await link.ask(request)
    finally:
        await link.close()
