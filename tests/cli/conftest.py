"""A gateway's Modbus face for the client verbs: the real TCP server and the real register map before a bank of plain words
that counts what it is asked, in a thread of its own."""

import asyncio
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import pytest
from click.testing import CliRunner, Result

from gateway.cli.diagnosis import progress_line
from gateway.cli.main import command
from gateway.codes.refusals import RefusalReason
from gateway.devices import SerialSettings
from gateway.fieldbus import ModbusRtuServer, ModbusTcpServer, RtuSettings, ServerSettings
from gateway.modbus import ModbusError, Peer, RequestError, Role
from gateway.modbus.peer import NOBODY
from gateway.profiles import load_register_map
from gateway.registers import RegisterMap


@dataclass
class PlainBank:
    """One word per address. refuse: address -> (exception, reason) for writes that touch it."""

    register_map: RegisterMap
    words: dict[int, int] = field(default_factory=dict)
    writes: list[tuple[int, tuple[int, ...]]] = field(default_factory=list)
    reads: list[tuple[int, int]] = field(default_factory=list)
    refuse: dict[int, tuple[int, RefusalReason]] = field(default_factory=dict)
    identity: Mapping[int, bytes] = field(default_factory=dict)

    @property
    def known_answers(self) -> dict[bytes, bytes]:
        """None is known: each read is counted."""
        return {}

    def __post_init__(self) -> None:
        self.set("map_hash", self.register_map.map_hash)

    def set(self, name: str, value: float) -> None:
        register = self.register_map.find(name)
        data = register.encode(value)
        for at in range(register.words):
            self.words[register.address + at] = int.from_bytes(data[2 * at : 2 * at + 2], "big")

    def get(self, name: str) -> float:
        register = self.register_map.find(name)
        return register.decode(self.read(register.address, register.words))

    def read(self, address: int, count: int) -> bytes:
        return b"".join(self.words.get(at, 0).to_bytes(2, "big") for at in range(address, address + count))

    def note_refusal(self, refusal: RequestError, peer: Peer) -> None:
        """The protocol's own refusals: nothing here keeps them."""

    def check_registers_readable(self, address: int, count: int, peer: Peer = NOBODY) -> None:
        if not any(block.first <= address and address + count - 1 <= block.last for block in self.register_map.blocks):
            raise ModbusError(2, "outside")

    def read_registers(self, address: int, count: int, peer: Peer = NOBODY) -> bytes:
        self.check_registers_readable(address, count)
        self.reads.append((address, count))
        return self.read(address, count)

    def write_registers(self, address: int, data: bytes, peer: Peer) -> None:
        words = tuple(int.from_bytes(data[at : at + 2], "big") for at in range(0, len(data), 2))
        for at in range(address, address + len(words)):
            if at in self.refuse:
                code, reason = self.refuse[at]
                self.set("refusal_address", at)
                self.set("refusal_reason", reason)
                self.set("refusal_value", words[at - address] / 100)
                raise ModbusError(code, "refused")
        self.writes.append((address, words))
        self.words |= {address + at: word for at, word in enumerate(words)}

    def read_bits(self, address: int, count: int, peer: Peer = NOBODY, *, is_write: bool = False) -> bytes:
        raise ModbusError(1, "not here")

    def write_bits(self, address: int, values: Sequence[bool], peer: Peer) -> None:
        raise ModbusError(1, "not here")

    def mask_write(self, address: int, and_mask: int, or_mask: int, peer: Peer) -> None:
        raise ModbusError(1, "not here")


class Server(threading.Thread):
    """Runs the server until stop() is called; `bound` is set when it listens: on TCP, and as unit 3 on a terminal of its own
    (`serial_path`)."""

    def __init__(self, bank: PlainBank, port: int = 0, role: Role = Role.CALIBRATION) -> None:
        super().__init__(daemon=True)
        self.bank = bank
        self.port = port
        self.role = role
        self.bound = threading.Event()

    def run(self) -> None:
        asyncio.run(self._serve())

    async def _serve(self) -> None:
        self._running_loop, self._asked_to_end = asyncio.get_running_loop(), asyncio.Event()
        server = ModbusTcpServer(
            self.bank,
            ServerSettings(role=self.role),
            on_peer_closed=lambda peer: None,
            log=lambda cause, sentence: None,
        )
        _, self.port = await server.start("127.0.0.1", self.port)
        serial = ModbusRtuServer(
            self.bank,
            RtuSettings(None, SerialSettings(baud=115200), 3, Peer("serial:1", role=self.role)),
            on_peer_closed=lambda peer: None,
            log=lambda cause, sentence: None,
        )
        await serial.start()
        self.serial_path = serial.path
        self.bound.set()
        await self._asked_to_end.wait()
        await server.close()
        await serial.close()

    @property
    def address(self) -> str:
        return f"127.0.0.1:{self.port}"

    def stop(self) -> None:
        """A second call does nothing."""
        if not self.is_alive():
            return
        self._running_loop.call_soon_threadsafe(self._asked_to_end.set)
        self.join(10)


@pytest.fixture(scope="session")
def register_map() -> RegisterMap:
    return load_register_map("force-v1")


@pytest.fixture
def serve() -> Iterator[Callable[..., Server]]:
    """serve(bank, port=0) starts a server; whatever still runs at the end is stopped."""
    servers: list[Server] = []

    def start(bank: PlainBank, port: int = 0, role: Role = Role.CALIBRATION) -> Server:
        servers.append(Server(bank, port, role))
        servers[-1].start()
        assert servers[-1].bound.wait(10)
        return servers[-1]

    yield start
    for server in servers:
        server.stop()


@pytest.fixture
def fake(register_map: RegisterMap, serve: Callable[..., Server]) -> Server:
    return serve(PlainBank(register_map))


@pytest.fixture(autouse=True)
def hardly_any_progress(monkeypatch: pytest.MonkeyPatch) -> None:
    """Seconds are long on a busy machine, and lines of progress would stand between those that tests compare."""
    monkeypatch.setattr(progress_line, "_QUIET_S", 60.0)


@pytest.fixture
def call() -> Callable[..., Result]:
    """`force-gateway WORDS` in this process."""

    def invoke(*words: object, **options: Any) -> Result:
        return CliRunner().invoke(command, [str(word) for word in words], **options)

    return invoke
