"""The guardian's final safe-voltage write: repeated until acknowledged, at most three times, whatever a dead process
left on the wire."""

import fcntl
import os
import resource
import select
import threading
import time
from collections.abc import Callable

import pytest

from gateway.devices import output_device
from gateway.devices.messages import Accepted, Garbage, SetVoltage
from gateway.ports import Pty
from gateway.service.supervisor import safe_line
from gateway.service.supervisor.safe_line import SafeLine
from tests.service.rigs import demo

FRAME, REPLY, END = b"SET 0\r\n", b"0\r\n", b"\r\n"
PATIENT_S = 5.0  # where the answer comes, and is not waited for any longer
SHORT_S = 0.05


class Regulator:
    """The shipped device role at the far end of a pty, in a thread; `answers` turns a reply into what is sent."""

    def __init__(self, pty: Pty, answers: Callable[[bytes], bytes] = lambda reply: reply) -> None:
        self.pty = pty
        self.heard: list[object] = []
        self.setting_v = 5.0
        self._answers = answers
        self._device = output_device(demo().output.device)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run)

    def __enter__(self) -> "Regulator":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._stop.is_set():
            try:
                chunk = os.read(self.pty.fd, 256)
            except BlockingIOError:
                time.sleep(0.001)
                continue
            for request in self._device.receive(chunk, 0.0):
                self.heard.append(request)
                os.write(self.pty.fd, self._answers(self._answer(request)))

    def _answer(self, request: object) -> bytes:
        if isinstance(request, SetVoltage):
            self.setting_v = request.voltage_v
            return self._device.reply(Accepted(request.voltage_v))
        assert isinstance(request, Garbage)
        return self._device.reply(self._device.refusal(request))


def test_a_device_that_never_stops_talking_is_not_listened_to_for_ever(pty: Pty, client: int) -> None:
    is_over = threading.Event()

    def babble() -> None:
        while not is_over.wait(0.2 * SHORT_S):
            os.write(pty.fd, b"7\r\n")

    talker = threading.Thread(target=babble)
    talker.start()
    heard: list[bool] = []
    writer = threading.Thread(target=lambda: heard.append(SafeLine(client, FRAME, REPLY, END).write_safe(SHORT_S)))
    writer.start()
    writer.join(40 * SHORT_S)
    is_over.set()
    talker.join()
    assert heard == [False]
    writer.join()


def test_an_acknowledged_safe_voltage_is_written_once(pty: Pty, client: int) -> None:
    with Regulator(pty) as device:
        assert SafeLine(client, FRAME, REPLY, END).write_safe(PATIENT_S)
    assert device.heard == [SetVoltage(0.0)]


def test_half_a_command_of_a_dead_process_swallows_one_frame_and_no_more(pty: Pty, client: int) -> None:
    os.write(client, b"SET 51")
    with Regulator(pty) as device:
        assert SafeLine(client, FRAME, REPLY, END).write_safe(SHORT_S)
    assert device.setting_v == 0.0
    assert [type(request) for request in device.heard] == [Garbage, SetVoltage]


@pytest.mark.parametrize("half", [b"S", b"SET", b"SET ", b"SET 5", b"MO", b"SET 51\r"])
def test_whatever_half_it_is_the_safe_voltage_stands_in_the_end(pty: Pty, client: int, half: bytes) -> None:
    os.write(client, half)
    with Regulator(pty) as device:
        assert SafeLine(client, FRAME, REPLY, END).write_safe(SHORT_S)
    assert device.setting_v == 0.0


@pytest.mark.parametrize("other", [b"510\r\n", b"10\r\n", b"00\r\n", b"0", b"\r\n", b"0.\r\n"])
def test_another_answer_does_not_acknowledge(pty: Pty, client: int, other: bytes) -> None:
    with Regulator(pty, answers=lambda reply: other) as device:
        assert not SafeLine(client, FRAME, REPLY, END).write_safe(SHORT_S)
    assert device.heard == [SetVoltage(0.0)] * 3


