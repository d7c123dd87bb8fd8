"""A wired gateway with all ways in, on one virtual clock: sockets under the gateway's own transport, plain and behind TLS,
serial lines, control.sock, the page and MQTT commands in front of it."""

import asyncio
import json
import socket
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import partial
from ipaddress import ip_network
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.calibrations.activation import ActiveCalibration
from gateway.devices import SerialSettings, ValveHost
from gateway.fieldbus import ModbusRtuServer, RtuSettings, ServerSettings, connection, rtu_server, socket_transport
from gateway.fieldbus.connection import Connection, ServerState
from gateway.fieldbus.peers import Peers
from gateway.fieldbus.rate_limits import LogLimiter
from gateway.fieldbus.socket_transport import ReadySockets
from gateway.fieldbus.tls_stream import Handshakes, TlsStream
from gateway.modbus import Peer, Role
from gateway.profiles import Rig
from gateway.service import live_answers
from gateway.service.running_rig.bank_rules import plain_role
from gateway.service.running_rig.lines.valve_line import ValveExchange
from gateway.telemetry.mqtt.register_commands import RegisterCommands
from gateway.web import server as page_server
from gateway.web.commands import Commands
from gateway.web.context import WebContext
from gateway.web.security import PageAccess
from gateway.web.tabs import recordings, run_follower
from tests.certificates import serial_of
from tests.disk.at_once import AtOnce
from tests.service.requests.drawn.clocks import patch_clocks
from tests.service.requests.drawn.loop import SocketLoop
from tests.service.requests.drawn.outsiders.places import Places, Rules
from tests.service.requests.drawn.secure import SecureWire, contexts
from tests.service.requests.stage import Stage
from tests.service.wired import STEP_S, Wired
from tests.web.asgi import Answer, call
from tests.web.commanded_gateway import Link

TOKEN = "0123456789abcdef0123"
UNITS, LINE = (3, 5), SerialSettings(baud=115200)
"""Of the serial lines."""
POLL_STEPS, BEAT_STEPS = 3, 50
VALVE_ANSWERS_S = 0.02
Judge = Callable[[Callable[..., Any]], Callable[..., Any]]


class NamedSocket(socket.socket):
    """One end of a pair that says it comes from an address."""

    address = "", 0

    def getpeername(self) -> tuple[str, int]:
        return self.address


@dataclass
class SerialFace:
    """One serial line. sent: to its master, and when."""

    server: ModbusRtuServer
    sent: list[tuple[float, bytes]] = field(default_factory=list)

    def hear(self, data: bytes, now_s: float) -> None:
        """Bytes on the line."""
        self.server._on_bytes(data, now_s)


class Valve:
    """The wire to the simulated valve's relay, where the rig has one."""

    def __init__(self, wired: Wired) -> None:
        self._wired, self._answers, self._step = wired, deque[tuple[float, bytes]](), wired._step
        if line := wired.rig.valve:
            wired._step = self._step_too  # type: ignore[method-assign]
            wired.loop.valve = ValveExchange(ValveHost(line.device), self._ask, line.device.reply_timeout_s)

    def _ask(self, data: bytes) -> None:
        now_s = self._wired.now_s
        self._answers.append((now_s + VALVE_ANSWERS_S, self._wired.world.on_valve_bytes(data, now_s)))

    def _step_too(self) -> None:
        self._step()
        while self._answers and self._answers[0][0] <= self._wired.now_s:
            self._wired.loop.on_valve_bytes(self._answers.popleft()[1], self._wired.now_s)


