"""What goes on when a control process dies: the next one is told what the one before had kept with the guardian."""

import asyncio
import contextlib
import socket
import time
from pathlib import Path
from typing import Any

import pytest

from gateway.codes.warning_bits import WarningBit
from gateway.modbus import Peer
from gateway.processes import message_link
from gateway.processes.exit_cause import EndCause, Ending
from gateway.recording import list_recordings
from gateway.recording.label import RecordingLabel, label_of
from gateway.registers import Refusal
from gateway.registers.words import ControlBit, State
from gateway.registers.writes.held_starts import HeldEnables
from gateway.service.running_rig.handover import Handover
from gateway.service.running_rig.recording.recordings import Recordings
from gateway.service.running_rig.recording.wanted_recording import WantedRecording
from gateway.service.running_rig.running_rig import RunningRig
from tests.certificates import store_all
from tests.disk.at_once import AtOnce
from tests.service.kept_log import Log
from tests.service.rigs import demo
from tests.service.running_rig.begun_rig import OwnDevices, devices, with_running_rig

__all__ = ["devices"]

NAMED = RecordingLabel("the worn seal", "left cylinder")
ROBOT = Peer("10.0.0.5")


class Process:
    """The recordings of a control process, and what it has kept for the next one."""

    def __init__(self, state: Path, kept: dict[str, Any]) -> None:
        self.kept = kept
        self.recordings = Recordings(state / "recordings", demo(), Log(), AtOnce())  # type: ignore[arg-type]
        self.recordings.on_wanted = self._keep

    def _keep(self, wanted: WantedRecording | None) -> None:
        self.kept["recording"] = wanted.as_facts() if wanted else None

    def wanted(self, now_s: float, *, record: bool = False) -> WantedRecording | None:
        return Handover(self.kept, record=record).recording(now_s)


def test_a_recording_goes_on_with_its_name_and_ends_when_it_would_have(tmp_path: Path) -> None:
    dead = Process(tmp_path, {})
    dead.recordings.start(NAMED, for_s=60.0)
    dead.recordings.flush(100.0)
    again = Process(tmp_path, dict(dead.kept))
    wanted = again.wanted(110.0)
    first = str(tmp_path / "recordings" / "0001.fgr")
    assert wanted == WantedRecording(NAMED, 60.0, 160.0, first)
    assert again.recordings.try_start(wanted).result() == ()
    again.recordings.flush(159.9)
    status = again.recordings.status()
    assert (Path(status["recording"]).name, status["began_in"]) == ("0002.fgr", first)
    again.recordings.flush(160.0)
    assert again.recordings.status() == {"recording": None}
    assert again.wanted(160.0) is None
    assert [label_of(entry.header) for entry in list_recordings(tmp_path)] == [NAMED, NAMED]
    dead.recordings.stop()


def test_one_whose_time_is_over_by_then_is_not_begun_again(tmp_path: Path) -> None:
    dead = Process(tmp_path, {})
    dead.recordings.start(for_s=60.0)
    dead.recordings.flush(100.0)
    assert dead.wanted(159.9) and not dead.wanted(160.0)
    dead.recordings.stop()


def test_what_was_recorded_from_the_start_is_not_once_somebody_has_ended_it(tmp_path: Path) -> None:
    first = Process(tmp_path, {})
    wanted = first.wanted(0.0, record=True)
    assert wanted == WantedRecording()
    first.recordings.try_start(wanted)
    assert first.wanted(0.0, record=True), "it goes on while nobody has"
    first.recordings.stop()
    assert first.wanted(0.0, record=True) is None


def test_one_that_the_disk_refuses_is_wanted_only_where_it_waits_for_room(tmp_path: Path) -> None:
    (tmp_path / "recordings").write_text("no folder")
    asked, at_start = Process(tmp_path, {}), Process(tmp_path, {})
    assert asked.recordings.start().exception()
    assert asked.wanted(0.0) is None, "who asked was told no"
    at_start.recordings.try_start(WantedRecording())
    assert at_start.wanted(0.0) == WantedRecording()
    for process in (asked, at_start):
        process.recordings.stop()


def test_a_process_that_ends_by_itself_leaves_what_is_wanted(tmp_path: Path) -> None:
    """By an internal error, say: it closes its recording whole, and the next one goes on."""
    one = Process(tmp_path, {})
    one.recordings.start(NAMED)
    asyncio.run(one.recordings.close())
    wanted = one.wanted(0.0)
    assert wanted and wanted.label == NAMED


