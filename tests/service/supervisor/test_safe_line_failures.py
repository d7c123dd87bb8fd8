"""The guardian's final safe-voltage write on a line whose calls fail: an adapter that says no once, or talks without end."""

import asyncio
import errno
import os
import socket
import termios
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import pytest

from gateway.devices import DeviceProfile, output_host
from gateway.ports import Pty
from gateway.processes import message_link
from gateway.service.guardian_line import GuardianLine, told_of_reply
from gateway.service.supervisor import safe_line
from gateway.service.supervisor.control_child import ControlChild
from gateway.service.supervisor.safe_line import REPLY_S, SafeLine
from tests.profile_files import load_device
from tests.service.supervisor.test_safe_line import END, FRAME, PATIENT_S, REPLY, SHORT_S, _heard


def failing(call: Callable[..., object], numbers: list[int]) -> Callable[..., object]:
    """Return the call with these errors first, one each time."""
    left = list(numbers)

    def fails_first(descriptor: int, data: object) -> object:
        if left:
            raise OSError(left.pop(0), "as told")
        return call(descriptor, data)

    return fails_first


def test_what_is_said_up_to_the_last_moment_and_is_no_acknowledgement_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    """However the time runs out: while it waits for more, or amid what has come."""
    ticks = iter(range(100))
    monkeypatch.setattr(safe_line, "time", SimpleNamespace(monotonic=lambda: 0.01 * next(ticks)))
    ours, theirs = socket.socketpair()
    with ours, theirs:
        theirs.sendall(b"7\r\n" * 1000)
        assert SafeLine(ours.fileno(), FRAME, REPLY, END)._wait_for_acknowledgement(0.055) is False
        assert ours.recv(1), "its time was over before there was nothing to read"


