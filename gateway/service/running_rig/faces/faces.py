"""The faces of one running rig: plain Modbus TCP, and what `fieldbus` of its file adds; made, started and closed in one place.

All serve the same bank, so that a command counts whichever face it comes through, and ownership holds across them.
"""

import asyncio
import os
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from shlex import quote
from typing import Any

from gateway.fieldbus import ModbusRtuServer, ModbusTcpServer, ModbusTlsServer, RtuSettings, TlsSettings
from gateway.fieldbus.rtu_server import STANDSTILL_S
from gateway.modbus import Peer, Role
from gateway.ports import PortError, SerialPort
from gateway.processes import exit_codes
from gateway.processes.disk_worker import DiskWorker
from gateway.profiles import Rig
from gateway.profiles.rigs.faces import RtuFace, TlsFace
from gateway.registers import RegisterBank
from gateway.registers.writes.ownership import serial_host
from gateway.service.banner import ServedFace, tcp_face, tls_face
from gateway.service.running_rig.bank_rules import plain_role, server_settings
from gateway.service.running_rig.control_loop import Log
from gateway.service.running_rig.faces.faces_to_come import FacesToCome, Serve
from gateway.service.running_rig.starting import StartError, listen, open_again, open_first


def with_rtu_face(rig: Rig, port: str) -> Rig:
    """Return the rig with one more serial face, as Modbus sets it by default: on a port, or with an empty one on a
    pseudo-terminal. StartError for a port that the rig uses already."""
    users = {os.path.realpath(path): f"{line.replace('_', ' ')} (device)" for line, path in rig.ports().items()}
    users |= {
        os.path.realpath(face.port): "a face of its fieldbus"
        for face in rig.fieldbus
        if isinstance(face, RtuFace) and face.port
    }
    if port and (user := users.get(os.path.realpath(port))):
        remedy = "masters need an adapter of their own, `force-gateway ports` lists what is plugged in"
        raise StartError(f"E124 --rtu {port} is used by rig {rig.name}: {user}; {remedy}", exit_codes.CONFIGURATION)
    return replace(rig, fieldbus=(*rig.fieldbus, RtuFace(type="rtu", port=port or None)))


