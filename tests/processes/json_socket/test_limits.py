"""What callers of a local socket may cost: too many, silent, slow and flooding ones, and none is left behind."""

import asyncio
import json
import os
import random
import socket
import time
from pathlib import Path
from typing import Any

from gateway.processes.json_socket.connection import SocketLimits
from gateway.processes.json_socket.server import JsonLineServer
from tests.processes.json_socket.test_server import with_server


def talk(path: Path, data: bytes = b"") -> socket.socket:
    """A connection from this very thread: non-blocking, so that the loop under test goes on."""
    caller = socket.socket(socket.AF_UNIX)
    caller.setblocking(False)
    try:
        caller.connect(str(path))
        caller.send(data)
    except OSError:  # the kernel's queue is full
        caller.close()
        raise
    return caller


async def patiently(path: Path, data: bytes) -> socket.socket:
    """As `talk`, as often as the kernel's queue is full."""
    while True:
        try:
            return talk(path, data)
        except BlockingIOError:
            await asyncio.sleep(0.002)


async def heard(caller: socket.socket) -> bytes:
    """Everything up to the end of the connection."""
    loop, found = asyncio.get_running_loop(), b""
    try:
        while chunk := await loop.sock_recv(caller, 65536):
            found += chunk
    except ConnectionError:
        pass
    caller.close()
    return found


async def line_from(caller: socket.socket) -> Any:
    loop, found = asyncio.get_running_loop(), b""
    while not found.endswith(b"\n"):
        chunk = await loop.sock_recv(caller, 65536)
        assert chunk, "closed without a line"
        found += chunk
    return json.loads(found)


def descriptors() -> int:
    return len(list(Path("/proc/self/fd").iterdir()))


ECHO = b'{"do": "echo", "say": 1}\n'


def test_more_callers_than_allowed_are_told_so_and_closed(tmp_path: Path) -> None:
    async def scene(path: Path) -> None:
        served = [talk(path, ECHO) for _ in range(32)]
        assert all([(await line_from(caller))["ok"] for caller in served])
        surplus = [talk(path, ECHO) for _ in range(40)]
        told = [json.loads(await heard(caller)) for caller in surplus]
        assert all("32 connections are open" in answer["error"] for answer in told)
        served[0].close()
        await asyncio.sleep(0.02)
        fresh = talk(path, ECHO)
        assert (await line_from(fresh))["ok"]
        for caller in (*served, fresh):
            caller.close()

    assert with_server(tmp_path, scene, SocketLimits(spared_s=60.0)) == []


def test_callers_that_say_nothing_make_room_for_one_that_does(tmp_path: Path) -> None:
    async def scene(path: Path) -> None:
        silent = [talk(path) for _ in range(32)]
        await asyncio.sleep(0.15)
        fresh = talk(path, ECHO)
        assert (await line_from(fresh))["ok"]
        assert b"others are waiting" in await heard(silent[0])
        for caller in (*silent, fresh):
            caller.close()

    assert with_server(tmp_path, scene, SocketLimits(spared_s=0.02)) == []


def test_who_says_nothing_half_a_line_or_reads_nothing_is_closed_in_time(tmp_path: Path) -> None:
    async def scene(path: Path) -> None:
        callers = [
            talk(path),
            talk(path, b'{"do": "ec'),
            talk(path, b'{"do": "echo", "say": "' + b"x" * 60_000 + b'"}\n' * 2),
        ]

        async def ask() -> None:
            asked_s = time.monotonic()
            for _ in range(8):
                before_s, asked_s = asked_s, time.monotonic()
                writer.write(ECHO)
                try:
                    answer = await reader.readline()
                except ConnectionError:
                    answer = b""
                if not answer and time.monotonic() - before_s >= limits.idle_s:
                    return  # this machine stood still for as long
                assert answer, "who asks again and again stays"
                await asyncio.sleep(0.05)

        reader, writer = await asyncio.open_unix_connection(str(path))
        asking = asyncio.ensure_future(ask())
        left = [await heard(caller) for caller in callers[:2]]
        assert all(b"no whole request for 0.2 s" in said for said in left)
        deaf = callers[2]
        while True:
            try:
                deaf.send(ECHO)
            except BlockingIOError:
                await asyncio.sleep(0.01)
            except OSError:
                break
        deaf.close()
        await asking
        writer.close()

    limits = SocketLimits(idle_s=0.2)
    assert with_server(tmp_path, scene, limits) == []


def test_a_request_without_its_newline_is_one_when_the_caller_has_ended(tmp_path: Path) -> None:
    async def scene(path: Path) -> None:
        caller = talk(path, ECHO + ECHO.rstrip())
        caller.shutdown(socket.SHUT_WR)
        assert (await heard(caller)).count(b'"ok": true') == 2

    assert with_server(tmp_path, scene) == []


