"""How a running rig ends: by a ramp, or a defect whose cause is told; what it hands on until then; what goes last."""

import asyncio
import socket
import time
from types import SimpleNamespace

import pytest

from gateway.audit.rig_audit import RigAudit
from gateway.fieldbus.rtu_server import STANDSTILL_S
from gateway.processes import message_link
from gateway.service.guardian_line import GuardianLine
from gateway.service.live_answers import AlarmTimes
from gateway.service.running_rig import running_rig
from gateway.service.running_rig.calibration_runs import CalibrationRuns
from gateway.service.running_rig.last_tick import LastTick
from gateway.service.running_rig.lateness import Lateness
from gateway.service.running_rig.lines.rig_ports import RigPorts
from gateway.service.running_rig.recording.recordings import Recordings
from gateway.service.running_rig.rig_plants import RigPlants
from gateway.service.running_rig.running_rig import RunningRig
from gateway.service.supervisor.control_child import STOP_BOUND_S
from tests.end_to_end.own_devices import OwnDevices
from tests.service.running_rig.test_running_rig import devices, pressing, with_running_rig

__all__ = ["devices"]


def test_a_stop_lets_the_force_down_in_steps_and_not_at_once(devices: OwnDevices) -> None:
    """A part that is held would fall, one that is ground would have a mark."""

    async def scene(rig: RunningRig, guardian: socket.socket) -> None:
        await pressing(rig, devices, 1.5)
        while devices.force_n < 7.0 * 1.5:
            await asyncio.sleep(0.005)
        began_s = time.monotonic()
        await rig.ramp_down()
        assert rig.controller.has_stopped
        assert devices.setting_v == 0.0, "before anything else is closed"
        steps_v = [heard.voltage_v or 0.0 for heard in devices.settings_since(began_s)]
        assert steps_v == sorted(steps_v, reverse=True)
        assert len([one for one in steps_v if 0.3 < one < 1.2]) > 3

    with_running_rig(devices, scene)


def test_the_first_cause_of_an_end_is_told_to_the_guardian_and_to_people(devices: OwnDevices) -> None:
    """Its sentence is what the next start tells, and the register `fault_code` of it."""
    told: list[str] = []

    async def scene(rig: RunningRig, guardian: socket.socket) -> None:
        loop = asyncio.get_running_loop()
        loop.call_exception_handler({"message": "in a callback", "exception": ZeroDivisionError("x / 0")})
        assert rig.failed.is_set()
        while not told:
            message = message_link.receive(guardian)
            assert message
            message.drop_descriptors()
            told.extend([message.body["text"]] if message.tag == message_link.FIRST_CAUSE else [])

    said = with_running_rig(devices, scene)
    assert told == ["internal error: ZeroDivisionError('x / 0')"]
    assert any("A499" in line and "in a callback" in line for line in said)


def test_a_ramp_to_the_end_is_over_while_the_guardian_still_waits_for_it() -> None:
    """Else each slow ramp ends by a kill: no last safe frame of ours, no end in the audit, the tail of a recording lost."""
    assert 4.0 <= running_rig._STOP_BOUND_S <= STOP_BOUND_S - 0.5


@pytest.mark.parametrize("end", ["the guardian is gone", "a defect"])
def test_who_can_no_longer_be_trusted_with_a_ramp_ends_at_once(devices: OwnDevices, end: str) -> None:
    """A ramp without a guardian is 4 s in which nothing writes the safe voltage when this process dies."""

    ended_s: list[float] = []

    async def scene(rig: RunningRig, guardian: socket.socket) -> None:
        await pressing(rig, devices)
        if end == "a defect":
            rig.failed.set()
        else:
            guardian.shutdown(socket.SHUT_RDWR)
            while not rig._guardian.is_gone:
                await asyncio.sleep(0.005)
        await rig.ramp_down()
        assert not rig.controller.has_stopped
        assert devices.setting_v > 3.5
        ended_s.append(time.monotonic())

    with_running_rig(devices, scene)
    assert devices.until_safe(ended_s[0]) < 1.0