class Faces:
    """Every face of a rig. on_peer_closed: the last connection of a peer has closed, on whichever face, or its serial port
    was lost."""

    def __init__(self, rig: Rig, bank: RegisterBank, on_peer_closed: Callable[[Peer], None], log: Log) -> None:
        self._rig, self._log, self._on_peer_closed = rig, log, on_peer_closed
        self._tcp = (
            ModbusTcpServer(bank, server_settings(rig), on_peer_closed=self._on_closed, log=log)
            if rig.network.plain
            else None
        )
        self._serial = [
            ModbusRtuServer(bank, _rtu_settings(rig, face, place), on_peer_closed=self._on_closed, log=log)
            for place, face in enumerate(rig.fieldbus, start=1)
            if isinstance(face, RtuFace)
        ]
        self._make_tls = partial(make_tls_server, rig, bank=bank, on_peer_closed=self._on_closed, log=log)
        self._tls: list[ModbusTlsServer] = []
        self.tls_ports: dict[str, int] = {}  # by place in `fieldbus`: of a free port (0) the one that masters know
        self.modbus: tuple[str, int] | None = None  # where plain Modbus TCP is bound, once it is
        self.on_served: Callable[[], None] = lambda: None  # one that a restart could not serve is served
        self._to_come = FacesToCome(log, lambda: self.on_served())

    @property
    def peers(self) -> tuple[Peer, ...]:
        """Peers that are connected now, of every face."""
        return tuple(peer for face in self._all for peer in face.peers)

    @property
    def serial_paths(self) -> list[str]:
        """Paths of the serial faces; pseudo-terminals have theirs once they are started."""
        return [face.path for face in self._serial]

    @property
    def _all(self) -> list[ModbusTcpServer | ModbusRtuServer]:
        return [*([self._tcp] if self._tcp else []), *self._tls, *self._serial]

    def _on_closed(self, peer: Peer) -> None:
        """A certificate may be connected to more than one face."""
        if all(other.identity != peer.identity for other in self.peers):
            self._on_peer_closed(peer)

    async def start(self, bind: list[Any] | None, *, is_restart: bool) -> tuple[ServedFace, ...]:
        """Serve on every face; what each is. bind: HOST, PORT of plain Modbus TCP instead of the rig's. StartError says
        which face cannot be served, and why. A restart ends over none: a serial port that it does not find is a lost one, and
        what cannot listen is tried again."""
        if bind and not self._tcp and not is_restart:
            raise StartError(
                f"E125 --bind: rig {self._rig.name} has no plain Modbus TCP (network.plain: false)",
                exit_codes.CONFIGURATION,
            )
        served = []
        for name, serve in self._listening(bind):
            try:
                served.append(await serve())
            except StartError as error:
                if not is_restart:
                    raise
                self._to_come.add(name, serve, error)
        for face in self._serial:
            await self._start_serial(face, is_restart=is_restart)
            served.append(_rtu_face(face))
        return tuple(served)

    async def close(self) -> None:
        """Close every face; answers given so far are still sent."""
        await self._to_come.close()
        for face in self._all:
            await face.close()

    def _listening(self, bind: list[Any] | None) -> list[tuple[str, Serve]]:
        """Return the faces that listen on an address, by name, each with what serves it."""
        plain: list[tuple[str, Serve]] = [("tcp", partial(self._serve_tcp, bind))] if self._tcp else []
        placed = enumerate(self._rig.fieldbus, start=1)
        secure = ((str(place), face) for place, face in placed if isinstance(face, TlsFace))
        return [*plain, *(("tls", partial(self._serve_tls, place, face)) for place, face in secure)]

    def note_tick(self, since_s: float) -> None:
        """Note how long ago the tick before this one was due, s: behind a standstill a bus is not answered what waited."""
        if since_s > STANDSTILL_S:
            for face in self._serial:
                face.note_standstill()

    async def _serve_tcp(self, bind: list[Any] | None) -> ServedFace:
        assert self._tcp
        network = self._rig.network
        self.modbus = await listen(self._tcp, *(bind or (network.bind, network.port)))
        return tcp_face(*self.modbus, network.units)

    async def _serve_tls(self, place: str, face: TlsFace) -> ServedFace:
        server, port = await self._make_beside(face), face.port or self.tls_ports.get(place, 0)
        host, port = await listen(server, face.bind, port, "`port:` of the tls face, such as 8802")
        self.tls_ports[place] = port
        self._tls.append(server)
        return tls_face(host, port, self._rig.network.units)

    async def _make_beside(self, face: TlsFace) -> ModbusTlsServer:
        """In a thread: a disk may keep its files waiting, and what is tried again while a force is held must not stall it."""
        loop, worker = asyncio.get_running_loop(), DiskWorker()
        made: asyncio.Future[ModbusTlsServer] = loop.create_future()

        def take(result: ModbusTlsServer | Exception) -> None:
            if made.done():  # nobody waits for it any more
                return
            if isinstance(result, Exception):
                made.set_exception(result)
            else:
                made.set_result(result)

        worker(partial(self._make_tls, face), take)
        worker.close()
        try:
            return await made
        except OSError as error:
            raise _unusable(self._rig, face, error) from error

    async def _start_serial(self, face: ModbusRtuServer, *, is_restart: bool) -> None:
        host = face.settings.peer.host
        if is_restart:
            if face.port is None:
                await face.start()
                self._log(f"face {host}", f"{host} is now {face.path}: a pseudo-terminal ends with its process")
            else:
                await _open_again(face.port)
            return
        try:
            await open_first(face.start)
        except PortError as error:
            raise StartError(f"{error} (the port of Modbus RTU face {host})", error.exit_code) from error


async def _open_again(port: SerialPort) -> None:
    """Open the port of a face again; one that does not open is a lost one and told as such, a permission taken away, too:
    the devices' ports are those that no restart can do without."""
    try:
        await open_again(port)
    except PortError as error:
        port.begin_lost(error)


def make_tls_server(
    rig: Rig, face: TlsFace, bank: RegisterBank, on_peer_closed: Callable[[Peer], None], log: Log
) -> ModbusTlsServer:
    """Return the server of a TLS face. StartError for files that cannot be used: `check` has looked at them, and they may have
    changed since."""
    server = replace(server_settings(rig), allow=face.allow)
    settings = TlsSettings(server, face.certificate, face.key, face.ca, frozenset(face.revoked))
    try:
        return ModbusTlsServer(bank, settings, on_peer_closed=on_peer_closed, log=log)
    except OSError as error:
        raise _unusable(rig, face, error) from error


def _unusable(rig: Rig, face: TlsFace, error: OSError) -> StartError:
    what = f"E174 {face.certificate}, {face.key} or {face.ca} cannot be used: {error}"
    return StartError(f"{what}; force-gateway check {quote(str(rig.file))} says more", exit_codes.CONFIGURATION)


def _rtu_settings(rig: Rig, face: RtuFace, place: int) -> RtuSettings:
    role = Role[face.role.upper()] if face.role else plain_role(rig)
    return RtuSettings(face.port, face.settings, face.unit, Peer(serial_host(place), role=role))


def _rtu_face(face: ModbusRtuServer) -> ServedFace:
    settings = face.settings
    note = f"{settings.serial}  unit {settings.unit}   owner is shown as {settings.peer.host}"
    facts = {
        "port": face.path,
        "unit": settings.unit,
        "baud": settings.serial.baud,
        "parity": settings.serial.parity,
        "stop_bits": settings.serial.stop_bits,
        "host": settings.peer.host,
        "is_terminal": face.port is None,
    }
    return ServedFace("rtu", face.path, note, facts)
