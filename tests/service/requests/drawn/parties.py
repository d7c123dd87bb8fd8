"""Who asks: clients of Modbus TCP and TLS. Each counts what it is owed, one answer for each request, in order, and soon;
none is closed that keeps the rules."""

import struct
from collections import deque
from contextlib import suppress
from random import Random

from gateway.modbus import Peer, Role
from tests.fuzz.frame_model import frames_of
from tests.service.requests.drawn.secure import ROLES
from tests.service.requests.drawn.world import World
from tests.simulation.masters.spelling import write_one_pdu, write_pdu

KEEPER = "10.0.0.8"
SOON_S = 0.02
BURST, PER_S = 45, 190.0
"""Requests that an address may ask at once, and in a second, without waiting for their turn; a little less than it may."""


class Client:
    """One program with one connection at a time. certificate: its name, of a client of TLS."""

    def __init__(self, world: World, host: str, certificate: str = "") -> None:
        self._world, self.host, self.certificate = world, host, certificate
        self.role = ROLES[certificate] if certificate else world.plain_role
        self.peer = Peer(host, 5000 if certificate else 0, certificate, Role(self.role))
        self.name = str(self.peer)
        self._ports = iter(range(40000, 60000))
        self.broken: list[str] = []
        self._asked = world.asked.setdefault(host, deque(maxlen=400))
        self._places = world.secure_places if certificate else world.places
        self._transaction = 65500 if certificate else 200
        self.connect()
        self._places.onlookers.append(self.collect)

    def connect(self) -> None:
        """Connect anew; whoever finds no room is closed at once."""
        self.is_closed = True
        self._places.look()
        self.owed: deque[tuple[float, int, int, int]] = deque()
        self.heard, self.is_closed, self.reads = b"", False, True
        self._late_until_s, self._place = 0.0, None  # type: Place | None
        self.wire = self._world.connect(self.host, next(self._ports), self.certificate)
        self.collect()
        self._place = self._places.take(self.host, not self.is_closed)

    def is_there(self) -> bool:
        """Whether it has a connection, an old one or a new."""
        self.collect()
        if self.is_closed:
            self.wire.close()
            self.connect()
        return not self.is_closed

    def frame(self, pdu: bytes, unit: int = 1) -> bytes:
        """A request that is owed an answer from now on."""
        self._transaction = (self._transaction + 1) & 0xFFFF
        now_s = self._world.clock.now_s
        self.owed.append((now_s, self._transaction, unit, pdu[0]))
        self._asked.append(now_s)
        return struct.pack(">HHHB", self._transaction, 0, len(pdu) + 1, unit) + pdu

    def send(self, data: bytes) -> None:
        if self._place:
            self._place.asked_s = self._world.clock.now_s
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
            self._note_closed()
        except BlockingIOError:
            pass
        except OSError:
            self._note_closed()
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

    def _note_closed(self) -> None:
        self.is_closed = True
        if self._place:
            self._places.lose(self._place)

    def forgive(self) -> None:
        """It has broken the rules, and may be closed at any time."""
        if self._place:
            self._places.leave(self._place)
            self._place = None

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
        self.forgive()
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
