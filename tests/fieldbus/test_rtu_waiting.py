"""When the serial face looks at what it has heard, by a loop and a clock of the test's own."""

import asyncio
import os
from struct import pack
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.devices import SerialSettings
from gateway.fieldbus import ModbusRtuServer, RtuSettings, rtu_server
from gateway.fieldbus.rtu_server import STANDSTILL_S
from gateway.modbus import Peer, RequestError, RequestFault
from gateway.modbus import pdu as P  # noqa: N812
from gateway.modbus.rtu import BROADCAST_UNIT, encode_adu, silence_s
from gateway.modbus.rtu_receiver import SPLIT_S, RtuRequest
from gateway.ports import Pty
from gateway.ports.port import monotonic_s
from tests.fieldbus.conftest import NotingBank

LINE = SerialSettings(baud=115200)
READ = P.read_request(3, 10, 2)
NOISE = b"\x03\x03\x00"


class Scene:
    """A face whose loop and clock are the test's, with what it has executed and sent."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now_s = 100.0
        self.timers = list[tuple[float, Any]]()
        self.executed = list[tuple[float, bytes]]()
        self.sent = list[tuple[float, bytes]]()
        monkeypatch.setattr(rtu_server.asyncio, "get_running_loop", lambda: self)
        monkeypatch.setattr(rtu_server, "monotonic_s", lambda: self.now_s)
        settings = RtuSettings("/dev/serial/none", LINE, unit=3, peer=Peer("serial:1"))
        self.bank = NotingBank()
        self.server = ModbusRtuServer(self.bank, settings, on_peer_closed=lambda _: None, log=lambda *_: None)
        execute = self.server._execute

        def note(request: RtuRequest) -> None:
            self.executed.append((self.now_s, request.pdu))
            execute(request)

        monkeypatch.setattr(self.server, "_execute", note)
        self.unread = b""
        port = SimpleNamespace(write=self.write, read_arrived=self.read_arrived, unsent_bytes=0, path="none")
        monkeypatch.setattr(self.server, "port", port)

    def write(self, data: bytes) -> None:
        self.sent.append((self.now_s, data))

    def read_arrived(self) -> None:
        data, self.unread = self.unread, b""
        if data:
            self.server._on_bytes(data, self.now_s)

    def call_later(self, delay_s: float, callback: Any) -> Any:
        timer = (self.now_s + delay_s, callback)
        self.timers.append(timer)
        assert len(self.timers) == 1
        return SimpleNamespace(cancel=lambda: self.timers.remove(timer))

    def run(self, until_s: float) -> None:
        """Call what is due until then."""
        while self.timers and self.timers[0][0] <= until_s:
            due_s, callback = self.timers.pop(0)
            self.now_s = max(self.now_s, due_s)
            callback()
        self.now_s = until_s

    def hear(self, *data: bytes) -> None:
        """Let each arrive, 10 ms apart."""
        for chunk in data:
            self.server._on_bytes(chunk, self.now_s)
            self.run(self.now_s + 0.01)


@pytest.fixture
def scene(monkeypatch: pytest.MonkeyPatch) -> Scene:
    return Scene(monkeypatch)


def test_a_request_soon_behind_noise_is_answered_after_its_own_silence(scene: Scene) -> None:
    """Noise that may be the beginning of a frame is waited for by 20 ms; the request behind it waited as long."""
    scene.hear(NOISE, encode_adu(3, READ), encode_adu(3, READ))
    silent_s = silence_s(LINE.baud, LINE.character_s)
    assert scene.executed == [(pytest.approx(begin_s + silent_s), READ) for begin_s in (100.01, 100.02)]
    assert len(scene.sent) == 2


@pytest.mark.parametrize(("stood_s", "answers"), [(STANDSTILL_S - 0.1, 1), (STANDSTILL_S + 0.1, 0)])
@pytest.mark.parametrize("is_read", [True, False])
def test_who_asked_before_a_standstill_is_not_answered_behind_it(
    scene: Scene, stood_s: float, answers: int, is_read: bool
) -> None:
    """It has given up: its next question would have this answer. is_read: before, or it has waited in the port."""
    if is_read:
        scene.server._on_bytes(encode_adu(3, READ), scene.now_s)
    scene.now_s += stood_s
    if not is_read:
        scene.server._on_bytes(encode_adu(3, READ), scene.now_s)
        if answers == 0:
            scene.server.note_standstill()  # as the loop's tick tells
    scene.run(scene.now_s + 0.1)
    assert (len(scene.executed), len(scene.sent)) == (1, answers)
    scene.hear(encode_adu(3, READ))
    assert len(scene.sent) == answers + 1


def test_what_came_while_the_process_was_late_is_heard_before_what_waits_for_it_is_given_up(scene: Scene) -> None:
    """Unit 9 answers with words that are a request to us, an adapter's pause before them: behind a late look at its beginning
    alone they were a frame of their own, and executed."""
    words = encode_adu(3, P.write_register_request(1, 777))
    answer = encode_adu(9, bytes((4, len(words))) + words)
    scene.server._on_bytes(answer[:3], scene.now_s)
    scene.run(scene.now_s + 0.01)
    scene.unread, scene.now_s = answer[3:], scene.now_s + 0.03
    scene.run(scene.now_s + 0.1)
    assert (scene.executed, scene.unread) == ([], b"")
    scene.hear(encode_adu(3, READ))
    assert len(scene.sent) == 1


@pytest.mark.parametrize("is_own", [False, True])
def test_a_late_turn_of_either_loop_reads_the_port_before_it_judges_the_line(run: Any, is_own: bool) -> None:
    """uvloop calls what is due behind its callbacks without a look at the ports. is_own: the face's own pseudo-terminal, whose
    bytes are still on its wire behind a look of either loop."""
    words = encode_adu(3, P.write_register_request(1, 777))
    answer = encode_adu(9, bytes((4, len(words))) + words)

    async def scene() -> None:
        line, bank, (wake, waker) = Pty(), NotingBank(), os.pipe()
        settings = RtuSettings(None if is_own else line.path, LINE, 3, Peer("serial:1"))
        server = ModbusRtuServer(bank, settings, on_peer_closed=print, log=lambda *_: None)
        await server.start()
        end = os.open(server.path, os.O_RDWR | os.O_NOCTTY) if is_own else os.dup(line.fd)
        os.write(end, answer[:3])
        while server._receiver.deadline_s is None or server._receiver._wait_s < SPLIT_S:
            await asyncio.sleep(0.001)

        def take_long() -> None:
            os.read(wake, 1)
            os.write(end, answer[3:])
            late_s = monotonic_s() + 2.0 * SPLIT_S
            while monotonic_s() < late_s:  # this process does not run
                pass

        asyncio.get_running_loop().add_reader(wake, take_long)
        os.write(waker, b"1")
        while server._receiver.frames == 0 and not bank.writes:
            await asyncio.sleep(0.001)
        assert (bank.writes, server._receiver.frames) == ([], 1)
        asyncio.get_running_loop().remove_reader(wake)
        await server.close()
        line.close()
        os.close(wake), os.close(waker), os.close(end)

    run(scene())


def test_what_waited_through_a_standstill_is_executed_for_a_stop_may_be_in_it(scene: Scene) -> None:
    stop = P.write_registers_request(0, bytes(2))
    scene.server._on_bytes(encode_adu(3, stop), scene.now_s)
    scene.server.note_standstill()
    scene.run(scene.now_s + 0.1)
    assert [(address, data) for address, data, _ in scene.bank.writes] == [(0, bytes(2))]
    assert scene.sent == []


@pytest.mark.parametrize(("at_once", "has_waited"), [(3, True), (1, False)])
@pytest.mark.parametrize("unit", [3, BROADCAST_UNIT])
def test_requests_of_who_waits_for_no_answers_have_waited_after_a_quarter_of_a_second(
    scene: Scene, unit: int, at_once: int, has_waited: bool
) -> None:
    """Its adapter's pile, a thousand heartbeats, kept a force for four seconds behind its master; ten by broadcast."""
    heartbeats = [encode_adu(unit, P.write_registers_request(4, pack(">H", beat))) for beat in range(120)]
    for first in range(0, 120, at_once):
        scene.hear(b"".join(heartbeats[first : first + at_once]), *[b""] * 2)
    late = [peer.is_behind for _, _, peer in scene.bank.writes]
    assert len(late) == 120
    assert not any(late[:24]) and all(late[30:]) is has_waited
    scene.hear(heartbeats[0])
    assert not scene.bank.writes[-1][2].is_behind, "it waits for answers again"


