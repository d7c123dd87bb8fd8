"""The file of a local socket: removed it comes back; what another one has put in its place is never taken away."""

import asyncio
import json
import os
import shutil
import socket
import stat
import threading
from collections.abc import Awaitable, Callable
from pathlib import Path

import pytest

from gateway.processes.json_socket.connection import SocketLimits
from gateway.processes.json_socket.server import JsonLineServer

OFTEN = SocketLimits(idle_s=0.2)  # looks at its file four times as often


def beside_a_server(path: Path, scene: Callable[[asyncio.Queue[str]], Awaitable[None]]) -> None:
    async def play() -> None:
        said: asyncio.Queue[str] = asyncio.Queue()
        handlers = {"echo": lambda request: {"said": request.get("say")}}
        server = JsonLineServer(path, handlers, lambda cause, sentence: said.put_nowait(sentence), OFTEN)
        assert await server.start() == ""
        async with asyncio.timeout(10):
            await scene(said)
        await server.close()
        assert said.empty()

    path.parent.mkdir(exist_ok=True)
    asyncio.run(play())


async def answer(path: Path) -> bool:
    reader, writer = await asyncio.open_unix_connection(str(path))
    writer.write(b'{"do": "echo", "say": 1}\n')
    said = json.loads(await reader.readline())
    writer.close()
    await writer.wait_closed()
    return bool(said == {"ok": True, "said": 1})


@pytest.mark.parametrize("folder_too", [False, True])
def test_a_socket_whose_file_is_removed_is_served_again(folder_too: bool, tmp_path: Path) -> None:
    path = tmp_path / "state" / "control.sock"

    async def scene(said: asyncio.Queue[str]) -> None:
        if folder_too:
            shutil.rmtree(path.parent)
            assert f"E152 {path} is not served" in (sentence := await said.get())
            assert sentence.endswith("its directory is gone: make it again (mkdir), and it is served again")
            path.parent.mkdir()
        else:
            path.unlink()
        assert "it is served again" in await said.get()
        assert await answer(path)
        assert stat.S_IMODE(path.stat().st_mode) == 0o600

    beside_a_server(path, scene)
    assert not path.exists()


def test_a_socket_that_could_not_be_made_at_the_start_is_served_when_it_can(tmp_path: Path) -> None:
    """Behind a restart of control whose state directory was away nothing tried again: no tool and no page found it."""
    path = tmp_path / "state" / "control.sock"

    async def play() -> None:
        said: asyncio.Queue[str] = asyncio.Queue()
        server = JsonLineServer(
            path, {"echo": lambda request: {"said": 1}}, lambda _, text: said.put_nowait(text), OFTEN
        )
        assert "is not served" in await server.start()
        path.parent.mkdir()
        async with asyncio.timeout(10):
            assert "it is served now" in await said.get()
        assert said.empty(), "why it was not is what start has told"
        assert await answer(path)
        await server.close()

    asyncio.run(play())
    assert not path.exists()


def test_what_stands_in_its_place_is_told_once_and_stays(tmp_path: Path) -> None:
    path = tmp_path / "state" / "control.sock"

    async def scene(said: asyncio.Queue[str]) -> None:
        path.unlink()
        path.write_text("somebody else's")
        assert "E152" in (sentence := await said.get())
        assert "another file has its name" in sentence
        await asyncio.sleep(4 * OFTEN.idle_s)  # it looks sixteen times, and says nothing more

    beside_a_server(path, scene)
    assert path.read_text() == "somebody else's"


def test_a_dead_socket_that_came_back_with_its_folder_gives_way(tmp_path: Path) -> None:
    """Of a state directory that was moved away while control was restarted, and back: `another file has its name`, and no tool
    and no page found the gateway any more."""
    path = tmp_path / "state" / "control.sock"

    async def scene(said: asyncio.Queue[str]) -> None:
        path.parent.rename(tmp_path / "away")
        (tmp_path / "away" / path.name).unlink()
        with socket.socket(socket.AF_UNIX) as before:
            before.bind(str(tmp_path / "away" / path.name))
            before.listen()
        (tmp_path / "away").rename(path.parent)
        while "it is served again" not in await said.get():
            pass
        assert await answer(path)

    beside_a_server(path, scene)


def test_a_later_socket_of_another_gateway_is_not_taken_for_its_own(tmp_path: Path) -> None:
    path = tmp_path / "state" / "control.sock"
    with socket.socket(socket.AF_UNIX) as other:

        async def scene(said: asyncio.Queue[str]) -> None:
            other.bind(str(path.with_name("other")))
            other.listen()
            path.with_name("other").replace(path)  # at once: the server's thread looks whenever it likes
            assert "another file has its name" in await said.get()
            await asyncio.sleep(4 * OFTEN.idle_s)

        beside_a_server(path, scene)
        assert path.is_socket()


def test_a_disk_that_does_not_say_where_the_file_is_holds_up_nobody(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The folder of a network whose server is away: control stood in the kernel, and was killed while it pressed."""
    path, asked, goes_on = tmp_path / "state" / "control.sock", threading.Event(), threading.Event()
    look = Path.stat

    def hang(one: Path, **options: bool) -> os.stat_result:
        if one == path and threading.current_thread() is not threading.main_thread():
            asked.set()
            goes_on.wait(10.0)
        return look(one, **options)

    async def scene(said: asyncio.Queue[str]) -> None:
        with monkeypatch.context() as patched:
            patched.setattr(Path, "stat", hang)
            while not asked.is_set():
                await asyncio.sleep(0.001)
            assert await answer(path)
            path.unlink()
            await asyncio.sleep(OFTEN.idle_s)
            assert said.empty()
            goes_on.set()
            assert "it is served again" in await said.get()
        assert await answer(path)

    beside_a_server(path, scene)