def test_the_answer_to_an_older_question_may_come_before_the_acknowledgement(pty: Pty, client: int) -> None:
    with Regulator(pty, answers=lambda reply: b"510\r\n" + reply) as device:
        assert SafeLine(client, FRAME, REPLY, END).write_safe(PATIENT_S)
    assert len(device.heard) == 1


@pytest.mark.parametrize(
    ("reply", "is_acknowledged"), [(b"V1 0.000\r\n", True), (b"", False), (b"V1 5.000\r\n", False)]
)
def test_our_own_words_may_come_ahead_of_it_on_its_line(
    pty: Pty, client: int, reply: bytes, is_acknowledged: bool
) -> None:
    """A question ends with LF, its answer with CR LF, and the adapter hears itself (TTi PL: `V1 0.000`, then `V1?`)."""
    frame = b"V1 0.000\nV1?\n"
    heard: list[bool] = []
    line = SafeLine(client, frame, b"V1 0.000\r\n", END)
    writer = threading.Thread(target=lambda: heard.append(line.write_safe(PATIENT_S if is_acknowledged else SHORT_S)))
    writer.start()
    while writer.is_alive():
        if said := _heard(pty):
            os.write(pty.fd, said + reply)
        writer.join(0.001)
    assert heard == [is_acknowledged]


def test_what_was_said_before_the_frame_acknowledges_nothing(pty: Pty, client: int) -> None:
    """A pressure of 0 that nobody has read yet looks like the echo of SET 0."""
    os.write(pty.fd, b"0\r\n")
    os.write(client, b"SET 51")
    with Regulator(pty) as device:
        assert SafeLine(client, FRAME, REPLY, END).write_safe(SHORT_S)
    assert device.setting_v == 0.0


def test_an_answer_in_pieces_acknowledges(pty: Pty, client: int) -> None:
    line = SafeLine(client, FRAME, REPLY, END)

    def slowly() -> None:
        while not _heard(pty):
            time.sleep(0.001)
        for piece in (b"0", b"\r", b"\n"):
            os.write(pty.fd, piece)
            time.sleep(0.002)

    thread = threading.Thread(target=slowly)
    thread.start()
    assert line.write_safe(0.5)
    thread.join()


def _heard(pty: Pty) -> bytes:
    try:
        return os.read(pty.fd, 256)
    except BlockingIOError:
        return b""


def test_a_silent_device_gets_three_frames_and_no_more(pty: Pty, client: int) -> None:
    began_s = time.monotonic()
    assert not SafeLine(client, FRAME, REPLY, END).write_safe(SHORT_S)
    assert time.monotonic() - began_s < 10 * SHORT_S
    assert os.read(pty.fd, 256) == FRAME * 3


def test_a_device_that_never_answers_is_believed_after_one_frame(pty: Pty, client: int) -> None:
    assert SafeLine(client, FRAME, b"", END).write_safe(SHORT_S)
    assert os.read(pty.fd, 256) == FRAME


def test_a_port_that_is_gone_is_no_acknowledgement(client: int, pty: Pty) -> None:
    pty.close()
    assert not SafeLine(client, FRAME, REPLY, END).write_safe(SHORT_S)


def test_a_dead_descriptor_is_no_acknowledgement_and_no_exception() -> None:
    reader, writer = os.pipe()
    os.close(reader)
    os.close(writer)
    line = SafeLine(writer, FRAME, REPLY, END)
    assert not line.write_safe(SHORT_S)
    line.close()