def test_until_its_last_part_is_closed_a_run_has_not_ended(
    devices: OwnDevices, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One that dies in between would be taken by the next start for one that had ended well."""
    running, found = devices.directory / "state" / "running", list[bool]()
    close = Lateness.close
    monkeypatch.setattr(Lateness, "close", lambda part: (found.append(running.exists()), close(part))[1])

    async def scene(rig: RunningRig, guardian: socket.socket) -> None:
        assert running.exists()

    with_running_rig(devices, scene)
    assert found == [True] and not running.exists()


def test_no_master_is_answered_while_the_device_is_let_go(devices: OwnDevices, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is decided any more: it would read a force, and an age of it, that were true once."""
    connected: list[int] = []

    async def scene(rig: RunningRig, guardian: socket.socket) -> None:
        async def write_last(_: RigPorts, frame: bytes) -> None:
            connected.append(len(rig._faces.peers))

        assert rig._faces.modbus
        master.connect(rig._faces.modbus)
        while not rig._faces.peers:
            await asyncio.sleep(0.005)
        rig._last_frame = b"~OFF"
        monkeypatch.setattr(RigPorts, "write_last", write_last)

    with socket.socket() as master:
        with_running_rig(devices, scene)
    assert connected == [1, 0]


def test_a_watchdog_is_let_go_once_the_safe_voltage_has_been_answered(
    devices: OwnDevices, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Before it an end in the middle would leave nobody who watches; at once, both would talk on a bus of two wires."""
    written: list[tuple[float, bytes]] = []

    async def write_last(_: RigPorts, frame: bytes) -> None:
        written.append((time.monotonic(), frame))

    async def scene(rig: RunningRig, guardian: socket.socket) -> None:
        rig._last_frame = b"~OFF"
        monkeypatch.setattr(RigPorts, "write_last", write_last)
        written.append((rig._rig.output.device.reply_timeout_s, rig._safe_frame))

    with_running_rig(devices, scene)
    (timeout_s, safe_frame), (safe_s, safe), (off_s, off) = written
    assert (safe, off) == (safe_frame, b"~OFF")
    assert off_s - safe_s >= timeout_s


@pytest.mark.parametrize("end", ["while it presses", "at rest", "by a ramp", "by a ramp that is answered late"])
def test_a_watchdog_is_not_let_go_where_what_pressed_may_press_still(
    devices: OwnDevices, monkeypatch: pytest.MonkeyPatch, end: str
) -> None:
    """Without a guardian there is one safe frame, and nobody sees its answer: were it lost, the device alone would end it."""
    written: list[bytes] = []
    write_last = RigPorts.write_last

    async def note_last(ports: RigPorts, frame: bytes) -> None:
        written.append(frame)
        await write_last(ports, frame)
        if end.endswith("late"):
            ports.loop.output.standing_v = 0.0  # the ramp's last setting is answered now

    async def scene(rig: RunningRig, guardian: socket.socket) -> None:
        if end != "at rest":
            await pressing(rig, devices)
        rig._last_frame = b"~OFF"
        monkeypatch.setattr(RigPorts, "write_last", note_last)
        if end == "while it presses":
            guardian.shutdown(socket.SHUT_RDWR)
            while not rig._guardian.is_gone:
                await asyncio.sleep(0.005)
        await rig.ramp_down()
        if end.endswith("late"):
            rig._line.standing_v = None

    with_running_rig(devices, scene)
    assert (b"~OFF" in written) is (end != "while it presses")


def test_each_tick_beats_and_hands_on_what_waits_for_a_disk(
    devices: OwnDevices, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is lost with a killed process is the last tenth of a second, and not all since its start."""
    called: set[str] = set()

    def note(owner: type, method: str) -> None:
        was = getattr(owner, method)
        monkeypatch.setattr(owner, method, lambda *told: (called.add(f"{owner.__name__}.{method}"), was(*told))[1])

    handed_on = (
        (Recordings, "flush"),
        (CalibrationRuns, "flush"),
        (RigPlants, "take_waiting"),
        (RigAudit, "flush"),
        (GuardianLine, "heartbeat"),
        (AlarmTimes, "follow"),
    )

    async def scene(rig: RunningRig, guardian: socket.socket) -> None:
        for owner, method in handed_on:
            note(owner, method)
        while len(called) < len(handed_on):
            await asyncio.sleep(0.005)

    with_running_rig(devices, scene)
    assert called == {f"{owner.__name__}.{method}" for owner, method in handed_on}


@pytest.mark.parametrize(("periods_s", "late_s"), [(STANDSTILL_S + 0.1, 0.0), (0.0, STANDSTILL_S + 0.1)])
def test_a_tick_behind_a_standstill_tells_the_serial_faces(
    devices: OwnDevices, monkeypatch: pytest.MonkeyPatch, periods_s: float, late_s: float
) -> None:
    """On a bus an answer that comes late is taken for that to the next question."""
    told: list[str] = []

    async def scene(rig: RunningRig, guardian: socket.socket) -> None:
        with monkeypatch.context() as patch:
            patch.setattr(rig._faces, "_serial", [SimpleNamespace(note_standstill=lambda: told.append("stood still"))])
            rig._on_tick(1, 0.0)
            assert told == []
            rig._on_tick(1 + round(periods_s * rig._rig.loop_hz), late_s)

    with_running_rig(devices, scene)
    assert told == ["stood still"]


def test_the_first_tick_of_a_machine_that_slept_tells_the_serial_faces(
    devices: OwnDevices, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its clock stood still meanwhile, so that neither periods nor lateness show it. The ticks behind it are as any others."""
    told: list[str] = []
    suspended_s = 0.0

    async def scene(rig: RunningRig, guardian: socket.socket) -> None:
        nonlocal suspended_s
        with monkeypatch.context() as patch:
            patch.setattr(rig._faces, "_serial", [SimpleNamespace(note_standstill=lambda: told.append("stood still"))])
            patch.setattr(rig.loop, "last_tick", LastTick(lambda: suspended_s))
            rig._on_tick(1, 0.0)
            assert told == []
            suspended_s = STANDSTILL_S + 0.1
            rig._on_tick(1, 0.0)
            assert told == ["stood still"]
            rig._on_tick(1, 0.0)

    with_running_rig(devices, scene)
    assert told == ["stood still"]
