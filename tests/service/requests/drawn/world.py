"""A wired gateway with all ways in, on one virtual clock: sockets under the gateway's own transport, a serial line,
control.sock without its socket, the page and MQTT commands in front of it."""

import asyncio
import json
import select
import socket
from collections import deque
from collections.abc import Callable
from functools import partial
from ipaddress import ip_network
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.calibrations.activation import ActiveCalibration
from gateway.devices import SerialSettings
from gateway.fieldbus import ModbusRtuServer, RtuSettings, ServerSettings, connection, rtu_server, socket_transport
from gateway.fieldbus.connection import Connection, ServerState
from gateway.fieldbus.peers import Peers
from gateway.fieldbus.rate_limits import LogLimiter
from gateway.fieldbus.socket_transport import ReadySockets, SocketTransport
from gateway.modbus import Peer
from gateway.profiles import Rig
from gateway.service import live_answers
from gateway.service.running_rig.bank_rules import plain_role
from gateway.telemetry.mqtt.register_commands import RegisterCommands
from gateway.web import server as page_server
from gateway.web.commands import Commands
from gateway.web.context import WebContext
from gateway.web.security import PageAccess
from gateway.web.tabs import recordings, run_follower
from tests.disk.at_once import AtOnce
from tests.fieldbus.conftest import HandClock
from tests.service.requests.stage import Stage
from tests.service.wired import STEP_S, Wired
from tests.web.asgi import Answer, call
from tests.web.commanded_gateway import Link

TOKEN = "0123456789abcdef0123"
RTU_UNIT, LINE = 3, SerialSettings(baud=115200)
POLL_STEPS, BEAT_STEPS, SWEEP_STEPS, MOST_TURNS = 3, 50, 500, 5000
Judge = Callable[[Callable[..., Any]], Callable[..., Any]]


class NamedSocket(socket.socket):
    """One end of a pair that says it comes from an address."""

    address = "", 0

    def getpeername(self) -> tuple[str, int]:
        return self.address


class CertifiedTransport(SocketTransport):
    """What a connection is told of a client that has shown a certificate; its bytes come as they are."""

    def __init__(self, ready: ReadySockets, wire: socket.socket, protocol: asyncio.Protocol, peer: Peer) -> None:
        self._peer = peer
        super().__init__(ready, wire, protocol)

    def get_extra_info(self, name: str, default: Any = None) -> Any:
        known = {"modbus_peer": self._peer, "modbus_taken": 1, "modbus_more": False}
        return known[name] if name in known else super().get_extra_info(name, default)