def test_another_calibration_or_plant_than_before_is_told_and_the_same_is_not() -> None:
    kept = {"calibration": 3, "plant": 2}
    assert Handover({}, record=False).changes(calibration=1, plant=0) == ()
    assert Handover(kept, record=False).changes(calibration=3, plant=2) == ()
    words = Handover(kept, record=False).changes(calibration=4, plant=0)
    assert [word.partition(":")[0] for word in words] == [
        "W250 calibration 3 was in use before the restart, now it is 4",
        "W250 plant 2 was in use before the restart, now it is the rig's own",
    ]


def test_another_calibration_than_before_the_restart_is_told_by_name_and_kept_for_the_next(devices: OwnDevices) -> None:
    told: list[message_link.Message] = []

    async def scene(rig: RunningRig, guardian: socket.socket) -> None:
        while (message := message_link.receive(guardian)) is not None:
            told.append(message)
            message.drop_descriptors()
            if message.tag == message_link.KEEP and "calibration" in message.body:
                return

    died = Ending(EndCause.DIED, "control process died")
    lines = with_running_rig(devices, scene, died, {"calibration": 7})
    [number] = {message.body["calibration"] for message in told if "calibration" in message.body}
    assert any(f"W250 calibration 7 was in use before the restart, now it is {number}: " in line for line in lines)


@pytest.mark.parametrize(("zero_n", "words"), [(8.3, "8.30 N more"), (-2.0, "2.00 N less")])
@pytest.mark.parametrize("is_tared", [False, True])
def test_a_tare_that_a_restart_has_forgotten_is_told_until_the_next_one(
    devices: OwnDevices, zero_n: float, words: str, *, is_tared: bool
) -> None:
    """Behind a crash at noon all forces were off by what had been tared in the morning, and nobody said a word; behind a second
    crash nobody did again."""
    kept: dict[str, Any] = {}

    async def scene(rig: RunningRig, guardian: socket.socket) -> None:
        rig.loop.refresh()
        assert rig.loop.decision
        assert WarningBit.ZERO_DOUBTED in rig.loop.decision.warnings, "a PLC reads no log, and enables as before"
        while is_tared and rig.loop.decision.warnings & WarningBit.ZERO_DOUBTED:
            with contextlib.suppress(Refusal):
                rig.bank.write_registers(0, TARE, ROBOT)
            await asyncio.sleep(0.01)
        tared_n = rig.controller.zero_n
        while kept.get("zero_n") != (tared_n if is_tared else zero_n):
            with contextlib.suppress(BlockingIOError):
                message = message_link.receive(guardian)
                assert message, "the guardian's line has ended"
                kept.update(message.body if message.tag == message_link.KEEP else {})
                message.drop_descriptors()
                continue
            await asyncio.sleep(0.01)

    lines = with_running_rig(devices, scene, Ending(EndCause.DIED, "control process died"), {"zero_n": zero_n})
    assert any(
        f"W250 the tare before the restart is forgotten, and the cell reads {words} than before it" in line
        for line in lines
    )
    assert bool(Handover({**kept, "plant": 0}, record=False).changes()) is (abs(kept["zero_n"]) >= 0.05)


def test_the_port_of_each_tls_face_is_left_to_the_next_process(devices: OwnDevices) -> None:
    files = store_all(devices.directory)
    face = f"{{type: tls, port: 0, certificate: {files.crt('gateway')}, key: {files.key('gateway')}, ca: {files.crt('ca')}}}"
    devices.rig.write_text(f"{devices.rig.read_text()}fieldbus: [{face}, {face}]\n")
    with socket.create_server(("127.0.0.1", 0)) as one, socket.create_server(("127.0.0.1", 0)) as another:
        ports = {"1": one.getsockname()[1], "2": another.getsockname()[1]}
    kept: dict[str, Any] = {}

    async def scene(rig: RunningRig, guardian: socket.socket) -> None:
        while "tls_ports" not in kept and (message := message_link.receive(guardian)) is not None:
            kept.update(message.body if message.tag == message_link.KEEP else {})
            message.drop_descriptors()
        for port in ports.values():
            socket.create_connection(("127.0.0.1", port)).close()

    with_running_rig(devices, scene, Ending(EndCause.DIED, "control process died"), {"tls_ports": ports})
    assert kept["tls_ports"] == ports


