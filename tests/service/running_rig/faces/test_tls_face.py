"""A TLS face of a running rig: on the same bank as the plain one, the owner known by its certificate, told when ready."""

import asyncio
import errno
import re
import struct
import threading
from dataclasses import replace
from ipaddress import ip_network
from pathlib import Path
from typing import Any

import pytest

from gateway.fieldbus import tls_settings
from gateway.modbus import pdu
from gateway.plain_file import read_plain
from gateway.processes.disk_worker import DiskWorker
from gateway.profiles.rigs.faces import RtuFace, TlsFace
from gateway.service.running_rig.faces import faces, faces_to_come
from gateway.service.running_rig.starting import StartError
from tests.certificates import Folder, serial_of, store_all
from tests.fieldbus.by_hand import framed
from tests.fieldbus.tls.by_hand import client
from tests.service.rigs import demo
from tests.service.running_rig.faces.test_faces import Served


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Folder:
    return store_all(tmp_path_factory.mktemp("certificates"))


def rig_with(folder: Folder, certificate: str = "gateway") -> Any:
    rig = demo()
    face = TlsFace(
        type="tls", port=0, certificate=folder.crt(certificate), key=folder.key("gateway"), ca=folder.crt("ca")
    )
    return replace(rig, fieldbus=(face,), network=replace(rig.network, port=0))


async def ask(port: int, request: bytes, context: Any = None) -> bytes:
    reader, writer = await asyncio.open_connection("127.0.0.1", port, ssl=context)
    try:
        writer.write(framed(request))
        size = struct.unpack(">4xH", await reader.readexactly(6))[0]
        return (await reader.readexactly(size))[1:]
    finally:
        writer.transport.abort()


def test_both_faces_serve_one_bank_and_the_certificate_owns(folder: Folder) -> None:
    async def scene() -> None:
        served = Served(rig_with(folder))
        async with served.running():
            plain, tls = served.told
            assert (plain.type, tls.type, tls.facts["host"]) == ("tcp", "tls", "127.0.0.1")
            command = pdu.write_registers_request(0, struct.pack(">HH", 1, 1200))
            assert await ask(tls.facts["port"], command, client(folder, "setpoint")) == command[:5]
            assert served.bank.owner == "certificate setpoint"
            assert await ask(plain.facts["port"], pdu.write_register_request(1, 1300)) == b"\x86\x06"
            while not any(peer.identity == "certificate setpoint" for peer in served.closed):
                await asyncio.sleep(0.001)

    asyncio.run(asyncio.wait_for(scene(), 20.0))


def test_a_certificate_that_is_connected_to_one_face_still_has_not_gone_with_its_connection_to_another(
    folder: Folder,
) -> None:
    """A program that only looks, beside the master's own: the end of the first took the force of the second."""

    async def scene() -> None:
        rig = rig_with(folder)
        served = Served(replace(rig, fieldbus=(*rig.fieldbus, *rig.fieldbus)))
        async with served.running():
            _, here, there = (face.facts["port"] for face in served.told)
            context, request = client(folder, "setpoint"), pdu.read_request(3, 0, 1)
            reader, writer = await asyncio.open_connection("127.0.0.1", here, ssl=context)
            writer.write(framed(request))
            await reader.readexactly(11)
            await ask(there, request, context)
            while len(served.faces.peers) > 1:
                await asyncio.sleep(0.001)
            assert served.closed == []
            writer.transport.abort()
            while not served.closed:
                await asyncio.sleep(0.001)
            assert [peer.identity for peer in served.closed] == ["certificate setpoint"]

    asyncio.run(asyncio.wait_for(scene(), 20.0))


def test_a_face_on_any_free_port_has_the_same_one_behind_a_restart(folder: Folder) -> None:
    """As plain Modbus TCP has: a master that connected again found nobody."""

    async def scene() -> None:
        rig = rig_with(folder)
        before, after = (Served(replace(rig, fieldbus=(RtuFace(type="rtu"), *rig.fieldbus))) for _ in range(2))
        async with before.running():
            port = before.told[1].facts["port"]
        after.faces.tls_ports = dict(before.faces.tls_ports)
        assert after.faces.tls_ports == {"2": port}
        async with after.running(is_restart=True):
            assert [face.facts["port"] for face in after.told if face.type == "tls"] == [port]
            assert after.faces.tls_ports == {"2": port}

    asyncio.run(asyncio.wait_for(scene(), 20.0))


def test_who_is_revoked_in_the_rig_file_stays_out(folder: Folder) -> None:
    async def scene() -> None:
        rig = rig_with(folder)
        face = replace(rig.fieldbus[0], revoked=(serial_of("setpoint"),))
        served = Served(replace(rig, fieldbus=(face,)))
        async with served.running():
            port, request = served.told[1].facts["port"], pdu.read_request(3, 0, 1)
            with pytest.raises((OSError, EOFError)):
                await ask(port, request, client(folder, "setpoint"))
            assert [line.split()[0] for line in served.log] == ["W245"]
            assert await ask(port, request, client(folder, "admin")) == bytes((3, 2, 0, 0))

    asyncio.run(asyncio.wait_for(scene(), 20.0))


def test_a_serial_face_is_counted_by_its_place_among_all(folder: Folder) -> None:
    """As `network.owner` and the log name it."""

    async def scene() -> None:
        rig = rig_with(folder)
        served = Served(replace(rig, fieldbus=(*rig.fieldbus, RtuFace(type="rtu"))))
        async with served.running():
            assert [face.facts["host"] for face in served.told if face.type == "rtu"] == ["serial:2"]

    asyncio.run(asyncio.wait_for(scene(), 20.0))


