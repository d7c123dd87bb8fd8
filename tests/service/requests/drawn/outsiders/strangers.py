"""Who comes to the TLS face and is not let in: nothing is executed, nothing is kept, and who may come in comes in meanwhile."""

from collections.abc import Callable
from contextlib import suppress
from random import Random
from typing import Any

from gateway.fieldbus.tls_stream import TlsStream
from tests.service.requests.drawn.secure import SecureWire, draw_stranger
from tests.service.requests.drawn.world import World

MOST_WAITING = 5
"""Handshakes that strangers leave under way: fewer than keep everybody out."""
HANDSHAKE_S = 5.0


class Strangers:
    def __init__(self, world: World, draw: Random) -> None:
        self._world, self._draw, self.broken = world, draw, list[str]()
        self._waiting: list[tuple[float, Any]] = []
        self._ports = iter(range(60000, 65000))

    def act(self, look: Callable[[], Any], differences: Callable[[Any, Any], list[str]]) -> str:
        world, draw = self._world, self._draw
        how, what = draw_stranger(draw)
        before, told, known = look(), len(world.log), len(world.connections)
        protocol = TlsStream(world.secure, world.handshakes)
        host = f"10.0.2.{draw.randrange(1, 200)}"
        far = world.accept(host, next(self._ports), protocol)
        about = f"{host} {how} {what[:60]!r}"
        if how == "shows":
            wire = SecureWire(far, what, world.poll)
            with suppress(OSError):
                wire.send(bytes.fromhex("000100000006010500000000"))
            is_closed = _is_closed(far)
        else:
            is_closed = self._say(far, what)
        if changes := differences(before, look()):
            self.broken.append(f"{about} changes {changes[:6]}")
        if len(world.connections) > known:
            self.broken.append(f"{about} is connected")
        if how == "shows" and not is_closed:
            self.broken.append(f"{about} is not closed")
        if is_closed != (protocol not in world.handshakes.pending):
            self.broken.append(f"{about} is closed {is_closed}, and has a place as if not")
        if is_closed and len(world.log) != told + 1:
            self.broken.append(f"{about} is told as {world.log[told:]}")
        self._keep(far, is_closed)
        return f"{about} -> {'closed' if is_closed else 'waits'}"

    def _say(self, far: Any, data: bytes) -> bool:
        """In one piece or in two; whether it is closed then."""
        at = self._draw.randrange(len(data) + 1)
        for piece in filter(None, (data[:at], data[at:])):
            with suppress(OSError):
                far.send(piece)
            self._world.poll()
        return _is_closed(far)

    def _keep(self, far: Any, is_closed: bool) -> None:
        if is_closed or len(self._waiting) >= MOST_WAITING or self._draw.random() < 0.5:
            far.close()
            self._world.poll()
        else:
            self._waiting.append((self._world.clock.now_s, far))


def _is_closed(far: Any) -> bool:
    try:
        while far.recv(65536):
            pass
    except BlockingIOError:
        return False
    except OSError:
        pass
    return True
