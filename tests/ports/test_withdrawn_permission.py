"""A permission that is withdrawn changes nothing while the port is open; after a replug it is told, and given back it opens."""

import asyncio
import errno
import os
import threading
from pathlib import Path
from typing import Any

import pytest

from gateway.devices import SerialSettings
from gateway.ports import PortError, PortEvents, Pty, SerialPort, serial_port
from gateway.ports.opening import explain_in_brief, open_descriptor
from tests.ports.raw_bytes import gather
from tests.ports.test_port_failures import denying


def test_an_open_port_works_on_without_permission(ear: Any, line: Pty, monkeypatch: pytest.MonkeyPatch) -> None:
    async def scene() -> None:
        port = ear.port(line.path)
        await port.open()
        os.chmod(line.path, 0)  # noqa: PTH101
        monkeypatch.setattr("serial.serialposix.os.open", denying(line.path))
        os.write(line.fd, b"5\r\n")
        await ear.until(lambda: bool(ear.data == b"5\r\n"))
        assert port.write(b"SET 0\r\n")
        assert await gather(line.fd, 7) == b"SET 0\r\n"
        assert (port.is_open, ear.losses) == (True, [])
        port.close()

    asyncio.run(scene())


def test_a_replug_without_permission_is_told_once_and_opens_when_it_is_given(
    ear: Any, line: Pty, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """For as long as it took the log said "unplugged?" of a plug that was in."""
    name = tmp_path / "usb-FTDI-port0"
    name.symlink_to(line.path)
    refusals: list[PortError] = []

    async def scene() -> None:
        loop, at_once = asyncio.get_running_loop(), lambda delay_s: loop.call_later(0.001, port._reopen)
        events = PortEvents(ear.on_bytes, ear.on_lost, ear.on_open, refusals.append)
        port = SerialPort(str(name), SerialSettings(baud=9600), events)
        await port.open()
        other = Pty()
        os.chmod(other.path, 0o600)  # noqa: PTH101
        tries: list[None] = []
        with monkeypatch.context() as denied:
            denied.setattr("serial.serialposix.os.open", denying(str(name)))
            denied.setattr(port, "_reopen_after", lambda delay_s: (tries.append(None), at_once(delay_s)))
            name.unlink()
            name.symlink_to(other.path)
            line.close()
            async with asyncio.timeout(10):
                while len(tries) < 12 or not refusals:
                    await asyncio.sleep(0.001)
        (refusal,) = refusals
        assert refusal.code == "E101"
        assert "may not open it" in str(refusal) and "udev rule" in str(refusal)
        await ear.until(lambda: len(ear.opened) == 2)
        assert port.write(b"SET 0\r\n")
        assert await gather(other.fd, 7) == b"SET 0\r\n"
        assert len(ear.losses) == 1
        port.close()
        other.close()

    asyncio.run(scene())


@pytest.mark.parametrize(
    ("number", "words"),
    [(errno.EMFILE, "has as many files open as it may: raise LimitNOFILE"), (errno.ENFILE, "/proc/sys/fs/file-nr")],
)
def test_a_port_that_does_not_open_for_want_of_descriptors_is_told_once(
    line: Pty, ear: Any, monkeypatch: pytest.MonkeyPatch, number: int, words: str
) -> None:
    """The log's last word was "unplugged?" for as long as the shortage took."""
    refusals: list[PortError] = []

    def refusing(*arguments: Any, **keywords: Any) -> int:
        raise OSError(number, os.strerror(number))

    async def scene() -> None:
        events = PortEvents(ear.on_bytes, ear.on_lost, ear.on_open, refusals.append)
        port = SerialPort(line.path, SerialSettings(baud=9600), events)
        await port.open()
        port._lose(PortError("E102", "unplugged?"))
        with monkeypatch.context() as short:
            short.setattr("serial.serialposix.os.open", refusing)
            for _ in range(6):
                port._stop_reopening()
                port._reopen()
        port._stop_reopening()
        async with asyncio.timeout(5):
            while not refusals:
                await asyncio.sleep(0.001)
        port._reopen()
        (refusal,) = refusals
        assert str(refusal).startswith(f"E102 {line.path} does not open: ") and words in str(refusal)
        assert port.is_open
        port.close()

    asyncio.run(scene())


def failure(code: str) -> PortError:
    numbers = {"E101": errno.EACCES, "E102": errno.ENOENT, "E103": errno.EAGAIN}
    refusal = explain_in_brief("/dev/ttyX", OSError(numbers[code], "refused"))
    assert refusal.code == code
    refusal.__cause__ = OSError(numbers[code], "refused")
    return refusal


def test_a_refusal_is_told_anew_when_the_port_has_been_open_since(line: Pty, monkeypatch: pytest.MonkeyPatch) -> None:
    refusals: asyncio.Queue[PortError] = asyncio.Queue()
    told: list[Exception] = []  # at once: what a thread finds out of it comes later

    async def scene() -> None:
        nothing = lambda *_: None  # noqa: E731
        events = PortEvents(nothing, nothing, nothing, refusals.put_nowait)
        port = SerialPort(line.path, SerialSettings(baud=9600), events)
        tell = port._tell_refusal
        monkeypatch.setattr(port, "_tell_refusal", lambda path, error: (told.append(error), tell(path, error)))
        await port.open()
        for already in range(2):
            for code in ("E101", "E103", "E102", "E101", "E101"):
                port._note_refusal(failure(code))
            assert len(told) == already and refusals.empty(), "not three in a row"
            for _ in range(3):
                port._note_refusal(failure("E101"))
            async with asyncio.timeout(5):
                assert (await refusals.get()).code == "E101"
            port._release()
            port._open()
        port.close()
        assert refusals.empty()

    asyncio.run(scene())


def test_who_holds_a_port_is_looked_for_once_and_beside_the_loop(
    ear: Any, line: Pty, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A replugged port that ModemManager had taken first stopped the loop for 0.2 s at each try, where a machine's processes
    had ten thousand files open: five kills for it, and the gateway ended."""
    name, asked, refusals = tmp_path / "usb-FTDI-port0", list[bool](), list[PortError]()
    name.symlink_to(line.path)

    def looking(path: str) -> str:
        asked.append(threading.current_thread() is threading.main_thread())
        return f"{path} is held by ModemManager (pid 7)"

    async def scene() -> None:
        events = PortEvents(ear.on_bytes, ear.on_lost, ear.on_open, refusals.append)
        port = SerialPort(str(name), SerialSettings(baud=9600), events)
        await port.open()
        other = Pty()
        holder = open_descriptor(other.path, SerialSettings(baud=9600))
        name.unlink()
        name.symlink_to(other.path)
        line.close()
        await ear.until(lambda: bool(ear.losses))
        for _ in range(6):
            port._stop_reopening()
            port._reopen()
        async with asyncio.timeout(5):
            while not refusals:
                await asyncio.sleep(0.001)
        assert [str(refusal) for refusal in refusals] == [f"E103 {name} is held by ModemManager (pid 7)"]
        assert asked == [False], "once, and not in the loop's thread"
        os.close(holder)
        await ear.until(lambda: len(ear.opened) == 2)
        port.close()
        other.close()

    monkeypatch.setattr("gateway.ports.errors.describe_holders", looking)
    asyncio.run(scene())


@pytest.mark.parametrize(("refusals", "codes"), [(3, ["E101"]), (0, [])], ids=["still", "open by then"])
def test_a_refusal_that_is_found_out_behind_the_opening_is_told_nobody(
    refusals: int, codes: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Who holds a port is looked for in a thread; it may have opened before that is known."""
    told, answers = list[PortError](), list[Any]()

    class Later:
        def __call__(self, work: Any, done: Any) -> None:
            answers.append(done)

        def close(self) -> None:
            pass

    monkeypatch.setattr(serial_port, "DiskWorker", Later)
    events = PortEvents(lambda *_: None, lambda _: None, lambda _: None, on_refused=told.append)
    port = SerialPort("/dev/no-such", SerialSettings(baud=9600), events)
    port._is_wanted = True
    port._tell_refusal("/dev/no-such", PermissionError(errno.EACCES, "denied"))
    port._refusals = refusals
    answers[0](PortError("E101", "may not be opened"))
    assert [error.code for error in told] == codes
