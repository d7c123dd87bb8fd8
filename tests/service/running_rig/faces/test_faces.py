"""The faces of one rig: all on one bank, one owner across them, and a port that cannot be served told with its place."""

import asyncio
import os
import re
import socket
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import pytest

from gateway.fieldbus import ModbusRtuServer
from gateway.fieldbus.rtu_server import STANDSTILL_S
from gateway.modbus import Peer, Role
from gateway.modbus import pdu as P  # noqa: N812
from gateway.modbus.rtu import encode_adu
from gateway.ports import PortError, Pty, SerialPort
from gateway.profiles import Rig
from gateway.profiles.rigs.faces import RtuFace
from gateway.registers import RegisterBank
from gateway.service.banner import Ready, ServedFace, format_banner, ready_fields
from gateway.service.running_rig.bank_rules import bank_rules
from gateway.service.running_rig.faces import faces_to_come
from gateway.service.running_rig.faces.faces import Faces, with_rtu_face
from gateway.service.running_rig.starting import StartError
from tests.service.rigs import demo


@dataclass
class Served:
    """The faces of a rig with their bank, and what they have told."""

    rig: Rig
    log: list[str] = field(default_factory=list)
    closed: list[Peer] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.bank = RegisterBank(self.rig.register_map, bank_rules(self.rig), now=time.monotonic)
        self.faces = Faces(self.rig, self.bank, self.closed.append, lambda _, told: self.log.append(told))

    @asynccontextmanager
    async def running(self, bind: list[Any] | None = None, *, is_restart: bool = False) -> AsyncIterator["Served"]:
        try:
            self.told = await self.faces.start(bind, is_restart=is_restart)
            yield self
        finally:
            await self.faces.close()


def serial(*ports: str | None, plain: bool = False, **network: Any) -> Rig:
    rig = demo()
    faces = tuple(RtuFace(type="rtu", port=port, baud=115200, unit=place) for place, port in enumerate(ports, 1))
    return replace(rig, fieldbus=faces, network=replace(rig.network, plain=plain, port=0, **network))


async def ask(line: Pty, unit: int, pdu: bytes) -> bytes:
    """The PDU of the answer that a master on this line gets."""
    os.write(line.fd, encode_adu(unit, pdu))
    data = b""
    while len(data) < 5 or (not data[1] & 0x80 and len(data) < 8):
        try:
            data += os.read(line.fd, 256)
        except BlockingIOError:
            await asyncio.sleep(0.001)
    return data[1:-2]


def play(scene: Any) -> None:
    asyncio.run(asyncio.wait_for(scene, 20.0))


def test_two_serial_masters_have_one_owner_and_may_take_over() -> None:
    async def scene() -> None:
        lines = [Pty(), Pty()]
        async with Served(serial(lines[0].path, lines[1].path)).running() as served:
            assert served.faces.modbus is None and [face.type for face in served.told] == ["rtu", "rtu"]
            enable = P.write_registers_request(0, bytes.fromhex("0001 04b0"))
            assert await ask(lines[0], 1, enable) == enable[:5]
            assert served.bank.owner == "serial:1"
            assert await ask(lines[1], 2, P.write_register_request(1, 900)) == b"\x86\x06"
            take_over = P.write_registers_request(0, bytes.fromhex("0009 0384"))
            assert await ask(lines[1], 2, take_over) == take_over[:5]
            assert served.bank.owner == "serial:2"
            assert await ask(lines[0], 1, P.write_register_request(1, 900)) == b"\x86\x06"
            assert {peer.host for peer in served.faces.peers} == {"serial:1", "serial:2"}
            lines[1].close()
            while not served.closed:
                await asyncio.sleep(0.001)
            assert [peer.host for peer in served.closed] == ["serial:2"]
            assert [peer.host for peer in served.faces.peers] == ["serial:1"]
        lines[0].close()

    play(scene())


