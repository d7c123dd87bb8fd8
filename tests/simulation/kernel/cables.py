"""Serial lines without a kernel: a cable whose bytes take the time of its baud rate, and the port at the host's end of it.

`SimulatedPort` stands where `gateway.ports.SerialPort` stands, with the same promises: a loss is told in the loop's next turn,
it is opened again with a growing pause, and nothing that was written before a loss is sent after it.
"""

import asyncio
import os
from collections import deque
from collections.abc import Callable
from math import ceil, inf

from gateway.devices import SerialSettings
from gateway.ports import PortError, PortEvents
from gateway.profiles import Rig
from gateway.profiles.rigs.faces import RtuFace
from tests.simulation.kernel.spoiled import Spoil, spoiled
from tests.simulation.kernel.virtual_time import VirtualLoop

MOST_QUEUED = 4096
"""Characters on one direction of a wire; a UART's driver drops what is more."""

STRANGE_S = 0.05


class Direction:
    """One direction of a wire. through_s: when its last byte is through; is_cut: what is on it arrives nowhere; waiting: what
    has not arrived yet, and when its first byte begins."""

    __slots__ = ("is_cut", "through_s", "waiting")

    def __init__(self) -> None:
        self.through_s, self.is_cut = 0.0, False
        self.waiting: deque[tuple[float, bytes]] = deque()