def test_two_hundred_callers_of_all_kinds_leave_no_descriptor_and_no_caller_behind(tmp_path: Path) -> None:
    chance = random.Random(5)
    kinds = (b"", ECHO, ECHO * 30, b"{", b"\x00\xff\n", b"x" * 70_000, b"[" * 900 + b"\n")
    before = descriptors()

    async def scene(path: Path) -> None:
        for _ in range(200):
            caller = await patiently(path, chance.choice(kinds))
            if chance.random() < 0.3:
                await asyncio.sleep(0)
            caller.close()
        fresh = await patiently(path, ECHO)
        assert (await line_from(fresh))["ok"]
        fresh.close()

    assert with_server(tmp_path, scene) == []
    assert descriptors() <= before + 1


def test_a_flood_of_requests_leaves_nine_tenths_of_the_loop(tmp_path: Path) -> None:
    """However many ask: each turn rests nine times as long as it took. A busy machine makes it fewer, never more."""
    served = 0

    def costly(request: dict[str, Any]) -> dict[str, Any]:
        nonlocal served
        served += 1
        end_s = time.thread_time() + 0.002
        while time.thread_time() < end_s:
            pass
        return {}

    async def play() -> None:
        server = JsonLineServer(tmp_path / "control.sock", {"costly": costly})
        await server.start()
        flood = [talk(tmp_path / "control.sock", b'{"do": "costly"}\n' * 500) for _ in range(20)]
        began_s = time.monotonic()
        await asyncio.sleep(0.4)
        took_s = time.monotonic() - began_s
        assert 1 <= served <= 1 + took_s / 0.02
        for caller in flood:
            caller.close()
        await server.close()

    asyncio.run(play())


def test_who_has_just_spoken_is_not_the_one_that_has_been_silent_for_longest(tmp_path: Path) -> None:
    async def scene(path: Path) -> None:
        first, second = talk(path, ECHO), talk(path, ECHO)
        for caller in (first, second):
            assert (await line_from(caller))["ok"]
        first.send(ECHO)
        assert (await line_from(first))["ok"]
        third = talk(path, ECHO)
        assert (await line_from(third))["ok"]
        assert b"others are waiting" in await heard(second)
        first.send(ECHO)
        assert (await line_from(first))["ok"]
        for caller in (first, third):
            caller.close()

    assert with_server(tmp_path, scene, SocketLimits(callers=2, spared_s=0.0)) == []


def test_an_answer_that_no_buffer_holds_arrives_whole(tmp_path: Path) -> None:
    """Its rest waits until the caller reads: not a byte of it is lost or comes twice."""
    rows = list(range(100_000))

    async def scene() -> None:
        server = JsonLineServer(tmp_path / "control.sock", {"all": lambda request: {"rows": rows}})
        await server.start()
        caller = talk(tmp_path / "control.sock", b'{"do": "all"}\n')
        assert (await line_from(caller))["rows"] == rows
        caller.close()
        await server.close()

    asyncio.run(scene())


def test_a_caller_that_was_told_to_stop_is_forgotten_when_it_leaves(tmp_path: Path) -> None:
    async def scene() -> None:
        server = JsonLineServer(tmp_path / "control.sock", {})
        await server.start()
        caller = talk(tmp_path / "control.sock", b"x" * 100_000)
        assert b"65536 bytes" in await heard(caller)
        async with asyncio.timeout(5.0):
            while server._callers:
                await asyncio.sleep(0.001)
        await server.close()

    asyncio.run(scene())


def test_an_answer_without_end_is_a_sentence(tmp_path: Path) -> None:
    async def scene() -> None:
        server = JsonLineServer(tmp_path / "control.sock", {"all": lambda request: {"rows": "x" * (1 << 20)}})
        await server.start()
        caller = talk(tmp_path / "control.sock", b'{"do": "all"}\n')
        answer = await line_from(caller)
        assert answer["ok"] is False and "the answer would have 10" in answer["error"]
        caller.close()
        await server.close()

    asyncio.run(scene())


def test_a_number_that_is_none_is_no_request(tmp_path: Path) -> None:
    """NaN passes every bound that is asked as `too large?`."""

    async def scene(path: Path) -> None:
        for number in (b"NaN", b"-Infinity"):
            caller = talk(path, b'{"do": "echo", "say": ' + number + b"}\n")
            assert (await line_from(caller))["ok"] is False
            caller.close()

    assert with_server(tmp_path, scene) == []


def test_a_server_leaves_umask_and_clock_as_it_has_found_them(tmp_path: Path) -> None:
    """What other parts of the process make afterwards would have other rights; a sweep behind the end would make a new file."""

    async def scene() -> None:
        server = JsonLineServer(tmp_path / "control.sock", {})
        before = os.umask(0o027)
        await server.start()
        assert os.umask(before) == 0o027
        await server.close()
        assert server._sweep_timer and server._sweep_timer.cancelled()

    asyncio.run(scene())


def test_a_line_that_is_too_long_is_refused_though_it_ends(tmp_path: Path) -> None:
    """It comes in two pieces, each short enough."""
    limits = SocketLimits(longest_line=200)

    async def scene(path: Path) -> None:
        long = ECHO[:-2] + b" " * 150
        caller = talk(path, long)
        caller.send(b" " * 60 + b"}\n")
        (answer,) = (await heard(caller)).splitlines()
        assert "a line of more than 200 bytes" in json.loads(answer)["error"]

    with_server(tmp_path, scene, limits)