def test_each_serial_face_is_told_of_a_standstill_and_of_no_shorter_pause(monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[str] = []
    monkeypatch.setattr(ModbusRtuServer, "note_standstill", lambda face: told.append(face.settings.peer.host))

    async def scene() -> None:
        async with Served(serial(None, None)).running() as served:
            served.faces.note_tick(STANDSTILL_S)
            assert told == []
            served.faces.note_tick(STANDSTILL_S + 0.01)
            assert told == ["serial:1", "serial:2"]

    play(scene())


def test_a_rig_may_name_the_master_on_a_serial_face_its_owner() -> None:
    async def scene() -> None:
        lines = [Pty(), Pty()]
        async with Served(serial(lines[0].path, lines[1].path, owner="serial:2")).running():
            assert await ask(lines[0], 1, P.write_register_request(1, 900)) == b"\x86\x06"
            assert await ask(lines[1], 2, P.write_register_request(1, 900)) == P.write_register_request(1, 900)
        for line in lines:
            line.close()

    play(scene())


def test_a_face_may_be_for_looking_only() -> None:
    async def scene() -> None:
        line, rig = Pty(), serial(None)
        rig = replace(rig, fieldbus=(replace(rig.fieldbus[0], port=line.path, role="monitor"),))
        async with Served(rig).running() as served:
            assert await ask(line, 1, P.write_register_request(1, 900)) == b"\x86\x01"
            assert len(await ask(line, 1, P.read_request(3, 100, 2))) == 6
            assert served.bank.owner is None
        line.close()

    play(scene())


def test_a_serial_port_that_is_not_there_ends_a_start_but_not_a_restart() -> None:
    async def scene() -> None:
        with pytest.raises(
            StartError, match=r"^E102 /dev/no-such is not there.*\(the port of Modbus RTU face serial:1\)$"
        ):
            async with Served(serial("/dev/no-such")).running():
                pass
        async with Served(serial("/dev/no-such")).running(is_restart=True) as served:
            assert served.faces.peers == () and ["E102" in told for told in served.log] == [True]

    play(scene())


def test_a_permission_taken_away_costs_a_restart_the_serial_face_only(monkeypatch: pytest.MonkeyPatch) -> None:
    async def forbid(port: SerialPort) -> None:
        raise PortError("E101", f"{port.path}: permission denied")

    async def scene() -> None:
        monkeypatch.setattr(SerialPort, "open", forbid)
        async with Served(serial("/dev/no-such", plain=True)).running(is_restart=True) as served:
            assert [face.type for face in served.told] == ["tcp", "rtu"]
            assert ["E101" in told for told in served.log] == [True]

    play(scene())


def test_a_permission_that_comes_a_moment_behind_the_name_does_not_end_a_start(monkeypatch: pytest.MonkeyPatch) -> None:
    opens, tries = SerialPort.open, list[str]()

    async def forbid_once(port: SerialPort) -> None:
        tries.append(port.path)
        if len(tries) == 1:
            raise PortError("E101", f"{port.path}: permission denied")
        await opens(port)

    async def scene() -> None:
        line = Pty()
        monkeypatch.setattr(SerialPort, "open", forbid_once)
        async with Served(serial(line.path)).running() as served:
            assert ([face.type for face in served.told], tries) == (["rtu"], [line.path] * 2)
        line.close()

    play(scene())


def test_an_address_that_is_gone_or_held_costs_a_restart_its_face_only_until_it_is_back(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Five restarts found it gone within a minute, and the gateway ended."""

    async def scene() -> None:
        monkeypatch.setattr(faces_to_come, "AGAIN_S", 0.001)
        line, holder = Pty(), socket.create_server(("127.0.0.1", 0))
        host, port = holder.getsockname()
        is_served = asyncio.Event()
        served = Served(serial(line.path, plain=True))
        served.faces.on_served = is_served.set
        async with served.running([host, port], is_restart=True):
            assert [face.type for face in served.told] == ["rtu"] and served.faces.modbus is None
            assert len(await ask(line, 1, P.read_request(3, 100, 2))) == 6
            assert re.fullmatch(r"E121 cannot listen on .* without this face, tried again every .* s", served.log[0])
            holder.close()
            await is_served.wait()
            assert served.faces.modbus == (host, port)
            assert served.log[1:] == [f"modbus tcp {host}:{port} is served again"]
            with socket.create_connection((host, port)):
                pass
        line.close()

    play(scene())


def test_a_face_that_never_comes_is_told_once_and_ends_with_the_others() -> None:
    async def scene() -> None:
        served = Served(serial(plain=True))
        async with served.running(["192.0.2.9", 5020], is_restart=True):
            assert served.told == () and len(served.log) == 1

    play(scene())


def test_a_reason_is_told_once_until_it_is_another_and_a_face_that_is_served_is_left_alone() -> None:
    async def scene() -> None:
        log, ended = list[str](), asyncio.Event()
        attempts = iter(["held", "held", "gone", "gone", "held"])

        async def serve() -> ServedFace:
            if why := next(attempts, ""):
                raise StartError(why, 1)
            return ServedFace("tcp", "there", "", {})

        to_come = faces_to_come.FacesToCome(
            lambda _, told: log.append(told), ended.set, sleep=lambda _: asyncio.sleep(0)
        )
        to_come.add("tcp", serve, StartError("held", 1))
        await ended.wait()
        for _ in range(5):
            await asyncio.sleep(0)
        assert log[0].startswith("held; it goes on") and log[1:] == ["gone", "held", "modbus tcp there is served again"]
        await to_come.close()

    play(scene())


def test_a_restart_without_plain_modbus_tcp_does_not_end_over_where_to_bind_it() -> None:
    async def scene() -> None:
        async with Served(serial(None)).running(["127.0.0.1", 0], is_restart=True) as served:
            assert [face.type for face in served.told] == ["rtu"]

    play(scene())


def test_a_serial_face_without_a_role_of_its_own_has_that_of_the_plain_faces() -> None:
    async def scene() -> None:
        for may_upload, role in ((False, Role.SETPOINT), (True, Role.CALIBRATION)):
            async with Served(serial(None, allow_plain_upload=may_upload)).running() as served:
                assert [peer.role for peer in served.faces.peers] == [role]

    play(scene())


def test_the_banner_and_the_json_line_tell_every_face() -> None:
    async def scene() -> None:
        async with Served(serial(None, plain=True)).running() as served:
            tcp, rtu = served.told
            path = served.faces.serial_paths[0]
            ready = Ready(served.rig, served.faces.modbus, "/dev/pts/4", "/dev/pts/6", 0.0, 0.0, faces=served.told)
            assert f"modbus rtu   {path}   115200 8E1  unit 1   owner is shown as serial:1" in format_banner(ready)
            assert f"mbpoll -m rtu -b 115200 -P none -a 1 -1 -r 1 {path} 1 1200" in format_banner(ready)
            fields = ready_fields(ready)
            assert fields["modbus"] == [tcp.facts["host"], tcp.facts["port"]]
            assert [face["type"] for face in fields["faces"]] == ["tcp", "rtu"]
            assert fields["faces"][1]["port"] == path == rtu.where
            alone = ready_fields(replace(ready, modbus=None, faces=(rtu,)))
            assert alone["modbus"] is None

    play(scene())


def test_where_there_is_no_plain_modbus_tcp_bind_means_nothing() -> None:
    async def scene() -> None:
        with pytest.raises(StartError, match=r"^E125 --bind: rig demo has no plain Modbus TCP"):
            async with Served(serial(None)).running(["127.0.0.1", 0]):
                pass

    play(scene())


def test_one_more_face_takes_no_port_that_the_rig_uses(tmp_path: Path) -> None:
    assert [face.port for face in with_rtu_face(demo(), "").fieldbus] == [None]
    link = tmp_path / "by-id"
    link.symlink_to("/dev/ttyS9")
    for rig in (serial("/dev/ttyS9"), replace(demo(), output=replace(demo().output, port="/dev/ttyS9"))):
        with pytest.raises(StartError, match=r"^E124 --rtu .* is used by rig demo"):
            with_rtu_face(rig, str(link))
    named_by_link = replace(demo(), output=replace(demo().output, port=str(link)))
    with pytest.raises(StartError, match=r"^E124 --rtu /dev/ttyS9 is used by rig demo"):
        with_rtu_face(named_by_link, "/dev/ttyS9")
