"""A caller that has to go for another one, and a machine that has no descriptor left for the next."""

import asyncio
import json
import socket
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.processes.json_socket import server as server_room
from gateway.processes.json_socket.connection import JsonConnection
from gateway.processes.json_socket.server import JsonLineServer


@pytest.mark.parametrize(("unsent", "heard"), [(b"", True), (b"the rest", False)])
def test_who_makes_room_is_told_why_but_not_in_the_middle_of_its_answer(unsent: bytes, heard: bool) -> None:
    """Half an answer and a sentence on one line would be neither."""
    ours, theirs = socket.socketpair()
    forgotten = list[object]()
    server: Any = SimpleNamespace(
        loop=SimpleNamespace(remove_reader=lambda peer: None, remove_writer=lambda peer: None),
        forget_connection=forgotten.append,
    )
    caller = JsonConnection(server, ours)
    caller._unsent = unsent
    caller.dismiss("another one needs the place")
    said = theirs.recv(4096)
    theirs.close()
    assert bool(said) == heard
    assert not heard or "another one needs the place: closed" in json.loads(said)["error"]
    assert forgotten == [caller] and ours.fileno() < 0


def test_a_caller_that_comes_when_no_descriptor_is_left_is_served_when_there_is_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(server_room, "_NO_DESCRIPTOR_S", 0.01)
    tries = list[int]()

    async def scene() -> bytes:
        server = JsonLineServer(tmp_path / "control.sock", {"echo": lambda request: {"said": "here"}})
        await server.start()
        real = server._listener
        assert real is not None

        class Short:
            fileno, close = real.fileno, real.close

            def accept(self) -> Any:
                tries.append(1)
                if len(tries) < 3:
                    raise OSError(24, "Too many open files")
                return real.accept()

        asyncio.get_running_loop().remove_reader(real)
        server._listener = Short()  # type: ignore[assignment]
        server._await_connection()
        reader, writer = await asyncio.open_unix_connection(str(tmp_path / "control.sock"))
        writer.write(b'{"do": "echo"}\n')
        answer = await asyncio.wait_for(reader.readline(), 5.0)
        writer.close()
        await writer.wait_closed()
        await server.close()
        return answer

    assert json.loads(asyncio.run(scene()))["said"] == "here"
    assert len(tries) == 3


def test_a_caller_that_reads_no_answer_has_one_request_handled(tmp_path: Path) -> None:
    """Else one that asks without end and reads nothing would fill control's memory with answers."""
    asked = list[int]()

    def answer(request: dict[str, Any]) -> dict[str, Any]:
        asked.append(request["k"])
        return {"rows": 200_000 * "x"}

    async def scene() -> None:
        server = JsonLineServer(tmp_path / "control.sock", {"all": answer})
        await server.start()
        reader, writer = await asyncio.open_unix_connection(str(tmp_path / "control.sock"), limit=1 << 16)
        reader._transport.pause_reading()  # type: ignore[attr-defined]
        writer.write(b"".join(b'{"do": "all", "k": %d}\n' % k for k in range(20)))
        async with asyncio.timeout(5.0):
            while not server._callers or not next(iter(server._callers))._unsent:
                await asyncio.sleep(0.001)
        await asyncio.sleep(0.05)  # as many rests of the queue as twenty would take
        handled = len(asked)
        writer.close()
        await server.close()
        assert handled < 4, "those that the kernel's buffer holds, and the one that waits"

    asyncio.run(scene())
    assert asked[:1] == [0]