class Cable:
    """One line. on_device: bytes that have reached the device; outside: the loop of the world."""

    def __init__(
        self, outside: VirtualLoop, settings: SerialSettings, on_device: Callable[[bytes, float], None]
    ) -> None:
        self._outside, self.on_device = outside, on_device
        self.port: SimulatedPort | None = None
        self.is_plugged = True
        self.is_deaf = False  # one of its wires is broken: the device hears nothing
        self.on_unheard: Callable[[float], None] = lambda now_s: (
            None
        )  # a host has told it something, which it has not heard
        self._spoils: deque[Spoil] = deque()
        self.strange_s = 0.0  # when something strange was said last
        self.on_dropped: Callable[[bytes], None] = lambda sent: None  # of a message whose rest its host has forgotten
        self.spoiled_s = -inf  # when an answer of the device was spoiled last
        self.falsified_s = 0.0  # when its host has heard last what the device has not said, or not so
        self.answers = 0  # what the device has said so far, in sentences
        self.heard_s = 0.0  # when the host has got something last
        self.on_host: Callable[[bytes, float], None] = lambda chunk, now_s: None  # what the host has got
        self.reworded = (b"", b"")  # what the device says, and from now on says instead
        self._character_s = settings.character_s
        self._to_device, self._to_host = Direction(), Direction()
        self.adapter_s = 0.0  # how often its adapter hands over what has come; 0: each message as soon as it is whole

    def cut(self) -> None:
        """What was on the wire is lost."""
        for direction in (self._to_device, self._to_host):
            direction.is_cut = True
        self._to_device, self._to_host = Direction(), Direction()

    def drop_unsent(self) -> None:
        """Of what the host has written only what is on the wire by now arrives: its driver forgets the rest."""
        now_s, dropped = self._outside.clock.now_s, self._to_device
        if not dropped.waiting:
            return
        dropped.is_cut, self._to_device = True, Direction()
        for begin_s, data in dropped.waiting:
            if sent := data[: max(0, ceil((now_s - begin_s) / self._character_s))]:
                self._to_device.through_s = through_s = begin_s + len(sent) * self._character_s
                self._to_device.waiting.append((begin_s, sent))
                self._outside.call_at(through_s + 1e-9, self._arrive, self._to_device, sent)
                if len(sent) < len(data):
                    self.on_dropped(sent)

    @property
    def backlog_s(self) -> float:
        """Time until the device's last byte is through."""
        return max(0.0, self._to_host.through_s - self._outside.clock.now_s)

    @property
    def through_s(self) -> float:
        """When the host's last byte will have arrived."""
        return max(self._outside.clock.now_s, self._to_device.through_s + 2e-9)

    def is_disturbed(self, now_s: float) -> bool:
        """Whether what its device says does not arrive as it says it, or has not a moment ago."""
        return bool(
            self.falsified_s > now_s - STRANGE_S
            or self._spoils
            or not self.is_plugged
            or self.is_deaf
            or self.reworded[0] != self.reworded[1]
        )

    def send_to_device(self, data: bytes) -> None:
        """Put a host's bytes on the wire."""
        if self.is_deaf:
            self.on_unheard(self._outside.clock.now_s)
        elif self.is_plugged:  # a host that stood still meanwhile has not noticed yet
            self._put(self._to_device, data, self._arrive)

    def send_to_host(self, data: bytes) -> None:
        """Put a device's bytes on the wire, or what becomes of them."""
        self.answers += bool(data)
        if self.reworded[0]:
            data = data.replace(*self.reworded)
        if self._spoils and data:
            self._send_spoiled(data)
        elif self.is_plugged:
            self._put(self._to_host, data, self._reach_host)

    def spoil(self, *spoils: Spoil) -> None:
        """Do this to the next answers; with nothing: to none of them any more."""
        self._spoils = deque(one for spoil in spoils for one in [spoil] * spoil.count)

    def say(self, data: bytes) -> None:
        """Bytes that are not as the device said them, or not when: of whatever else is on this wire."""
        self.strange_s = self.falsified_s = self._outside.clock.now_s
        if self.is_plugged:
            self._put(self._to_host, data, self._reach_host)

    def _send_spoiled(self, data: bytes) -> None:
        self.spoiled_s = self.falsified_s = self._outside.clock.now_s
        for late_s, piece in spoiled(self._spoils.popleft(), data):
            self._outside.call_later(late_s, self.say, piece) if late_s else self.say(piece)

    def pull(self) -> None:
        """Pull the plug."""
        self.is_plugged = False
        self.cut()
        if self.port:
            self.port.notice_loss()

    def push(self) -> None:
        """Put it back; whoever looks for the port finds it."""
        self.is_plugged = True

    def _put(self, direction: Direction, data: bytes, take: Callable[[Direction, bytes], None]) -> None:
        now_s = self._outside.clock.now_s
        begin_s = direction.through_s if direction.through_s > now_s else now_s
        data = data[: max(0, MOST_QUEUED - int((begin_s - now_s) / self._character_s))]
        if data and self.adapter_s and direction is self._to_host:
            self._put_in_pieces(direction, data, begin_s)
        elif data:
            direction.through_s = through_s = begin_s + len(data) * self._character_s
            direction.waiting.append((begin_s, data))
            self._outside.call_at(through_s + 1e-9, take, direction, data)

    def _put_in_pieces(self, direction: Direction, data: bytes, begin_s: float) -> None:
        direction.through_s = begin_s + len(data) * self._character_s
        turn, sent = ceil(begin_s / self.adapter_s), 0
        while sent < len(data):
            come = min(len(data), int((turn * self.adapter_s - begin_s) / self._character_s))
            if come > sent:
                direction.waiting.append((begin_s, data[sent:come]))
                at_s = max(turn * self.adapter_s, self._outside.clock.now_s) + 1e-9
                self._outside.call_at(at_s, self._reach_host, direction, data[sent:come])
                sent = come
            turn += 1

    def _arrive(self, direction: Direction, data: bytes) -> None:
        direction.waiting.popleft()
        if not direction.is_cut:
            self.on_device(data, self._outside.clock.now_s)

    def _reach_host(self, direction: Direction, data: bytes) -> None:
        direction.waiting.popleft()
        if self.port and not direction.is_cut:
            self.heard_s = self._outside.clock.now_s
            self.on_host(data, self.heard_s)
            self.port.hear(data)


CABLES: dict[str, Cable] = {}
"""By path, of the one simulation that runs."""


