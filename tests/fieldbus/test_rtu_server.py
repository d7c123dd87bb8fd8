"""The serial face on a real pty: answers, silence, an unplug, and an independent client."""

import asyncio
import os
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pymodbus.client import ModbusSerialClient

from gateway.devices import SerialSettings
from gateway.fieldbus import ModbusRtuServer, RtuSettings, rtu_server
from gateway.modbus import Peer
from gateway.modbus import pdu as P  # noqa: N812
from gateway.modbus.rtu import LONGEST_ADU, encode_adu, silence_s
from gateway.modbus.rtu_receiver import RtuRequest
from gateway.ports import PortError, Pty
from gateway.ports.port import monotonic_s
from tests.fieldbus.conftest import NotingBank

LINE = SerialSettings(baud=115200)
FACE = Peer("serial:1")
READ = P.read_request(3, 10, 2)
ANSWER = encode_adu(3, bytes.fromhex("03 04 0000 0000"))


@dataclass
class Face:
    """A server with its bank, and what it has told."""

    bank: NotingBank = field(default_factory=NotingBank)
    log: list[str] = field(default_factory=list)
    causes: list[str] = field(default_factory=list)
    gone: list[Peer] = field(default_factory=list)
    server: Any = None

    @asynccontextmanager
    async def serving(self, path: str | None) -> AsyncIterator["Face"]:
        settings = RtuSettings(path, LINE, unit=3, peer=FACE)
        self.server = ModbusRtuServer(self.bank, settings, on_peer_closed=self.gone.append, log=self.note)
        await self.server.start()
        try:
            yield self
        finally:
            await self.server.close()

    def note(self, cause: str, told: str) -> None:
        self.log.append(told)
        self.causes.append(cause)

    async def until_told(self, part: str) -> str:
        while not (told := [line for line in self.log if part in line]):
            await asyncio.sleep(0.002)
        return told[0]

    async def until_heard(self, *, frames: int, noise_bytes: int) -> None:
        """What comes now lies behind a silence, however late this program is."""
        while (self.server._receiver.frames, self.server._receiver.noise_bytes) != (frames, noise_bytes):
            await asyncio.sleep(0.001)


async def heard(fd: int, size: int) -> bytes:
    """As many bytes as the master's end of the line gets."""
    data = b""
    while len(data) < size:
        try:
            data += os.read(fd, size - len(data))
        except BlockingIOError:
            await asyncio.sleep(0.001)
    return data


def is_silent(fd: int) -> bool:
    try:
        return not os.read(fd, 1)
    except BlockingIOError:
        return True


def play(scene: Any) -> None:
    asyncio.run(asyncio.wait_for(scene, 20.0))


def test_a_request_is_answered_and_a_foreign_or_damaged_one_gets_no_byte() -> None:
    async def scene() -> None:
        line = Pty()
        async with Face().serving(line.path) as face:
            wanted = encode_adu(3, READ)
            damaged, to_all = wanted[:-1] + b"\x00", encode_adu(0, P.write_register_request(5, 77))
            for unheard, frames, noise_bytes in ((encode_adu(4, READ), 1, 0), (damaged, 2, 8), (to_all, 4, 8)):
                os.write(line.fd, unheard)
                await face.until_heard(frames=frames, noise_bytes=noise_bytes)
                assert is_silent(line.fd)
                os.write(line.fd, wanted)
                assert await heard(line.fd, len(ANSWER)) == ANSWER
            assert face.bank.writes == [(5, b"\x00M", FACE)]
            os.write(line.fd, encode_adu(3, P.read_request(3, 9999, 1)))
            assert await heard(line.fd, 5) == encode_adu(3, b"\x83\x02")
            assert face.server.peers == (FACE,)
        line.close()

    play(scene())


def test_a_port_that_was_unplugged_is_served_again(tmp_path: Path) -> None:
    async def scene() -> None:
        lines, name = [Pty(), Pty()], tmp_path / "rs485"
        name.symlink_to(lines[0].path)
        async with Face().serving(str(name)) as face:
            os.write(lines[0].fd, encode_adu(3, READ)[:5])  # half a request, then the plug
            while not face.server._receiver._burst:
                await asyncio.sleep(0)
            name.unlink()
            lines[0].close()
            assert "disconnected" in await face.until_told("E102")
            assert face.gone == [FACE] and face.server.peers == ()
            name.symlink_to(lines[1].path)
            await face.until_told("is back")
            assert {cause for cause, told in zip(face.causes, face.log, strict=True) if "latency" not in told} == {
                f"face {FACE}"
            }
            os.write(lines[1].fd, encode_adu(3, READ)[5:])  # the other half is no request together with the first
            await face.until_heard(frames=0, noise_bytes=3)
            assert is_silent(lines[1].fd)
            os.write(lines[1].fd, encode_adu(3, READ))
            assert await heard(lines[1].fd, len(ANSWER)) == ANSWER
        lines[1].close()

    play(scene())