class World:
    """A rig with its faces. judged: wraps each function that executes a request."""

    def __init__(self, state: Path, rig: Rig, patch: pytest.MonkeyPatch, judged: Judge) -> None:
        self.stage, self._steps = Stage(state, Wired(rig).ready()), 0
        self.wired = self.stage.wired
        self.bank, self.rig = self.wired.bank, self.wired.rig
        self.clock = HandClock()
        self.clock.now_s = self.wired.now_s
        self._soon: list[tuple[Callable[..., None], tuple[Any, ...]]] = []
        self.errors: list[Any] = []
        self._far: list[socket.socket] = []
        self.on_beat: Callable[[], None] = lambda: None
        self.asked: dict[str, deque[float]] = {}
        """When each address has asked: its connections share one rate."""
        self.sleepers: list[tuple[float, asyncio.Future[None]]] = []
        self.loop = asyncio.new_event_loop()
        self._serve_uploads()
        self._patch(patch, judged)
        self.ready = ReadySockets()
        networks = (ip_network("10.0.0.0/8"), ip_network("127.0.0.0/8"))
        settings = ServerSettings(units=rig.network.units, role=plain_role(rig), allow=networks)
        self.log: list[str] = []
        gate = LogLimiter(lambda cause, told: self.log.append(told))
        peers = Peers(settings, guarded=True)
        self.shared = ServerState(self.bank, settings, self.clock, gate, peers, self._on_closed)
        self._serve_bus()
        self._serve_page()

    # -- what the faces stand on

    def _serve_uploads(self) -> None:
        upload = self.stage.upload
        upload.run_in_background, upload.on_use = AtOnce(), self._use
        self.stage.plants.run_in_background = AtOnce()

    def _use(self, active: ActiveCalibration) -> None:
        """As the running rig does."""
        self.wired.controller.use(self.rig.calibration_in_use(active.calibration, active.model))
        self.bank.set_active_model(active.calibration, active.pointer.active.slot_word)
        self.wired.loop.refresh()

    def _patch(self, patch: pytest.MonkeyPatch, judged: Judge) -> None:
        """The loop, the clock and the judge of every face."""
        patch.setattr(socket_transport, "asyncio", SimpleNamespace(get_running_loop=lambda: self))
        patch.setattr(rtu_server, "asyncio", SimpleNamespace(get_running_loop=lambda: self.clock))
        patch.setattr(rtu_server, "monotonic_s", self.clock.time)
        for module, names in (
            (connection, ("whole_answer", "answer", "refuse_unit")),
            (rtu_server, ("answer", "refuse_echo")),
            (live_answers, ("answer", "refuse_unit")),
        ):
            for name in names:
                patch.setattr(module, name, judged(getattr(module, name)))

        async def ask_once(_state: Path, request: dict[str, Any]) -> dict[str, Any]:
            return await Link(self.stage).ask(request)

        for module in (page_server, recordings, run_follower):
            patch.setattr(module, "ask_once", ask_once)
        patch.setattr(page_server, "Commands", partial(Commands, clock=self.clock.time, sleep=self._sleep))

    def _on_closed(self, peer: Peer) -> None:
        if peer.identity == self.bank.owner:
            self.wired.loop.owner_connected = False

    # -- as an event loop

    def add_reader(self, descriptor: int, serve: Callable[..., None], *about: Any) -> None:
        self._descriptor, self._ready = descriptor, (serve, about)

    def remove_reader(self, descriptor: int) -> None:
        self._descriptor = -1

    def call_soon(self, callback: Callable[..., None], *about: Any) -> None:
        self._soon.append((callback, about))

    def call_exception_handler(self, context: dict[str, Any]) -> None:
        self.errors.append(context)

    def poll(self) -> None:
        """Serve the sockets until none has anything."""
        for _ in range(MOST_TURNS):
            soon, self._soon = self._soon, []
            for callback, about in soon:
                callback(*about)
            if self._descriptor >= 0 and select.select([self._descriptor], [], [], 0)[0]:
                serve, given = self._ready
                serve(*given)
            elif not self._soon:
                return
        raise AssertionError("the sockets are never done")

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / STEP_S)):
            self._steps += 1
            self.wired._step()
            self.clock.advance(self.wired.now_s - self.clock.now_s)
            if self._steps % SWEEP_STEPS == 0:
                for each in tuple(self.shared.connections):
                    each.sweep(self.clock.now_s)
                self.shared.peers.forget(self.clock.now_s)
            if self._steps % POLL_STEPS == 0:
                self.poll()
            self._wake()
            if self._steps % BEAT_STEPS == 0:
                self.on_beat()

    async def _sleep(self, seconds: float) -> None:
        waits = self.loop.create_future()
        self.sleepers.append((self.clock.now_s + seconds, waits))
        await waits

    def _wake(self) -> None:
        due = [one for one in self.sleepers if one[0] <= self.clock.now_s]
        for one in due:
            self.sleepers.remove(one)
            if not one[1].done():
                one[1].set_result(None)
        if due:
            self.do(_turns())

    def do(self, coroutine: Any) -> Any:
        return self.loop.run_until_complete(coroutine)

    # -- the faces

    def connect(self, host: str, port: int, certified: Peer | None) -> socket.socket:
        """A client's end, which reads without waiting."""
        ours, far = socket.socketpair()
        wire = NamedSocket(fileno=ours.detach())
        wire.address = host, port
        wire.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 8192)
        far.setblocking(False)
        self._far.append(far)
        protocol = Connection(self.shared)
        if certified:
            CertifiedTransport(self.ready, wire, protocol, certified)
        else:
            self.ready.add(wire, protocol)
        self.poll()
        return far

    def _serve_bus(self) -> None:
        peer = Peer("serial:1", role=plain_role(self.rig))
        settings = RtuSettings("/dev/pts/9999", LINE, RTU_UNIT, peer)
        self.bus = ModbusRtuServer(self.bank, settings, on_peer_closed=self._on_closed, log=lambda _, told: None)
        self.bus_sent: list[tuple[float, bytes]] = []
        self.bus.port = SimpleNamespace(  # type: ignore[assignment]
            write=lambda data: self.bus_sent.append((self.clock.now_s, data)),
            read_arrived=lambda: None,
            unsent_bytes=0,
            path="bus",
            is_open=True,
        )

    def hear(self, data: bytes) -> None:
        """Bytes on the bus."""
        self.bus._on_bytes(data, self.clock.now_s)

    def _serve_page(self) -> None:
        context = WebContext(self.stage.state, self.rig.name, True, Link(self.stage))  # type: ignore[arg-type]
        context.__dict__ |= {"profile": self.rig, "questions": Link(self.stage)}
        self.page = page_server.make_app(context, PageAccess("127.0.0.1", 8080, TOKEN), None)
        self.mqtt = RegisterCommands(
            self.rig.register_map,
            Link(self.stage),
            self.rig.network.units[0],
            self.clock.time,  # type: ignore[arg-type]
        )

    def ask_page(self, method: str, path: str, headers: dict[str, str], body: Any) -> Answer:
        return self.do(call(self.page, method, path, headers, json.dumps(body).encode()))  # type: ignore[no-any-return]

    def close(self) -> None:
        for one in tuple(self.shared.connections):
            one.abort()
        self.poll()
        for far in self._far:
            far.close()
        self.ready.close()
        self.do(_cancel_others())
        self.loop.close()
        self.stage.close()


async def _turns() -> None:
    for _ in range(5):
        await asyncio.sleep(0)


async def _cancel_others() -> None:
    tasks = asyncio.all_tasks() - {asyncio.current_task()}
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)
