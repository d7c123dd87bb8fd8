"""A local socket with one JSON object per line: whatever is sent, the loop behind it goes on."""

import asyncio
import json
import socket
import stat
from collections.abc import Awaitable, Callable
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import pytest

from gateway.processes.json_socket.connection import SocketLimits
from gateway.processes.json_socket.server import Handler, JsonLineServer


def refuse(request: dict[str, Any]) -> dict[str, Any]:
    raise ValueError("already recording")


def no_space(request: dict[str, Any]) -> dict[str, Any]:
    raise OSError(28, "No space left on device")


HANDLERS: dict[str, Handler] = {
    "echo": lambda request: {"said": request.get("say")},
    "refuse": refuse,
    "record": no_space,
}
Scene = Callable[[Path], Awaitable[None]]


def with_server(directory: Path, scene: Scene, limits: SocketLimits | None = None) -> list[dict[str, Any]]:
    """Run the scene beside a server; what reached the loop's exception handler, which would restart the gateway."""
    defects: list[dict[str, Any]] = []

    async def play() -> None:
        asyncio.get_running_loop().set_exception_handler(lambda loop, context: defects.append(context))
        server = JsonLineServer(directory / "control.sock", HANDLERS, limits=limits)
        await server.start()
        async with asyncio.timeout(10):
            await scene(directory / "control.sock")
        async with asyncio.timeout(2):
            await server.close()

    asyncio.run(play())
    assert not (directory / "control.sock").exists()
    return defects


def answers(directory: Path, *lines: bytes) -> list[Any]:
    found: list[Any] = []

    async def scene(path: Path) -> None:
        reader, writer = await asyncio.open_unix_connection(str(path))
        for line in lines:
            writer.write(line + b"\n")
            answer = await reader.readline()
            found.append(json.loads(answer) if answer else None)
        writer.close()
        await writer.wait_closed()

    assert with_server(directory, scene) == []
    return found


def test_each_line_is_answered_in_order(tmp_path: Path) -> None:
    first, second = answers(tmp_path, b'{"do": "echo", "say": 1}', b'{"do": "echo", "say": "zwei"}')
    assert (first, second) == ({"ok": True, "said": 1}, {"ok": True, "said": "zwei"})


def test_a_refusal_and_a_full_disk_are_sentences(tmp_path: Path) -> None:
    refused, full = answers(tmp_path, b'{"do": "refuse"}', b'{"do": "record"}')
    assert refused == {"ok": False, "error": "already recording"}
    assert full["ok"] is False
    assert "No space left" in full["error"]


def test_an_answer_that_a_disk_is_waited_for_comes_later_and_others_are_answered_meanwhile(tmp_path: Path) -> None:
    waiting: list[Future[dict[str, Any]]] = []

    def wait(request: dict[str, Any]) -> Future[dict[str, Any]]:
        waiting.append(Future())
        return waiting[-1]

    async def scene(path: Path) -> None:
        slow, to_slow = await asyncio.open_unix_connection(str(path))
        to_slow.write(b'{"do": "wait"}\n{"do": "wait"}\n')
        other, to_other = await asyncio.open_unix_connection(str(path))
        while not waiting:
            to_other.write(b'{"do": "echo", "say": 1}\n')
            assert json.loads(await other.readline())["said"] == 1
        assert len(waiting) == 1, "one request at a time"
        waiting[0].set_result({"written": 7})
        assert json.loads(await slow.readline()) == {"ok": True, "written": 7}
        while len(waiting) < 2:
            await asyncio.sleep(0)
        waiting[1].set_exception(OSError(28, "No space left on device"))
        assert "No space left" in json.loads(await slow.readline())["error"]
        for writer in (to_slow, to_other):
            writer.close()
            await writer.wait_closed()

    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(HANDLERS, "wait", wait)
        assert with_server(tmp_path, scene) == []


def test_an_answer_for_a_caller_that_has_left_goes_nowhere(tmp_path: Path) -> None:
    waiting: list[Future[dict[str, Any]]] = []

    async def scene(path: Path) -> None:
        _, writer = await asyncio.open_unix_connection(str(path))
        writer.write(b'{"do": "wait"}\n')
        while not waiting:
            await asyncio.sleep(0)
        writer.close()
        await writer.wait_closed()
        waiting[0].set_result({})
        reader, writer = await asyncio.open_unix_connection(str(path))
        writer.write(b'{"do": "echo", "say": 2}\n')
        assert json.loads(await reader.readline())["said"] == 2
        writer.close()
        await writer.wait_closed()

    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(HANDLERS, "wait", lambda request: waiting.append(Future()) or waiting[-1])
        assert with_server(tmp_path, scene) == []


