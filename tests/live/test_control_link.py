"""The way to control's socket: answers in order, refusals as sentences, and a restarted control is found again."""

import asyncio
import contextlib
import json
from collections.abc import AsyncIterator, Awaitable, Callable
from pathlib import Path

import pytest

from gateway.live import control_link
from gateway.live.control_link import ControlLink, RemovedStateError, ask_once
from gateway.processes.json_socket.connection import SocketLimits
from gateway.processes.json_socket.messages import Answer
from gateway.processes.json_socket.server import JsonLineServer

Scene = Callable[[Path], Awaitable[None]]


def _refuse(request: Answer) -> Answer:
    raise ValueError(f"no {request['what']} here")


def server(state: Path) -> JsonLineServer:
    return JsonLineServer(state / "control.sock", {"echo": lambda request: {"n": request["n"]}, "refuse": _refuse})


def test_questions_asked_at_once_get_their_own_answers(tmp_path: Path) -> None:
    async def scene() -> None:
        control, link = server(tmp_path), ControlLink(tmp_path)
        await control.start()
        answers = await asyncio.gather(*(link.ask({"do": "echo", "n": n}) for n in range(20)))
        assert [answer["n"] for answer in answers] == list(range(20))
        with pytest.raises(ValueError, match=r"^no butter here$"):
            await link.ask({"do": "refuse", "what": "butter"})
        await link.close()
        await control.close()

    asyncio.run(scene())


