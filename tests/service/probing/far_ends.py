"""Simulated devices behind ptys, in a thread with a loop of its own, so that a whole command can ask them."""

import asyncio
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from gateway.devices import DeviceProfile, DeviceRole, cell_device, output_device
from gateway.devices.messages import (
    Accepted,
    AskDevice,
    DeviceAnswer,
    Garbage,
    OutputReply,
    Pressure,
    ReadPressure,
    ReadVoltage,
    SetVoltage,
)
from gateway.ports import PacedPty


class FarEnd:
    """One device. heard: every request that it understood; at another speed it hears garbage, and answers it so."""

    def __init__(self, profile: DeviceProfile, baud: int | None = None) -> None:
        self.profile, self.heard = profile, list[object]()
        self.pty = PacedPty(baud or profile.serial.baud, on_bytes=self._on_bytes)
        self._timer: asyncio.TimerHandle | None = None
        self._output = output_device(profile) if profile.role is DeviceRole.OUTPUT else None
        self._cell = None if self._output else cell_device(profile, None if _has_unit(profile) else "N")

    def open(self) -> None:
        self.pty.open()
        if self.profile.rate_hz:
            self._stream()

    def close(self) -> None:
        if self._timer:
            self._timer.cancel()
        self.pty.close()

    def _stream(self) -> None:
        assert self._cell
        self.pty.send(self._cell.frame(5.0))
        self._timer = asyncio.get_running_loop().call_later(1.0 / self.profile.rate_hz, self._stream)

    def _on_bytes(self, chunk: bytes, now_s: float) -> None:
        if self._cell:
            count = self._cell.receive(chunk, now_s)
            self.pty.send(self._cell.take_answers())
            for _ in range(count):
                self.pty.send(self._cell.frame(5.0))
            return
        assert self._output
        for request in self._output.receive(chunk, now_s):
            self.heard.append(request)
            self.pty.send(
                self._output.reply(self._answer(request), to=None if isinstance(request, Garbage) else request)
            )

    def _answer(self, request: object) -> OutputReply:
        assert self._output
        match request:
            case AskDevice(step):
                return DeviceAnswer(step, is_right=True)
            case ReadVoltage():
                return Accepted(0.0)
            case ReadPressure():
                return Pressure(0.0)
            case SetVoltage(voltage_v):
                return Accepted(voltage_v)
            case Garbage():
                return self._output.refusal(request)
        raise AssertionError(request)


def _has_unit(profile: DeviceProfile) -> bool:
    return bool(profile.reading.newton_per_unit or profile.reading.template.field("unit"))


@contextmanager
def behind_ptys(*ends: FarEnd) -> Iterator[list[str]]:
    """The paths of these devices, for as long as the context lasts."""
    loop, paths = asyncio.new_event_loop(), list[str]()
    opened = threading.Event()

    def run() -> None:
        asyncio.set_event_loop(loop)

        def begin() -> None:
            for end in ends:
                end.open()
                paths.append(end.pty.path)
            opened.set()

        loop.call_soon(begin)
        loop.run_forever()
        loop.close()

    def end_all() -> None:
        for end in ends:
            end.close()
        loop.stop()

    thread = threading.Thread(target=run)
    thread.start()
    try:
        assert opened.wait(10.0)
        yield paths
    finally:
        loop.call_soon_threadsafe(end_all)
        thread.join()