@pytest.mark.parametrize(
    "line",
    [
        b"hello",
        b"",
        b"[]",
        b"7",
        b'"echo"',
        b"{}",
        b'{"do": 7}',
        b'{"do": ["echo"]}',
        b'{"do": "recrod"}',
        b"\xff\xfe\x00",
        b"[" * 60_000,
        b'{"do":' * 10_000,
    ],
)
def test_what_is_no_request_is_told_what_was_expected(tmp_path: Path, line: bytes) -> None:
    wrong, right = answers(tmp_path, line, b'{"do": "echo", "say": 2}')
    assert wrong["ok"] is False
    assert "echo, record, refuse" in wrong["error"]
    assert right == {"ok": True, "said": 2}


def test_an_overlong_line_ends_its_connection_and_no_other(tmp_path: Path) -> None:
    async def scene(path: Path) -> None:
        other_reader, other = await asyncio.open_unix_connection(str(path))
        reader, writer = await asyncio.open_unix_connection(str(path))
        writer.write(b"x" * 200_000)
        told = json.loads(await reader.read())
        assert (told["ok"], "65536 bytes" in told["error"]) == (False, True)
        other.write(b'{"do": "echo"}\n')
        assert json.loads(await other_reader.readline())["ok"]
        for each in (other, writer):
            each.close()
            try:
                await each.wait_closed()
            except ConnectionError:
                pass

    assert with_server(tmp_path, scene) == []


def test_a_caller_that_leaves_in_the_middle_is_nobody_s_trouble(tmp_path: Path) -> None:
    async def scene(path: Path) -> None:
        for rest in (b"", b'{"do": "ec', b'{"do": "echo"}\n' * 50):
            _, writer = await asyncio.open_unix_connection(str(path))
            writer.write(rest)
            writer.transport.abort()
        reader, writer = await asyncio.open_unix_connection(str(path))
        writer.write(b'{"do": "echo"}\n')
        assert json.loads(await reader.readline())["ok"]
        writer.close()
        await writer.wait_closed()

    assert with_server(tmp_path, scene) == []


def test_a_caller_that_reads_nothing_does_not_hold_up_the_end(tmp_path: Path) -> None:
    caller = socket.socket(socket.AF_UNIX)
    caller.setblocking(False)

    async def scene(path: Path) -> None:
        caller.connect(str(path))
        question = json.dumps({"do": "echo", "say": "x" * 30_000}).encode() + b"\n"
        loop = asyncio.get_running_loop()
        try:
            async with asyncio.timeout(0.3):
                while True:
                    await loop.sock_sendall(caller, question)
        except TimeoutError:
            pass

    assert with_server(tmp_path, scene) == []
    caller.close()


def test_only_the_user_who_runs_the_gateway_may_ask(tmp_path: Path) -> None:
    async def scene(path: Path) -> None:
        assert stat.S_IMODE(path.stat().st_mode) == 0o600

    with_server(tmp_path, scene)


def test_a_socket_left_by_a_killed_gateway_is_replaced(tmp_path: Path) -> None:
    left = socket.socket(socket.AF_UNIX)
    left.bind(str(tmp_path / "control.sock"))
    left.close()
    assert answers(tmp_path, b'{"do": "echo", "say": 3}') == [{"ok": True, "said": 3}]


def test_a_path_that_no_socket_can_have_is_a_sentence_and_not_an_end(tmp_path: Path) -> None:
    """Unix sockets take 107 bytes; a state directory may be deeper than that."""
    deep = tmp_path / ("d" * 60) / ("e" * 60)
    deep.mkdir(parents=True)

    async def scene() -> str:
        server = JsonLineServer(deep / "control.sock", HANDLERS)
        sentence = await server.start()
        await server.close()
        return sentence

    sentence = asyncio.run(scene())
    assert "control.sock" in sentence
    assert "107" in sentence
    assert "--state" in sentence


def test_a_socket_that_can_be_made_says_nothing(tmp_path: Path) -> None:
    async def scene() -> str:
        server = JsonLineServer(tmp_path / "control.sock", HANDLERS)
        sentence = await server.start()
        await server.close()
        return sentence

    assert asyncio.run(scene()) == ""


def test_a_defect_in_a_handler_is_an_answer_and_a_line_in_the_log(tmp_path: Path) -> None:
    said: list[tuple[str, str]] = []

    def broken(request: dict[str, Any]) -> dict[str, Any]:
        raise ZeroDivisionError("x" * 10_000)

    server = JsonLineServer(
        tmp_path / "x.sock",
        {"broken": broken, "odd": lambda request: {"a": object()}, "nan": lambda request: {"a": [float("nan"), 1.5]}},
        lambda cause, sentence: said.append((cause, sentence)),
    )
    for verb in ("broken", "odd"):
        answer = json.loads(server.answer(json.dumps({"do": verb}).encode()))
        assert answer["ok"] is False and "internal error, please report" in answer["error"]
        assert len(answer["error"]) < 600
    assert [cause for cause, _ in said] == ["internal", "internal"]
    assert all(sentence.startswith("A499 ") and "Traceback" in sentence for _, sentence in said)
    assert json.loads(server.answer(b'{"do": "nan"}')) == {"ok": True, "a": [None, 1.5]}