def test_answers_do_not_pile_up_behind_a_slow_line() -> None:
    """Who asks again before an answer is through the wire is obeyed, and gets none of an hour ago."""

    async def scene() -> None:
        async with Face().serving(None) as face:
            for k in range(20):
                write = P.read_write_request(0, 125, 20, bytes((0, k)))
                face.server._execute(RtuRequest(3, write, True))
                assert face.server._backlog_bytes <= 2 * LONGEST_ADU
            assert face.server._backlog_bytes > LONGEST_ADU, "one answer may wait for the one before it"
            assert [data for _, data, _ in face.bank.writes] == [bytes((0, k)) for k in range(20)]

    play(scene())


def test_an_answer_that_comes_back_is_not_asked_again_but_a_terminal_gives_none_back(tmp_path: Path) -> None:
    """An adapter for two wires hears itself, and what answers FC06 is a request, letter by letter."""
    name = tmp_path / "terminal"
    name.symlink_to("/dev/pts/99999")
    for path, is_heard in (("/dev/ttyNONE", False), ("/dev/pts/99999", True), (str(name), True)):
        bank = NotingBank()
        settings = RtuSettings(path, LINE, unit=3, peer=FACE)
        server = ModbusRtuServer(bank, settings, on_peer_closed=lambda peer: None, log=lambda cause, told: None)
        write, now_s = P.write_register_request(0, 7), monotonic_s()
        server._execute(RtuRequest(3, write, True))
        server._receiver.receive(encode_adu(3, write), now_s)
        assert len(bank.writes) == 1
        assert server._receiver.take(now_s + 1.0) == [RtuRequest(3, write, True)] * is_heard, path


def test_a_face_that_is_closed_executes_nothing_more_and_waits_as_long_as_the_line_must_be_silent() -> None:
    async def scene() -> None:
        async with Face().serving(None) as face:
            face.server._on_bytes(encode_adu(3, P.write_register_request(5, 77)), monotonic_s())
            timer = face.server._timer
            assert timer.when() - asyncio.get_running_loop().time() > 0.5 * silence_s(LINE.baud, LINE.character_s)
        assert timer.cancelled() and face.bank.writes == []

    play(scene())


def test_a_port_that_is_back_and_does_not_open_is_told() -> None:
    face, settings = Face(), RtuSettings("/dev/ttyNONE", LINE, unit=3, peer=FACE)
    server = ModbusRtuServer(face.bank, settings, on_peer_closed=face.gone.append, log=face.note)
    server.port._on_refused(PortError("E101", "no permission"))
    assert face.log == ["E101 no permission; tried again until it opens"]
    assert face.causes == [f"face {FACE}"] and face.gone == []


def test_noise_is_told_by_what_is_new_of_it_once_a_minute_and_as_a_wrong_line_only_where_nothing_was_heard() -> None:
    report = rtu_server._NoiseReport("115200 8N1")
    assert report.tell(0, 5, 100.0) == "", "an adapter that is plugged in makes a few bytes"
    assert "W235 {path}: 30 bytes" in report.tell(3, 30, 101.0)
    assert report.tell(4, 30, 300.0) == ""
    assert "W235 {path}: 3 bytes" in report.tell(4, 33, 301.0)
    assert report.tell(5, 40, 360.9) == ""
    assert "W235 {path}: 8 bytes" in report.tell(5, 41, 361.1)
    deaf = rtu_server._NoiseReport("115200 8N1")
    assert "W236 {path}: 24 bytes" in deaf.tell(0, 24, 0.0) and deaf.tell(0, 1000, 1000.0) == ""