def test_a_descriptor_may_have_any_number(pty: Pty, client: int) -> None:
    """Started by a program that leaves a thousand files open in its children, the guardian had its line at 1100: an internal
    error in the place of the last write."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if 0 < hard <= 1100:
        pytest.skip("a process may have fewer files open here")
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(2048, hard), hard))
    try:
        high = fcntl.fcntl(client, fcntl.F_DUPFD_CLOEXEC, 1100)
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
    with Regulator(pty) as regulator:
        line = SafeLine(high, FRAME, REPLY, END)
        assert line.write_safe()
        line.close()
    assert regulator.setting_v == 0.0


def test_a_line_that_takes_no_bytes_does_not_hold_the_guardian(pty: Pty, client: int) -> None:
    try:
        while True:
            os.write(client, b"x" * 4096)
    except BlockingIOError:
        pass
    began_s = time.monotonic()
    assert not SafeLine(client, FRAME, REPLY, END).write_safe(SHORT_S)
    assert time.monotonic() - began_s < 1.0


def test_a_line_that_is_full_for_a_moment_gets_the_frame(
    pty: Pty, client: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What a dead process has written goes out first, as fast as the wire is."""
    with pytest.raises(BlockingIOError):
        while True:
            os.write(client, b"x" * 4096)
    wait = safe_line._is_ready

    def drained(descriptor: int, event: int, timeout_s: float) -> bool:
        while event == select.POLLOUT and _heard(pty):
            pass
        return wait(descriptor, event, timeout_s)

    with monkeypatch.context() as patch:
        patch.setattr(safe_line, "_is_ready", drained)
        assert SafeLine(client, FRAME, b"", END).write_safe(SHORT_S)


def test_the_guardian_is_held_for_less_than_a_second_whatever_the_line_does(monkeypatch: pytest.MonkeyPatch) -> None:
    """It has other children to end, and a service manager that waits for its word."""
    clock_s = [0.0]

    def nothing_comes(_: int, event: int, timeout_s: float) -> bool:
        clock_s[0] += 0.0 if event == select.POLLOUT else timeout_s
        return event == select.POLLOUT

    reader, writer = os.pipe()
    with monkeypatch.context() as patch:
        patch.setattr(safe_line, "_is_ready", nothing_comes)
        patch.setattr(time, "monotonic", lambda: clock_s[0])
        assert not SafeLine(writer, FRAME, REPLY, END).write_safe()
    assert 0.1 < clock_s[0] < 1.0
    assert os.read(reader, 64) == FRAME * 3
    os.close(reader)
    os.close(writer)


@pytest.mark.parametrize(
    ("reply", "end", "received", "is_acknowledged"),
    [
        ("01060000000089ca", "", "01060000000089ca", True),  # Modbus RTU, no line's end
        ("01060000000089ca", "", "ff01060000000089ca", True),  # noise before it
        ("01060000000089ca", "", "010600000000", False),
        ("0106000d0a0089c9", "", "0106000d0a0089c9", True),  # a line's end within
        ("300d0a", "0d0a", "3531300d0a", False),  # 510 is not 0
        ("300d0a", "0d0a", "300d0a", True),
        ("3003", "03", "35313003", False),  # neither where a line ends with ETX
        ("3003", "03", "3f033003", True),
        ("3003", "03", "30", False),
        ("02303103", "03", "0202303103", False),  # half a frame before it
        ("02303103", "03", "3f0302303103", True),
        ("0230030d0a", "0d0a", "0230030d0a", True),  # ETX as text ahead of the line's end
        ("0230030d0a", "0d0a", "023003", False),
        ("30090d0a", "0d0a", "30090d0a", True),
        ("414b3b4646", "3b4646", "414b3b4646", True),  # AK;FF
        ("414b3b4646", "3b4646", "54414b3b4646", False),
        ("303e", "3e", "300d0a303e", False),  # lines that end with a prompt
        ("300a0d", "0a0d", "3f0a0d300a0d", True),
        ("300d0a", "0d0a", "03300d0a", False),  # ETX ends no line here
    ],
)
def test_a_reply_in_lines_and_one_in_bytes_are_told_apart(
    reply: str, end: str, received: str, is_acknowledged: bool
) -> None:
    line = SafeLine(-1, b"", bytes.fromhex(reply), bytes.fromhex(end))
    assert line._acknowledges(bytes.fromhex(received)) is is_acknowledged