def test_a_request_right_behind_a_broadcast_is_no_pile(scene: Scene) -> None:
    """Nobody answers a broadcast, so nobody waits for that."""
    heartbeat = P.write_registers_request(4, bytes(2))
    for _ in range(60):
        scene.hear(encode_adu(BROADCAST_UNIT, heartbeat) + encode_adu(3, heartbeat), b"")
    assert len(scene.bank.writes) == 120
    assert not any(peer.is_behind for _, _, peer in scene.bank.writes)


def test_a_master_that_asks_again_what_it_has_given_up_has_not_waited(scene: Scene) -> None:
    heartbeat = encode_adu(3, P.write_registers_request(4, bytes(2)))
    for _ in range(20):
        scene.hear(heartbeat * 2, b"", heartbeat, b"")
    assert len(scene.bank.writes) == 60
    assert not any(peer.is_behind for _, _, peer in scene.bank.writes)


def test_a_write_that_may_be_our_own_answer_come_back_is_refused_with_a_reason(scene: Scene) -> None:
    """It was left out, and its master waited for an answer; what is refused shows what the line does."""
    told = list[RequestError]()
    scene.bank.note_refusal = lambda refusal, _peer: told.append(refusal)  # type: ignore[method-assign]
    scene.hear(*[encode_adu(3, P.write_register_request(1, 1200))] * 20)
    refused = [place for place, (_, data) in enumerate(scene.sent) if data == encode_adu(3, b"\x86\x06")]
    assert refused == [4, 9, 14] and len(scene.sent) == 20 and len(scene.bank.writes) == 17
    assert [(one.fault, one.address, one.is_write) for one in told] == [(RequestFault.ECHO, 1, True)] * 3
