"""A start tells how the valve stands, or that nobody knows: without it each enable is refused."""

import os
import select
import socket
import threading
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from functools import reduce
from operator import xor

import pytest

from gateway.service.banner import Ready, format_banner
from gateway.service.running_rig.running_rig import RunningRig
from tests.end_to_end.own_devices import OwnDevices
from tests.service.running_rig import begun_rig
from tests.service.running_rig.begun_rig import devices, with_running_rig

__all__ = ["devices"]


@pytest.fixture
def relay(devices: OwnDevices) -> Iterator[int]:
    """The far end of a relay's line, of which nobody answers yet."""
    far, near = os.openpty()
    tty.setraw(far), tty.setraw(near)
    valve = f"valve: {{device: mcu-valve, port: {os.ttyname(near)}}}\n"
    devices.rig.write_text(devices.rig.read_text() + valve)
    yield far
    os.close(far), os.close(near)


def started(devices: OwnDevices, monkeypatch: pytest.MonkeyPatch) -> Ready:
    told: list[Ready] = []

    class Told(RunningRig):
        async def start(self, *arguments: object, **named: object) -> Ready:
            told.append(await super().start(*arguments, **named))  # type: ignore[arg-type]
            return told[0]

    async def scene(rig: RunningRig, guardian: socket.socket) -> None: ...

    monkeypatch.setattr(begun_rig, "RunningRig", Told)
    with_running_rig(devices, scene)
    return told[0]


def test_a_relay_that_is_silent_is_told_at_the_start(
    devices: OwnDevices, relay: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """READY named its port and said no more, and the line to try was refused."""
    ready = started(devices, monkeypatch)
    (silent,) = [note for note in ready.notes if note.startswith(f"E111 {ready.valve_port}: ")]
    assert "the valve's relay has not said where it stands" in silent and "power, wires or address" in silent
    assert f"{ready.valve_port:<16} mcu-valve 115200  silent" in format_banner(ready)


def test_one_that_answers_is_shown_with_where_it_stands(
    devices: OwnDevices, relay: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    with answering(relay, b"VALVE PULL*%02X\n" % reduce(xor, b"VALVE PULL")):
        ready = started(devices, monkeypatch)
    assert not [note for note in ready.notes if "E111" in note]
    assert f"{ready.valve_port:<16} mcu-valve 115200  ok   pull" in format_banner(ready)


@contextmanager
def answering(relay: int, answer: bytes) -> Iterator[None]:
    """A relay that says this to whatever it is asked."""
    is_over = threading.Event()

    def serve() -> None:
        while not is_over.is_set():
            if select.select([relay], [], [], 0.05)[0] and os.read(relay, 100):
                os.write(relay, answer)

    thread = threading.Thread(target=serve)
    thread.start()
    yield
    is_over.set()
    thread.join()
