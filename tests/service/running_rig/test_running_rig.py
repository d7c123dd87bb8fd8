"""One running rig in this process, on ptys whose devices the test serves: what an internal error leaves on the wire."""

import asyncio
import os
import socket
import struct
import threading
import time
from collections.abc import Callable
from typing import Any

import pytest

from gateway.audit.audit_reader import read_audit
from gateway.codes.faults import FaultCode
from gateway.codes.warning_bits import WarningBit
from gateway.devices import SerialSettings
from gateway.modbus import Peer
from gateway.ports import PortError, SerialPort
from gateway.ports.opening import open_descriptor
from gateway.processes import message_link
from gateway.processes.exit_cause import EndCause, Ending
from gateway.service.guardian_line import GuardianLine
from gateway.service.running_rig import running_rig
from gateway.service.running_rig.faces.faces import Faces
from gateway.service.running_rig.lines.load_cell_line import CellExchange
from gateway.service.running_rig.lines.output_line import OutputExchange
from gateway.service.running_rig.lines.rig_ports import RigPorts
from gateway.service.running_rig.running_rig import RunningRig
from tests.end_to_end.own_devices import OwnDevices
from tests.service.running_rig.begun_rig import STANDSTILL_S, devices, with_running_rig

__all__ = ["devices"]

MASTER = Peer("10.0.0.5", 40001)


async def pressing(rig: RunningRig, devices: OwnDevices, volts: float = 4.0) -> None:
    rig.bank.write_registers(0, struct.pack(">6H", 1, 0, 0, 1, 0, round(1000 * volts)), MASTER)
    while devices.setting_v < volts - 0.1:
        await asyncio.sleep(0.005)


