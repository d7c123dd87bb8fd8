"""The shipped device profiles, a pty, and an ear to hear ports with."""

import asyncio
from collections.abc import Callable, Iterator

import pytest

from gateway.devices import DeviceProfile, SerialSettings
from gateway.ports import PortError, PortEvents, Pty, SerialPort
from tests.profile_files import load_device


@pytest.fixture(scope="session")
def itv() -> DeviceProfile:
    return load_device("smc-itv-rc")


@pytest.fixture(scope="session")
def indicator() -> DeviceProfile:
    return load_device("stream-st-gs")


class Ear:
    """Listens to a port and lets a test wait for what it hears."""

    def __init__(self) -> None:
        self.data = b""
        self.times_s: list[float] = []
        self.losses: list[PortError] = []
        self.opened: list[int] = []
        self._changed = asyncio.Event()

    def on_bytes(self, chunk: bytes, now_s: float) -> None:
        self.data += chunk
        self.times_s.append(now_s)
        self._changed.set()

    def on_lost(self, failure: PortError) -> None:
        self.losses.append(failure)
        self._changed.set()

    def on_open(self, descriptor: int) -> None:
        self.opened.append(descriptor)
        self._changed.set()

    async def until(self, condition: Callable[[], bool], timeout_s: float = 5.0) -> None:
        async with asyncio.timeout(timeout_s):
            while not condition():
                self._changed.clear()
                await self._changed.wait()

    def port(self, path: str, settings: SerialSettings | None = None, *, is_simulated: bool = False) -> SerialPort:
        return SerialPort(
            path,
            settings or SerialSettings(baud=9600),
            PortEvents(self.on_bytes, self.on_lost, self.on_open),
            is_simulated=is_simulated,
        )


@pytest.fixture
def ear() -> Ear:
    return Ear()


@pytest.fixture
def line() -> Iterator[Pty]:
    """A pty above numbers that are free: what else runs on the machine takes those, and not the one that this pty loses."""
    lower = [Pty() for _ in range(8)]
    pty = Pty()
    for each in lower:
        each.close()
    yield pty
    pty.close()