class SimulatedPort:
    """The host's end. Its kernel's buffer outlives a stall of the process, as a real one does."""

    def __init__(self, path: str, settings: SerialSettings, events: PortEvents, *, is_simulated: bool = False) -> None:
        self.path, self.warning = path, ""
        self._settings, self._events = settings, events
        self._cable = CABLES[path]
        self._loop = asyncio.get_running_loop()
        self._buffer = bytearray()
        self._descriptor = -1
        self._backoff_s = 0.1
        self._reopening: asyncio.TimerHandle | None = None
        self.is_open = self._is_wanted = False

    async def open(self) -> None:
        if not self._cable.is_plugged:
            raise PortError("E102", f"{self.path} is not there")
        self._is_wanted = True
        self._open()

    def begin_lost(self, failure: PortError) -> None:
        self._is_wanted = True
        self._reopening = self._loop.call_later(self._backoff_s, self._reopen)
        self._events.on_lost(failure)

    def move(self, path: str) -> None:
        assert path == self.path, "simulated lines do not move"

    def write(self, data: bytes) -> bool:
        if self.is_open:
            self._cable.send_to_device(data)
        return self.is_open

    @property
    def unsent_bytes(self) -> int:
        """What the kernel still holds of what was written."""
        return max(0, int((self._cable.through_s - self._loop.time()) / self._settings.character_s))

    def read_arrived(self) -> None:
        self._read()

    def flush_input(self) -> int:
        dropped = len(self._buffer)
        self._buffer.clear()
        return dropped

    def drop_unsent(self) -> None:
        if self.is_open:
            self._cable.drop_unsent()

    async def write_last(self, data: bytes, deadline_s: float = 0.5) -> None:
        if not self.write(data):
            raise PortError("E102", f"{self.path} is not open")
        self._cable.on_unheard(self._loop.time())  # what else is said now is not sent
        await asyncio.sleep(len(data) * self._settings.character_s + 1e-3)

    def close(self) -> None:
        self._drop_descriptor()
        self.is_open = self._is_wanted = False
        if self._reopening:
            self._reopening.cancel()
        if self._cable.port is self:
            self._cable.port = None

    # -- the kernel's side

    def is_of(self, loop: asyncio.AbstractEventLoop) -> bool:
        """Whether the process whose loop this is has opened it."""
        return self._loop is loop

    def hear(self, chunk: bytes) -> None:
        if self.is_open:  # what comes to a port that nobody has open is kept nowhere
            self._buffer += chunk
            self._loop.call_soon(self._read)

    def notice_loss(self) -> None:
        self._loop.call_soon(self._lose)

    def _open(self) -> None:
        self._cable.port, self.is_open, self._backoff_s = self, True, 0.1
        self._descriptor = os.open(os.devnull, os.O_RDWR)  # for the guardian, which gets a copy
        self._events.on_open(self._descriptor)

    def _drop_descriptor(self) -> None:
        if self._descriptor >= 0:
            os.close(self._descriptor)
            self._descriptor = -1

    def _read(self) -> None:
        if self.is_open and self._buffer:
            chunk = bytes(self._buffer)
            self._buffer.clear()
            self._events.on_bytes(chunk, self._loop.time())

    def _lose(self) -> None:
        if self.is_open:
            self.is_open = False
            self._drop_descriptor()
            self._buffer.clear()
            self._reopening = self._loop.call_later(self._backoff_s, self._reopen)
            self._events.on_lost(PortError("A317", f"{self.path} is disconnected"))

    def _reopen(self) -> None:
        if not self._is_wanted:
            return
        if self._cable.is_plugged:
            self._open()
        else:
            self._backoff_s = min(2.0 * self._backoff_s, 2.0)
            self._reopening = self._loop.call_later(self._backoff_s, self._reopen)


def lay_cables(
    outside: VirtualLoop,
    rig: Rig,
    on_output: Callable[[bytes, float], None],
    on_cell: Callable[[bytes, float], None],
    on_valve: Callable[[bytes, float], None],
) -> None:
    """Connect the world to control."""
    CABLES.clear()
    CABLES["output"] = Cable(outside, rig.output.settings, on_output)
    CABLES["load_cell"] = Cable(outside, rig.load_cell.settings, on_cell)
    for face in rig.fieldbus:
        if isinstance(face, RtuFace):
            assert face.port
            CABLES[face.port] = Cable(outside, face.settings, lambda chunk, now_s: None)
    if rig.valve:
        CABLES["valve"] = Cable(outside, rig.valve.settings, on_valve)