def test_an_answer_that_comes_too_late_is_none_to_the_next_question(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(control_link, "ANSWER_S", 0.05)

    async def scene() -> None:
        given_up, link, connections = asyncio.Event(), ControlLink(tmp_path), []

        async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            connections.append(asyncio.current_task())
            with contextlib.suppress(ConnectionError):
                while line := await reader.readline():
                    request = json.loads(line)
                    if request["n"] == 0:
                        await given_up.wait()
                    writer.write(json.dumps({"ok": True, "n": request["n"]}).encode() + b"\n")
            writer.close()

        async with await asyncio.start_unix_server(serve, tmp_path / "control.sock"):
            with pytest.raises(TimeoutError, match="the gateway has not answered within"):
                await link.ask({"n": 0})
            given_up.set()
            monkeypatch.setattr(control_link, "ANSWER_S", 5.0)
            answer = await link.ask({"n": 1})
            await link.close()
            await asyncio.gather(*connections)
            assert answer == {"n": 1}

    asyncio.run(scene())


def test_a_restarted_control_is_found_again_and_an_absent_one_is_said_to_be(tmp_path: Path) -> None:
    async def scene() -> None:
        link = ControlLink(tmp_path)
        for n in range(2):
            control = server(tmp_path)
            await control.start()
            assert await link.ask({"do": "echo", "n": n}) == {"n": n}
            await control.close()
        with pytest.raises(OSError):
            await link.ask({"do": "echo", "n": 3})
        with pytest.raises(OSError) as absent:
            await ask_once(tmp_path, {"do": "echo", "n": 3})
        assert not isinstance(absent.value, RemovedStateError), "its directory is there"
        with pytest.raises(RemovedStateError, match="E152"):
            await ask_once(tmp_path / "removed", {"do": "echo", "n": 3})
        await link.close()

    asyncio.run(scene())


@contextlib.asynccontextmanager
async def saying(state: Path, *answers: bytes) -> AsyncIterator[list[bytes]]:
    """A control that says this to the first question of each connection and closes; yields what it was asked."""
    asked, left, ends = list[bytes](), iter(answers), list[asyncio.Task[None] | None]()

    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        ends.append(asyncio.current_task())
        asked.append(await reader.readline())
        writer.write(next(left, b""))
        writer.close()

    async with await asyncio.start_unix_server(serve, state / "control.sock"):
        yield asked
        await asyncio.gather(*(end for end in ends if end))


@pytest.mark.parametrize("said", [b"", b'{"ok": true, "n": 1'], ids=["nothing", "half an answer"])
def test_a_control_that_ends_over_a_question_is_asked_no_second_time(tmp_path: Path, said: bytes) -> None:
    """It may have obeyed before it died; a second time would be a second command, to a control that has just restarted."""

    async def scene() -> None:
        async with saying(tmp_path, said) as asked:
            with pytest.raises(ConnectionError, match="no gateway answers"):
                await ask_once(tmp_path, {"do": "modbus"})
        assert asked == [b'{"do": "modbus"}\n']

    asyncio.run(scene())


@pytest.mark.parametrize("said", [b"", b'{"ok": true, "n": 1'], ids=["nothing", "half an answer"])
def test_nor_is_it_on_a_connection_that_is_kept_but_for_a_stop(tmp_path: Path, said: bytes) -> None:
    """An enable by MQTT or the page, in flight while control died, was sent to the new one again, and pressed."""
    asked = list[bytes]()

    async def ask_second(link: ControlLink, request: Answer) -> Answer:
        async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            connections.append(asyncio.current_task())
            answers = (b'{"ok": true}\n', said) if len(connections) == 1 else (b'{"ok": true, "n": 2}\n',)
            for answer in answers:
                asked.append(await reader.readline())
                writer.write(answer)
            writer.close()

        connections = list[asyncio.Task[None] | None]()
        async with await asyncio.start_unix_server(serve, tmp_path / "control.sock"):
            try:
                await link.ask({})
                return await link.ask(request)
            finally:
                await link.close()
                await asyncio.gather(*(connection for connection in connections if connection))

    with pytest.raises(ConnectionError, match="no gateway answers"):
        asyncio.run(ask_second(ControlLink(tmp_path), {"do": "modbus", "until_s": 5.0}))
    assert asked == [b"{}\n", b'{"do": "modbus", "until_s": 5.0}\n']
    asked.clear()
    assert asyncio.run(ask_second(ControlLink(tmp_path), {"do": "modbus"})) == {"n": 2}
    assert asked == [b"{}\n", b'{"do": "modbus"}\n', b'{"do": "modbus"}\n']


def test_a_connection_that_was_idle_for_too_long_costs_nobody_a_question(tmp_path: Path) -> None:
    """Control says why it closes; that is no answer to what is asked next."""

    async def scene() -> None:
        control, link = server(tmp_path), ControlLink(tmp_path)
        control.limits = SocketLimits(idle_s=0.02)
        await control.start()
        assert await link.ask({"do": "echo", "n": 1}) == {"n": 1}
        for n, until in ((2, {}), (3, {"until_s": 5.0})):  # what presses, too: it has not been sent
            while control._callers:
                await asyncio.sleep(0.005)
            assert await link.ask({"do": "echo", "n": n, **until}) == {"n": n}
        await link.close()
        await control.close()
        async with saying(tmp_path, b'{"ok": true, "n": 1}\n', b'{"ok": true, "n": 2}\n'):
            silent = ControlLink(tmp_path)
            assert await silent.ask({}) == {"n": 1}
            assert await silent.ask({}) == {"n": 2}
            await silent.close()

    asyncio.run(scene())


@pytest.mark.parametrize("said", [b"[]\n", b"{}\n", b"12\n", b'{"n": 1}\n'])
def test_what_is_no_answer_is_none_that_went_well(tmp_path: Path, said: bytes) -> None:
    async def scene() -> None:
        async with saying(tmp_path, said):
            with pytest.raises(ValueError, match=r"no object|refused without a reason"):
                await ask_once(tmp_path, {})

    asyncio.run(scene())


def test_a_long_answer_is_taken_whole(tmp_path: Path) -> None:
    async def scene() -> None:
        text = "x" * 500_000
        async with saying(tmp_path, json.dumps({"ok": True, "n": text}).encode() + b"\n"):
            assert await ask_once(tmp_path, {}) == {"n": text}

    asyncio.run(scene())