class World(SocketLoop):
    """A rig with its faces. settings: bounds of those that listen; judged: wraps each function that executes a request."""

    def __init__(
        self, state: Path, rig: Rig, settings: dict[str, Any], patch: pytest.MonkeyPatch, judged: Judge
    ) -> None:
        super().__init__()
        wired = Wired(rig)
        Valve(wired)
        self.stage, self._steps = Stage(state, wired.ready()), 0
        self.wired, self.bank, self.rig = wired, wired.bank, wired.rig
        self.clock.now_s = wired.now_s
        self._far: list[socket.socket] = []
        self.on_beat: Callable[[], None] = lambda: None
        self.asked: dict[str, deque[float]] = {}
        """When each address has asked: its connections share one rate."""
        self.sleepers: list[tuple[float, asyncio.Future[None]]] = []
        self.loop = asyncio.new_event_loop()
        self._serve_uploads()
        self._patch(patch, judged)
        self.ready = ReadySockets()
        self._listen(settings)
        self._serve_lines()
        self._serve_page()

    def _listen(self, settings: dict[str, Any]) -> None:
        networks = (ip_network("10.0.0.0/8"), ip_network("127.0.0.0/8"))
        self.settings = ServerSettings(
            units=self.rig.network.units, role=plain_role(self.rig), allow=networks, **settings
        )
        self.known_bits = 47 | (16 if self.rig.valve else 0) | (64 if self.rig.name in ("demo", "paper-pull") else 0)
        self.plain_role = 2 if self.rig.network.allow_plain_upload else 1
        self.log: list[str] = []
        gate = LogLimiter(lambda cause, told: self.log.append(told))
        self.shared, self.secure = (
            ServerState(self.bank, self.settings, self.clock, gate, Peers(self.settings, guarded=True), self._on_closed)
            for _ in range(2)
        )
        revoked, utc = frozenset((serial_of("thief"),)), f"{datetime.now(UTC):%Y%m%d%H%M%S}Z"
        self.handshakes = Handshakes(lambda: contexts()[0], revoked, lambda: utc)
        bounds, period_s = self.settings, min(2.0, self.settings.partial_s, self.settings.idle_s) / 4
        self._sweep_steps = round(period_s / STEP_S)
        rules = Rules(
            bounds.connections, bounds.per_address, bounds.idle_s, bounds.partial_s, connection.GIVES_WAY_S, period_s
        )
        self.places, self.secure_places = (Places(rules, self.clock.time) for _ in range(2))

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
        patch_clocks(patch, self.clock.time, self.stage.server.live)

    def _on_closed(self, peer: Peer) -> None:
        """As the faces of a running rig do."""
        if peer.identity == self.bank.owner and all(one.peer.identity != peer.identity for one in self.connections):
            self.wired.loop.owner_connected = False

    @property
    def connections(self) -> tuple[Connection, ...]:
        return (*self.shared.connections, *self.secure.connections)

    # -- time

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / STEP_S)):
            self._steps += 1
            self.wired._step()
            self.clock.advance(self.wired.now_s - self.clock.now_s)
            if self._steps % self._sweep_steps == 0:
                self._sweep()
            if self._steps % POLL_STEPS == 0:
                self.poll()
            self._wake()
            if self._steps % BEAT_STEPS == 0:
                self.on_beat()

    def _sweep(self) -> None:
        for each in self.connections:
            each.sweep(self.clock.now_s)
        self.handshakes.sweep(self.clock.now_s)
        for face in (self.shared, self.secure):
            face.peers.forget(self.clock.now_s)

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

    def connect(self, host: str, port: int, certificate: str = "") -> Any:
        """A client's end, which reads without waiting. certificate: that it shows, one of TLS."""
        far = self.accept(
            host, port, TlsStream(self.secure, self.handshakes) if certificate else Connection(self.shared)
        )
        return SecureWire(far, certificate, self.poll) if certificate else far

    def accept(self, host: str, port: int, protocol: asyncio.Protocol) -> socket.socket:
        """The far end of a new connection that a face serves by this protocol."""
        ours, far = socket.socketpair()
        wire = NamedSocket(fileno=ours.detach())
        wire.address = host, port
        wire.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 8192)
        far.setblocking(False)
        self._far.append(far)
        self.ready.add(wire, protocol)
        self.poll()
        return far

    def _serve_lines(self) -> None:
        self.buses = [self._line(place, unit) for place, unit in enumerate(UNITS, start=1)]

    def _line(self, place: int, unit: int) -> SerialFace:
        role = Role(self.plain_role) if place == 1 else Role.MONITOR
        settings = RtuSettings("/dev/pts/9999", LINE, unit, Peer(f"serial:{place}", role=role))
        server = ModbusRtuServer(self.bank, settings, on_peer_closed=self._on_closed, log=lambda _, told: None)
        face = SerialFace(server)
        server.port = SimpleNamespace(  # type: ignore[assignment]
            write=lambda data: face.sent.append((self.clock.now_s, data)),
            read_arrived=lambda: None,
            unsent_bytes=0,
            path="bus",
            is_open=True,
        )
        return face

    def _serve_page(self) -> None:
        context = WebContext(self.stage.state, self.rig.name, True, Link(self.stage))  # type: ignore[arg-type]
        context.__dict__ |= {"profile": self.rig, "questions": Link(self.stage)}
        self.page = page_server.make_app(context, PageAccess("127.0.0.1", 8080, TOKEN, clock_s=self.clock.time), None)
        self.mqtt = RegisterCommands(
            self.rig.register_map,
            Link(self.stage),
            self.rig.network.units[0],
            self.clock.time,  # type: ignore[arg-type]
        )

    def ask_page(self, method: str, path: str, headers: dict[str, str], body: Any) -> Answer:
        return self.do(call(self.page, method, path, headers, json.dumps(body).encode()))  # type: ignore[no-any-return]

    def close(self) -> None:
        for one in (*self.handshakes.pending, *self.connections):
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