TARE = int(ControlBit.TARE).to_bytes(2, "big")
RUN = int(ControlBit.START_CALIBRATION).to_bytes(2, "big")


def test_the_bit_of_a_run_that_a_master_keeps_at_1_is_left_to_the_next_process(devices: OwnDevices) -> None:
    kept: dict[str, Any] = {}

    async def scene(rig: RunningRig, guardian: socket.socket) -> None:
        for _ in range(2):  # once is no cycle
            rig.bank.write_registers(0, RUN, ROBOT)
        while "held_runs" not in kept and (message := message_link.receive(guardian)) is not None:
            kept.update(message.body if message.tag == message_link.KEEP else {})
            message.drop_descriptors()

    with_running_rig(devices, scene)
    assert kept["held_runs"] == {"10.0.0.5": int(ControlBit.START_CALIBRATION)}


def test_behind_a_restart_that_bit_begins_no_other_run(devices: OwnDevices) -> None:
    """Control died in a ladder, and the robot's next cycle, a tenth of a second later, began another one."""

    async def scene(rig: RunningRig, guardian: socket.socket) -> None:
        with pytest.raises(Refusal, match="was kept at 1 beyond the end of its run"):
            rig.bank.write_registers(0, RUN, ROBOT)
        assert rig.controller.state is State.OFF
        rig.bank.write_registers(0, bytes(2), ROBOT)
        rig.bank.write_registers(0, RUN, ROBOT)
        assert rig.controller.state is State.CALIBRATING, "its own 0 lets the next 1 count"

    died = Ending(EndCause.DIED, "control process died")
    with_running_rig(devices, scene, died, {"held_runs": {"10.0.0.5": int(ControlBit.START_CALIBRATION)}})


ENABLE_12_N = int(ControlBit.ENABLE).to_bytes(2, "big") + (1200).to_bytes(2, "big")


def test_an_enable_that_a_master_keeps_at_1_over_a_fault_is_left_to_the_next_process(devices: OwnDevices) -> None:
    kept: dict[str, Any] = {}

    async def scene(rig: RunningRig, guardian: socket.socket) -> None:
        rig.controller.fail_internally(time.monotonic())
        with pytest.raises(Refusal, match="W212"):
            rig.bank.write_registers(0, ENABLE_12_N, ROBOT)
        while "held_enables" not in kept and (message := message_link.receive(guardian)) is not None:
            kept.update(message.body if message.tag == message_link.KEEP else {})
            message.drop_descriptors()

    with_running_rig(devices, scene)
    assert kept["held_enables"]["10.0.0.5"] == pytest.approx(time.monotonic(), abs=30.0)


@pytest.mark.parametrize(("ago_s", "is_held"), [(2.0, True), (60.0, False)])
def test_behind_a_restart_an_enable_that_stood_over_a_fault_presses_not(
    devices: OwnDevices, ago_s: float, is_held: bool
) -> None:
    """Control was killed behind A311, and 0.16 s later the robot's next cycle pressed 12 N: nobody had reset anything."""

    async def scene(rig: RunningRig, guardian: socket.socket) -> None:
        for _ in range(2 if is_held else 0):
            with pytest.raises(Refusal, match="enable was kept at 1 over a fault"):
                rig.bank.write_registers(0, ENABLE_12_N, ROBOT)
            assert rig.controller.state is State.OFF
        if is_held:
            rig.bank.write_registers(0, bytes(2), ROBOT)
        rig.bank.write_registers(0, ENABLE_12_N, ROBOT)
        assert rig.controller.state is not State.OFF, "its own 0 lets the next 1 count"

    died = Ending(EndCause.DIED, "control process died")
    with_running_rig(devices, scene, died, {"held_enables": {"10.0.0.5": time.monotonic() - ago_s}})


def test_a_host_that_holds_enable_over_a_fault_is_told_once_a_second_and_its_end_at_once() -> None:
    held, told = HeldEnables(), []
    held.on_change = told.append
    for tenth in range(25):
        held.note("10.0.0.5", 100.0 + 0.1 * tenth)
    held.let_go("10.0.0.5", 103.0)
    held.let_go("10.0.0.5", 103.0)
    assert [one.get("10.0.0.5") for one in told] == [100.0, pytest.approx(101.0), pytest.approx(102.0), None]