def test_the_port_drops_what_it_has_not_sent_of_each_question_that_is_given_up(
    devices: OwnDevices, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A line that stood still kept three older voltages, and sent them before the safe one when it went on."""
    dropped: list[str] = []
    given_up: list[object] = []
    give_up = OutputExchange._give_up
    monkeypatch.setattr(SerialPort, "drop_unsent", lambda port: dropped.append(port.path))
    monkeypatch.setattr(OutputExchange, "_give_up", lambda *told: (given_up.append(told), give_up(*told))[1])

    async def scene(rig: RunningRig, guardian: socket.socket) -> None:
        await pressing(rig, devices)
        assert len(dropped) <= len(given_up), "where the machine stands still an answer may come too late"
        dropped.clear()
        devices.is_silent = True
        rig.bank.write_registers(0, struct.pack(">6H", 1, 0, 0, 1, 0, 5000), MASTER)
        while len(dropped) < 2:
            await asyncio.sleep(0.005)

    with_running_rig(devices, scene)
    assert set(dropped) == {str(devices.output.link)}


def test_a_pause_that_the_rig_allows_makes_no_reading_old(devices: OwnDevices, monkeypatch: pytest.MonkeyPatch) -> None:
    bounds_s: list[float] = []

    def note(*parts: Any) -> CellExchange:
        bounds_s.append(parts[-1])
        return CellExchange(*parts)

    async def scene(rig: RunningRig, guardian: socket.socket) -> None:
        assert bounds_s == [0.3]

    monkeypatch.setattr(running_rig, "CellExchange", note)
    devices.rig.write_text(devices.rig.read_text().replace(f"stall_s: {STANDSTILL_S}", "stall_s: 0.3"))
    with_running_rig(devices, scene)


def test_masters_do_not_wait_after_a_restart_for_a_device_that_is_silent(devices: OwnDevices) -> None:
    """3 s for the first words and 3 s of other speeds are for somebody who sets a rig up, not for a running line."""
    devices.is_silent = True

    async def scene(rig: RunningRig, guardian: socket.socket) -> None:
        assert rig.loop.restart_cause is FaultCode.MACHINE_BUSY
        assert rig.loop.warnings.bits & WarningBit.NO_WATCHDOG, "after a restart too"

    began_s = time.monotonic()
    with_running_rig(devices, scene, Ending(EndCause.MACHINE_BUSY, "anything"))
    assert time.monotonic() - began_s < 5.0, "a busy machine takes longer than the first moments, but not 6 s"
    assert devices.heard


def test_the_guardian_is_told_that_the_last_safe_voltage_is_out_before_anything_else_is_closed(
    devices: OwnDevices, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From then on it misses no beat: the rest may take its time."""
    done: list[str] = []

    def note(name: str, owner: type, method: str) -> None:
        was = getattr(owner, method)
        monkeypatch.setattr(owner, method, lambda *arguments: (done.append(name), was(*arguments))[1])

    note("safe voltage", RigPorts, "write_last")
    note("told", GuardianLine, "note_safe")
    note("faces closed", Faces, "close")
    with_running_rig(devices, lambda rig, _: pressing(rig, devices))
    assert done == ["safe voltage", "told", "faces closed"]


def held(path: str) -> int:
    """A descriptor of the port that carries the lock, as another process has it."""
    return open_descriptor(path, SerialSettings(baud=9600))


async def until(condition: Callable[[], bool]) -> None:
    while not condition():
        await asyncio.sleep(0.005)


def test_a_restart_waits_a_moment_for_a_port_whose_holder_is_about_to_end(devices: OwnDevices) -> None:
    holder = held(str(devices.output.link))
    ending = threading.Timer(0.1, os.close, [holder])
    ending.start()

    async def scene(rig: RunningRig, guardian: socket.socket) -> None:
        await until(lambda: rig.loop.decision is not None)
        assert rig.loop.decision is not None
        assert rig.loop.decision.fault is FaultCode.NONE, "it was nobody's fault"

    lines = with_running_rig(devices, scene, Ending(EndCause.MACHINE_BUSY, "anything"))
    ending.join()
    assert not [line for line in lines if "E103" in line]


def test_a_restart_whose_port_stays_held_comes_up_without_it_and_takes_it_when_it_is_free(
    devices: OwnDevices, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ending over it would use up five restarts within seconds, and with them the gateway."""
    monkeypatch.setattr("gateway.service.running_rig.starting._HELD_BOUND_S", 0.0)
    holder = held(str(devices.output.link))

    async def scene(rig: RunningRig, guardian: socket.socket) -> None:
        assert not rig._ports.output.is_open
        assert rig.loop.output_lost is FaultCode.OUTPUT_LOST
        os.close(holder)
        await until(lambda: rig._ports.output.is_open)
        heard = len(devices.heard)
        await until(lambda: len(devices.heard) > heard)

    lines = with_running_rig(devices, scene, Ending(EndCause.MACHINE_BUSY, "anything"))
    assert [line for line in lines if "E103" in line and "is held by this very process" in line]
    assert {heard.voltage_v for heard in devices.settings_since(0.0)} <= {0.0}


def test_a_first_start_ends_over_a_port_that_is_held(devices: OwnDevices) -> None:
    """Somebody sits in front of it, who is told what to stop."""
    holder = held(str(devices.output.link))

    async def scene(rig: RunningRig, guardian: socket.socket) -> None:
        raise AssertionError("it must not come up")

    with pytest.raises(PortError, match="E103"):
        with_running_rig(devices, scene)
    os.close(holder)


def test_a_defect_anywhere_in_the_loop_ends_with_the_safe_voltage(devices: OwnDevices) -> None:
    async def scene(rig: RunningRig, guardian: socket.socket) -> None:
        await pressing(rig, devices)
        asyncio.get_running_loop().call_soon(lambda: 1 // 0)
        await rig.failed.wait()

    lines = with_running_rig(devices, scene)
    deadline_s = time.monotonic() + 1.0
    while devices.heard[-1].voltage_v != 0.0:
        assert time.monotonic() < deadline_s
        time.sleep(0.001)
    assert any("error   internal A499" in line and "ZeroDivisionError" in line for line in lines)


def test_the_safe_voltage_is_the_first_thing_that_closing_does(devices: OwnDevices, monkeypatch) -> None:
    """Whatever hangs in closing the rest, the final safe-voltage write is on the wire already."""
    seen_v: list[float] = []
    running = devices.directory / "state" / "running"

    async def scene(rig: RunningRig, guardian: socket.socket) -> None:
        await pressing(rig, devices)
        close = rig._faces.close

        async def look_and_close() -> None:
            await asyncio.sleep(0.02)
            seen_v.append(devices.setting_v)
            assert running.exists(), "until all of it is closed this run has not ended"
            await close()

        monkeypatch.setattr(rig._faces, "close", look_and_close)

    with_running_rig(devices, scene)
    assert seen_v == [0.0]
    assert not running.exists()
    assert [record["what"] for record in read_audit(running.parent)][-1] == "end"


def test_a_change_that_came_to_nothing_is_in_the_audit_as_that(devices: OwnDevices) -> None:
    async def scene(rig: RunningRig, guardian: socket.socket) -> None:
        rig._upload.use(77)
        rig._plants.answer({"do": "plant", "use": 78})
        await until(lambda: not (rig._upload.status()["busy"] or rig._plants.status()["busy"]))

    lines = with_running_rig(devices, scene)
    told = {record["what"]: record["result"] for record in read_audit(devices.directory / "state")}
    assert (told["calibration use 77"][:2], told["plant use 78"][:2]) == ("E4", "E4")
    assert sum(f"plant use 78: {told['plant use 78']}" in line for line in lines) == 1


def test_a_defect_in_the_step_is_a_fault_and_no_end(devices: OwnDevices, monkeypatch: pytest.MonkeyPatch) -> None:
    async def scene(rig: RunningRig, guardian: socket.socket) -> None:
        await pressing(rig, devices)
        with monkeypatch.context() as patched:
            patched.setattr(rig.controller, "decide", lambda *arguments: 1 // 0)
            while devices.setting_v > 0.0:
                await asyncio.sleep(0.005)
        while rig.loop.decision is None or rig.loop.decision.fault is not FaultCode.INTERNAL:
            await asyncio.sleep(0.005)
        assert not rig.failed.is_set()

    assert any("A499" in line for line in with_running_rig(devices, scene))


def test_the_guardian_has_the_line_before_anything_but_safe_is_written(devices: OwnDevices) -> None:
    async def scene(rig: RunningRig, guardian: socket.socket) -> None:
        assert {heard.voltage_v for heard in devices.settings_since(0.0)} <= {0.0}
        guardian.setblocking(False)
        messages = []
        while not messages or messages[-1].tag != message_link.LINE:
            message = message_link.receive(guardian)
            assert message
            messages.append(message)
        handed = messages[-1]
        assert bytes.fromhex(handed.body["safe_frame"]) == b"SET 0\r\n"
        assert bytes.fromhex(handed.body["safe_reply"]) == b"0\r\n"
        assert len(handed.descriptors) == 1
        socket.close(handed.descriptors[0])

    with_running_rig(devices, scene)


def test_the_heartbeat_comes_from_the_loop_itself(devices: OwnDevices) -> None:
    async def scene(rig: RunningRig, guardian: socket.socket) -> None:
        def beats() -> int:
            count = 0
            while True:
                try:
                    message = message_link.receive(guardian)
                except BlockingIOError:
                    return count
                assert message
                count += message.tag == message_link.HEARTBEAT
                for descriptor in message.descriptors:
                    socket.close(descriptor)

        guardian.setblocking(False)
        beats()
        health = rig.loop.health
        came = health.ticks - health.missed_ticks
        await until(lambda: health.ticks - health.missed_ticks >= came + 10)
        assert beats() == health.ticks - health.missed_ticks - came, "one at each tick, also of a late loop"
        time.sleep(0.15)  # the loop does not come by
        assert beats() == 0
        guardian.setblocking(True)

    with_running_rig(devices, scene)


def test_the_tick_is_told_of_each_sample_that_streams(devices: OwnDevices, monkeypatch: pytest.MonkeyPatch) -> None:
    async def scene(rig: RunningRig, guardian: socket.socket) -> None:
        told: list[tuple[float | None, float | None]] = []
        monkeypatch.setattr(rig._tick, "follow", lambda at_s: told.append((at_s, rig.loop.streamed_s)))
        await until(lambda: len(set(told)) > 3)
        assert all(at_s == newest_s is not None for at_s, newest_s in told)

    with_running_rig(devices, scene)


def test_a_leaving_master_is_lost_if_it_is_the_owner_and_until_it_commands_again(devices: OwnDevices) -> None:
    """A panel that closes its connection drops no force; a robot that connects anew in time has lost none."""

    async def scene(rig: RunningRig, _: socket.socket) -> None:
        await pressing(rig, devices)
        rig._on_peer_closed(Peer("10.0.0.9", 40002))
        assert rig.loop.owner_connected
        rig._on_peer_closed(MASTER)
        assert not rig.loop.owner_connected
        rig.bank.write_registers(4, struct.pack(">H", 7), MASTER)
        assert rig.loop.owner_connected

    with_running_rig(devices, scene)