def test_noise_is_told_once_and_a_line_that_is_set_otherwise_as_such() -> None:
    async def scene() -> None:
        line = Pty()
        async with Face().serving(line.path) as face:
            for sent in range(1, 9):
                os.write(line.fd, b"\xfe\x80\xfe\x80\xf8")
                await face.until_heard(frames=0, noise_bytes=5 * sent)
            assert "is the master set to another baud or parity?" in await face.until_told("W236")
            os.write(line.fd, encode_adu(3, READ) + b"\xff\xff")
            assert await heard(line.fd, len(ANSWER)) == ANSWER
            for sent in range(1, 4):
                os.write(line.fd, b"\xff\xff\xff")
                await face.until_heard(frames=sent, noise_bytes=42 + 3 * sent)
                os.write(line.fd, encode_adu(3, READ))
                assert await heard(line.fd, len(ANSWER)) == ANSWER
            assert len(face.log) <= 3 and all(told.startswith("W23") for told in face.log)
        line.close()

    play(scene())


def test_a_bank_that_breaks_is_told_to_the_loop() -> None:
    """An internal error is not an answer: whoever runs the loop has to end it with the safe voltage."""
    failures = []

    async def scene() -> None:
        asyncio.get_running_loop().set_exception_handler(lambda _loop, context: failures.append(context["exception"]))
        line, face = Pty(), Face()
        face.bank.image = None  # type: ignore[assignment]
        async with face.serving(line.path):
            os.write(line.fd, encode_adu(3, READ))
            while not failures:
                await asyncio.sleep(0.002)
            assert is_silent(line.fd)
        line.close()

    play(scene())
    assert isinstance(failures[0], TypeError)


def test_a_plug_pulled_while_a_request_is_executed_is_a_lost_port_and_no_defect() -> None:
    """The driver's queue cannot be asked for any more: the whole gateway ended over it, and with it every force."""
    failures: list[Any] = []

    class Unplugging(NotingBank):
        def write_registers(self, address: int, data: bytes, peer: Peer) -> None:
            super().write_registers(address, data, peer)
            line.close()

    line, face = Pty(), Face(bank=Unplugging())

    async def scene() -> None:
        asyncio.get_running_loop().set_exception_handler(lambda _loop, context: failures.append(context))
        async with face.serving(line.path):
            os.write(line.fd, encode_adu(3, P.write_register_request(5, 77)))
            assert "disconnected" in await face.until_told("E102")
            assert face.bank.writes == [(5, b"\x00M", FACE)] and face.gone == [FACE]

    play(scene())
    assert not failures


def ask(path: str, bank: NotingBank) -> None:
    """What pymodbus asks of a face, and gets."""
    client = ModbusSerialClient(path, baudrate=LINE.baud, timeout=5, retries=0)
    assert client.connect()
    try:
        values = [(number * 521) & 0xFFFF for number in range(123)]
        assert not client.write_registers(20, values, device_id=3).isError()
        assert client.read_holding_registers(20, count=123, device_id=3).registers == values
        assert client.read_input_registers(20, count=123, device_id=3).registers == values
        client.write_register(20, 0xBEEF, device_id=3)
        client.mask_write_register(address=20, and_mask=0xFF00, or_mask=0x0012, device_id=3)
        assert client.read_holding_registers(20, count=1, device_id=3).registers == [0xBE12]
        found = client.readwrite_registers(read_address=10, read_count=3, write_address=11, values=[7, 8], device_id=3)
        assert found.registers == [0, 7, 8]
        client.write_coils(3, [True, False, True, True], device_id=3)
        client.write_coil(0, True, device_id=3)
        assert client.read_coils(0, count=8, device_id=3).bits[:8] == bank.bits[:8]
        assert client.read_discrete_inputs(3, count=4, device_id=3).bits[:4] == [True, False, True, True]
        assert client.read_holding_registers(9999, count=1, device_id=3).exception_code == 2
        assert client.read_device_information(read_code=1, device_id=3).information[0] == b"Company"
        assert client.report_device_id(device_id=3).status
    finally:
        client.close()


def test_pymodbus_is_served_on_a_port_and_on_the_face_s_own_terminal() -> None:
    async def scene() -> None:
        async with Face().serving(None) as face:
            assert face.server.path.startswith("/dev/pts/")
            await asyncio.to_thread(ask, face.server.path, face.bank)

    play(scene())


def test_what_the_port_warns_of_is_told(monkeypatch: Any) -> None:
    monkeypatch.setattr("gateway.ports.serial_port.set_low_latency", lambda *_: "W112 an adapter that waits")

    async def scene() -> None:
        line = Pty()
        async with Face().serving(line.path) as face:
            assert face.log == ["W112 an adapter that waits"]
        line.close()

    play(scene())