@pytest.mark.parametrize("number", [errno.EAGAIN, errno.EIO])
def test_what_cannot_be_read_keeps_no_safe_voltage_from_the_wire(
    pty: Pty, client: int, number: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A killed process reads on for a moment, and takes what was there to be dropped."""
    os.write(pty.fd, b"512\r\n")
    with monkeypatch.context() as patch:
        patch.setattr(os, "read", failing(os.read, [number]))
        assert SafeLine(client, FRAME, b"", END).write_safe(SHORT_S)
    assert os.read(pty.fd, 256) == FRAME


@pytest.mark.parametrize("numbers", [[errno.EIO], [errno.EIO, errno.EIO], [errno.EAGAIN] * 5])
def test_a_write_that_fails_for_a_moment_is_tried_again(
    pty: Pty, client: int, numbers: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(os, "write", failing(os.write, numbers))
        assert SafeLine(client, FRAME, b"", END).write_safe(SHORT_S)
    assert os.read(pty.fd, 256) == FRAME


def test_a_line_that_takes_no_byte_for_ever_is_given_up(client: int, monkeypatch: pytest.MonkeyPatch) -> None:
    for refusal in (failing(os.write, [errno.EAGAIN] * 10**6), lambda descriptor, data: 0):
        with monkeypatch.context() as patch:
            patch.setattr(os, "write", refusal)
            assert not SafeLine(client, FRAME, REPLY, END).write_safe(SHORT_S)


def test_a_device_that_talks_faster_than_it_can_be_read_is_told_all_the_same(
    pty: Pty, client: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    talked = 0

    def endless(descriptor: int, size: int) -> bytes:
        nonlocal talked
        talked += size
        assert talked < 10**8, "nothing is written while it talks"
        return b"7\r\n" * (size // 3)

    os.write(pty.fd, b"7\r\n")
    with monkeypatch.context() as patch:
        patch.setattr(os, "read", endless)
        assert SafeLine(client, FRAME, b"", END).write_safe(SHORT_S)
    assert os.read(pty.fd, 256) == FRAME


FC06 = bytes.fromhex("01 06 0000 0000 89CA")


@pytest.mark.parametrize(("answer", "is_acknowledged"), [(FC06, True), (b"", False), (FC06[:-1], False)])
def test_our_own_words_are_no_answer_of_a_device_that_answers_by_the_same_bytes(
    pty: Pty, client: int, answer: bytes, is_acknowledged: bool
) -> None:
    """FC06 behind an adapter that hears itself: half a command of a dead process swallowed the frame, and it was said once."""
    line, told, asked = SafeLine(client, FC06, FC06, b"", hears_itself=True), list[bool](), list[bytes]()
    patient_s = PATIENT_S if is_acknowledged else SHORT_S
    writer = threading.Thread(target=lambda: told.append(line.write_safe(patient_s)))
    writer.start()
    while writer.is_alive():
        if said := _heard(pty):
            asked.append(said)
            os.write(pty.fd, said + answer)
        writer.join(0.001)
    assert told == [is_acknowledged] and b"".join(asked) == FC06 * (1 if is_acknowledged else 3)


def test_one_copy_is_the_answer_where_nothing_comes_back(pty: Pty, client: int) -> None:
    told: list[bool] = []
    writer = threading.Thread(target=lambda: told.append(SafeLine(client, FC06, FC06, b"").write_safe(PATIENT_S)))
    writer.start()
    while writer.is_alive():
        if said := _heard(pty):
            os.write(pty.fd, said)
        writer.join(0.001)
    assert told == [True]


def test_a_terminal_that_another_program_has_stopped_sends_again(pty: Pty, client: int) -> None:
    """Control looks for it ten times a second, and may die in between: the voltage stood until the next one opened the port."""
    termios.tcflow(client, termios.TCOOFF)
    assert SafeLine(client, FRAME, b"", END).write_safe(SHORT_S)
    assert os.read(pty.fd, 256) == FRAME


def test_a_line_that_takes_a_byte_at_a_time_gets_the_whole_frame(monkeypatch: pytest.MonkeyPatch) -> None:
    reader, writer = os.pipe()
    write = os.write
    with monkeypatch.context() as patch:
        patch.setattr(os, "write", lambda descriptor, data: write(descriptor, data[:1]))
        assert SafeLine(writer, FRAME, b"", END).write_safe(SHORT_S)
    assert os.read(reader, 64) == FRAME
    os.close(reader)
    os.close(writer)


def test_a_slow_line_that_goes_on_taking_bytes_is_not_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """The patience is for a line that takes nothing: each byte took most of it, and the frame would end in its middle."""
    reader, writer = os.pipe()
    write, now_s = os.write, 0.0

    def write_slowly(descriptor: int, data: bytes) -> int:
        nonlocal now_s
        now_s += 0.8 * SHORT_S
        return write(descriptor, data[:1])

    with monkeypatch.context() as patch:
        patch.setattr(time, "monotonic", lambda: now_s)
        patch.setattr(os, "write", write_slowly)
        assert SafeLine(writer, FRAME, b"", END).write_safe(SHORT_S)
    assert os.read(reader, 64) == FRAME
    os.close(reader)
    os.close(writer)


def test_a_line_that_has_no_room_for_a_moment_is_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    reader, writer = os.pipe()
    write, refusals = os.write, iter(range(9))

    def refuse_first(descriptor: int, data: bytes) -> int:
        if next(refusals, None) is not None:
            raise BlockingIOError
        return write(descriptor, data)

    with monkeypatch.context() as patch:
        patch.setattr(os, "write", refuse_first)
        assert SafeLine(writer, FRAME, b"", END).write_safe(PATIENT_S)
    assert os.read(reader, 64) == FRAME
    os.close(reader)
    os.close(writer)


ALICAT = load_device("alicat-pc")


@pytest.mark.parametrize(
    ("said", "is_acknowledged"),
    [
        (b"B +012.34 +000.00\r", True),
        (b"A +012.34 +010.00\rA +011.02 +000.00\r", True),
        (b"A +012.34 +010.00\r", False),
        (b"A +012.34 +000.00", False),
        (b"A +012.34 +000.00" + b" " * 200 + b"\r", False),
    ],
)
def test_a_device_that_says_its_pressure_beside_the_setting_acknowledges_at_any_pressure(
    pty: Pty, client: int, said: bytes, is_acknowledged: bool
) -> None:
    """As control hands it over: of a shipped Alicat, whose pressure falls behind the frame, each stop was not acknowledged."""
    line, told = handed_over(ALICAT, client), list[bool]()
    patient_s = PATIENT_S if is_acknowledged else SHORT_S
    writer = threading.Thread(target=lambda: told.append(line.write_safe(patient_s)))
    writer.start()
    while writer.is_alive():
        if _heard(pty):
            os.write(pty.fd, said)
        writer.join(0.001)
    line.close()
    assert told == [is_acknowledged]


def test_a_device_that_takes_its_time_is_waited_for_as_its_profile_says(client: int) -> None:
    """0.1 s were waited for whatever the profile said: a slow device heard its frame three times, and acknowledged none."""
    lines = [handed_over(replace(ALICAT, reply_timeout_s=longest_s), client) for longest_s in (0.4, 0.05, 9.0)]
    assert [line.reply_timeout_s for line in lines] == [0.4, REPLY_S, 0.5]
    for line in lines:
        line.close()


def test_the_line_s_own_patience_is_what_counts(pty: Pty, client: int) -> None:
    line, told, asked = SafeLine(client, FRAME, REPLY, END, reply_timeout_s=PATIENT_S), list[bool](), list[bytes]()
    writer = threading.Thread(target=lambda: told.append(line.write_safe()))
    writer.start()
    while not asked:
        asked += [said] if (said := _heard(pty)) else []
    writer.join(2 * REPLY_S)  # no event: that it goes on waiting is what is asked
    assert writer.is_alive() and not _heard(pty)
    os.write(pty.fd, REPLY)
    writer.join()
    assert told == [True] and b"".join(asked) == FRAME


def handed_over(profile: DeviceProfile, descriptor: int) -> SafeLine:
    """The line as the guardian has it of control, both ends of their link at hand."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    host, child = output_host(profile), ControlChild.__new__(ControlChild)

    async def hand_over() -> None:
        theirs.setblocking(False)
        guardian = GuardianLine(theirs)
        guardian.hand_over(descriptor, safe_frame=host.safe_frame(0.0), **told_of_reply(host, profile))
        guardian.close()

    asyncio.run(hand_over())
    message, child.safe_line = message_link.receive(ours), None
    assert message
    child._take_line(message)
    ours.close()
    return child.safe_line
