"""Who asks: clients of Modbus TCP and TLS, the master on the bus. Each counts what it is owed: one answer for each request, in
order, and soon."""

import struct
from collections import deque
from contextlib import suppress
from random import Random

from gateway.modbus import Peer
from gateway.modbus.rtu import encode_adu
from tests.fuzz.frame_model import crc, frames_of
from tests.service.requests.drawn.reference import is_whole
from tests.service.requests.drawn.world import RTU_UNIT, World
from tests.simulation.masters.spelling import write_one_pdu, write_pdu

KEEPER = "10.0.0.8"
SOON_S = 0.02
BURST, PER_S = 45, 190.0
"""Requests that an address may ask at once, and in a second, without waiting for their turn; a little less than it may."""


class Client:
    """One program with one connection at a time. certified: of TLS."""

    def __init__(self, world: World, host: str, certified: Peer | None = None) -> None:
        self._world, self.host, self.certified = world, host, certified
        self.peer = certified or Peer(host)
        self.name = str(self.peer)
        self._ports = iter(range(40000, 60000))
        self.broken: list[str] = []
        self._asked = world.asked.setdefault(host, deque(maxlen=400))
        self.connect()

    def connect(self) -> None:
        self.owed: deque[tuple[float, int, int, int]] = deque()
        self.heard, self.is_closed, self.reads = b"", False, True
        self._transaction, self._late_until_s = 0, 0.0
        self.wire = self._world.connect(self.host, next(self._ports), self.certified)

    def frame(self, pdu: bytes, unit: int = 1) -> bytes:
        """A request that is owed an answer from now on."""
        self._transaction = (self._transaction + 1) & 0xFFFF
        now_s = self._world.clock.now_s
        self.owed.append((now_s, self._transaction, unit, pdu[0]))
        self._asked.append(now_s)
        return struct.pack(">HHHB", self._transaction, 0, len(pdu) + 1, unit) + pdu

    def send(self, data: bytes) -> None:
        with suppress(OSError):
            sent = self.wire.send(data)
            assert sent == len(data), "a test's own buffer is too small"
        self._world.poll()
        self.collect()

    def collect(self) -> None:
        """Read what has come, and compare it with what is owed."""
        if not self.reads or self.is_closed:
            return
        try:
            while chunk := self.wire.recv(65536):
                self.heard += chunk
                self._world.poll()  # there is room for more
            self.is_closed = True
        except BlockingIOError:
            pass
        except OSError:
            self.is_closed = True
        frames, is_lost = frames_of(self.heard)
        if is_lost:
            self.broken.append(f"{self.name} is told no Modbus: {self.heard[:40].hex()}")
        self.heard = self.heard[sum(7 + len(pdu) for _, _, pdu in frames) :]
        for transaction, unit, pdu in frames:
            if not self.owed:
                self.broken.append(f"{self.name} has asked nothing and is told {pdu.hex()}")
                continue
            _, owed, owed_unit, function = self.owed.popleft()
            if (transaction, unit, pdu[0] & 0x7F) != (owed, owed_unit, function & 0x7F):
                self.broken.append(f"{self.name} is owed {owed} of {function}, and told {transaction} {pdu.hex()}")

    def judge_time(self) -> None:
        """Whoever keeps to its rate and reads has its answer soon."""
        now_s = self._world.clock.now_s
        in_a_second = sum(at_s > now_s - 1.0 for at_s in self._asked)
        if in_a_second > BURST and not self.host.startswith("127."):
            self._late_until_s = now_s + 1.0
        is_late = self.owed and now_s - self.owed[0][0] > SOON_S
        if is_late and self.reads and not self.is_closed and now_s > self._late_until_s:
            self.broken.append(f"{self.name} waits for {self.owed[0]} at {now_s:.3f}")
            self.owed.clear()

    def leave(self, draw: Random) -> str:
        """Close, half or wholly, with what is unread (a reset) or without."""
        how = draw.choice(("closes", "shuts", "resets"))
        with suppress(OSError):
            if how == "shuts":
                self.wire.shutdown(1)
                self._world.poll()
                self.collect()
        self.wire.close()
        self._world.poll()
        self.connect()
        return how


class Keeper(Client):
    """A master who holds a force through all that the others ask, and beats."""

    def __init__(self, world: World) -> None:
        super().__init__(world, KEEPER)
        self._beat = 0
        self.send(self.frame(write_pdu(0, 1, 1200, 0, 0, 0)))
        world.on_beat = self._send_beat
        world.run(0.5)

    def _send_beat(self) -> None:
        self._beat = self._beat % 65000 + 1
        self.send(self.frame(write_one_pdu(4, self._beat)))


class Bus:
    """The master of the serial line, and whatever else is on it."""

    def __init__(self, world: World) -> None:
        self._world, self.name, self.broken = world, "bus", list[str]()
        self.peer = world.bus.settings.peer
        self.ask(struct.pack(">BHH", 3, 100, 2))

    def ask(self, pdu: bytes, unit: int = RTU_UNIT, noise: bytes = b"") -> None:
        world = self._world
        if noise:
            world.hear(noise)
            world.run(0.1)
        count, began_s = len(world.bus_sent), world.clock.now_s
        world.hear(encode_adu(unit, pdu))
        world.run(0.03)
        answers = world.bus_sent[count:]
        if unit != RTU_UNIT:
            if answers:
                self.broken.append(f"unit {unit} is answered {answers}")
            return
        if not is_whole(pdu):
            world.run(0.1)  # what comes soon behind it belongs to it
            return
        if len(answers) != 1:
            self.broken.append(f"{pdu.hex()} behind noise {noise.hex()} has {len(answers)} answers")
            return
        (at_s, data) = answers[0]
        if data[-2:] != crc(data[:-2]) or data[0] != RTU_UNIT or data[1] & 0x7F != pdu[0] & 0x7F:
            self.broken.append(f"{pdu.hex()} is answered {data.hex()}")
        if at_s - began_s > SOON_S:
            self.broken.append(f"{pdu.hex()} is answered after {at_s - began_s} s")