def test_files_that_changed_since_check_keep_the_rig_from_starting(folder: Folder) -> None:
    async def scene() -> None:
        async with Served(rig_with(folder, "admin")).running():
            pass

    with pytest.raises(StartError, match=r"E174 .*cannot be used") as caught:
        asyncio.run(scene())
    assert caught.value.exit_code == 78


def test_an_address_that_this_machine_has_not_is_told_as_such(folder: Folder) -> None:
    rig = rig_with(folder)
    face = replace(rig.fieldbus[0], bind="192.0.2.9", allow=(ip_network("192.0.2.0/24"),))
    faces = Served(replace(rig, network=replace(rig.network, plain=False), fieldbus=(face,))).faces
    with pytest.raises(StartError, match=r"^E121 cannot listen on 192\.0\.2\.9:0: .*is no address of this machine"):
        asyncio.run(faces.start(None, is_restart=False))


def test_files_that_changed_since_the_start_cost_a_restart_their_own_face_only(folder: Folder) -> None:
    """The gateway used up its restarts over them and ended."""

    async def scene() -> None:
        served = Served(rig_with(folder, "admin"))
        async with served.running(is_restart=True):
            (plain,) = served.told
            assert await ask(plain.facts["port"], pdu.read_request(3, 0, 1)) == bytes((3, 2, 0, 0))
            assert [line.split()[0] for line in served.log] == ["E174"] and "without this face" in served.log[0]

    asyncio.run(asyncio.wait_for(scene(), 20.0))


def test_a_face_whose_files_are_good_again_is_served_without_another_start(
    folder: Folder, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def scene() -> None:
        monkeypatch.setattr(faces_to_come, "AGAIN_S", 0.001)
        is_served, rig, key = asyncio.Event(), rig_with(folder), tmp_path / "gateway.key"
        key.write_text("half a k")
        served = Served(replace(rig, fieldbus=(replace(rig.fieldbus[0], key=key),)))
        served.faces.on_served = is_served.set
        async with served.running(is_restart=True):
            key.write_bytes(Path(folder.key("gateway")).read_bytes())
            await is_served.wait()
            assert re.fullmatch(r"modbus tls 127\.0\.0\.1:\d+ is served again", served.log[-1])

    asyncio.run(asyncio.wait_for(scene(), 20.0))


def test_a_face_holds_to_the_certificates_and_networks_of_its_own_section(
    folder: Folder, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One that was lost or stolen is turned away by its number."""
    made: list[Any] = []
    monkeypatch.setattr(faces, "ModbusTlsServer", lambda bank, settings, **_: made.append(settings))
    rig = rig_with(folder)
    face = replace(rig.fieldbus[0], revoked=("1A2B",), allow=(ip_network("192.168.125.0/24"),))
    faces.make_tls_server(rig, face, None, lambda peer: None, lambda cause, text: None)  # type: ignore[arg-type]
    (settings,) = made
    assert settings.revoked == {"1A2B"}
    assert settings.server.allow == face.allow


def test_the_command_that_says_more_of_a_face_s_files_can_be_pasted(folder: Folder, tmp_path: Path) -> None:
    rig, empty = rig_with(folder), tmp_path / "server key.pem"
    empty.write_text("")
    face = replace(rig.fieldbus[0], key=str(empty))
    with pytest.raises(StartError) as caught:
        unused = replace(rig, file=tmp_path / "left cell.yaml")
        faces.make_tls_server(unused, face, None, lambda peer: None, lambda cause, text: None)  # type: ignore[arg-type]
    assert f"force-gateway check '{tmp_path}/left cell.yaml' says more" in str(caught.value)


def test_a_disk_that_keeps_a_face_s_files_waiting_does_not_stop_the_loop(
    folder: Folder, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is tried every five seconds, while a force may be held: the guardian killed control for each attempt."""
    goes_on = threading.Event()

    def hang(file: str) -> bytes:
        assert goes_on.wait(10.0), "the loop stood still with it"
        return read_plain(file)

    async def scene() -> None:
        monkeypatch.setattr(faces_to_come, "AGAIN_S", 0.001)
        rig, key, is_served = rig_with(folder), tmp_path / "gateway.key", asyncio.Event()
        key.write_text("half a k")
        served = Served(replace(rig, fieldbus=(replace(rig.fieldbus[0], key=key),)))
        served.faces.on_served = is_served.set
        async with served.running(is_restart=True):
            key.write_bytes(Path(folder.key("gateway")).read_bytes())
            monkeypatch.setattr(tls_settings, "read_plain", hang)
            asyncio.get_running_loop().call_later(0.05, goes_on.set)
            await is_served.wait()
            assert served.log[-1].endswith("is served again")

    asyncio.run(asyncio.wait_for(scene(), 20.0))


def test_a_machine_without_a_thread_for_the_files_says_so(folder: Folder, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(worker: DiskWorker, work: Any) -> None:
        raise OSError(errno.EAGAIN, "no thread for the disk")

    async def scene() -> None:
        monkeypatch.setattr(DiskWorker, "_submit", refuse)
        async with Served(rig_with(folder)).running():
            pass

    with pytest.raises(StartError, match=r"E174 .*cannot be used: .*no thread for the disk"):
        asyncio.run(scene())
