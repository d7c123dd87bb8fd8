"""When the serial face looks at what it has heard, by a loop and a clock of the test's own."""

from types import SimpleNamespace
from typing import Any

import pytest

from gateway.devices import SerialSettings
from gateway.fieldbus import ModbusRtuServer, RtuSettings, rtu_server
from gateway.modbus import Peer
from gateway.modbus import pdu as P  # noqa: N812
from gateway.modbus.rtu import encode_adu
from gateway.modbus.rtu_receiver import silence_s
from tests.fieldbus.conftest import NotingBank

LINE = SerialSettings(baud=115200)
READ = P.read_request(3, 10, 2)
NOISE = b"\x03\x03\x00"


def test_a_request_soon_behind_noise_is_answered_after_its_own_silence(monkeypatch: pytest.MonkeyPatch) -> None:
    """Noise that may be the beginning of a frame is waited for by 20 ms; the request behind it waited as long."""
    now_s, timers = 0.0, list[tuple[float, Any]]()

    class Loop:
        def call_later(self, delay_s: float, callback: Any) -> Any:
            timer = (now_s + delay_s, callback)
            timers.append(timer)
            return SimpleNamespace(cancel=lambda: timers.remove(timer))

    monkeypatch.setattr(rtu_server.asyncio, "get_running_loop", Loop)
    monkeypatch.setattr(rtu_server, "monotonic_s", lambda: now_s)
    settings = RtuSettings("/dev/serial/none", LINE, unit=3, peer=Peer("serial:1"))
    server = ModbusRtuServer(NotingBank(), settings, on_peer_closed=lambda _: None, log=lambda *_: None)
    executed = list[tuple[float, bytes]]()
    monkeypatch.setattr(server, "_execute", lambda request: executed.append((now_s, request.pdu)))
    chunks = [(0.0, NOISE), (0.01, encode_adu(3, READ)), (0.02, encode_adu(3, READ))]
    while chunks or timers:
        if timers and (not chunks or timers[0][0] < chunks[0][0]):
            now_s, callback = timers.pop(0)
            callback()
        else:
            now_s, data = chunks.pop(0)
            server._on_bytes(data, now_s)
        assert len(timers) <= 1
    silent_s = silence_s(LINE.baud, LINE.character_s)
    assert executed == [(pytest.approx(begin_s + silent_s), READ) for begin_s in (0.01, 0.02)]
