"""What stands on the wire when something in the middle dies or stops, seen at the device's end of a real rig's ptys."""

import os
import signal
import time
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import psutil
import pytest

from gateway.processes.event_file import EventReader
from tests.end_to_end.conftest import RunningGateway, start, stop
from tests.end_to_end.own_devices import OwnDevices

OFF, READY, RAMPING, HOLDING, FAULT = range(5)
STALL_S = 0.1
PATIENT_STALL_S = 0.4


@pytest.fixture(scope="module")
def shared_devices(tmp_path_factory: pytest.TempPathFactory) -> Iterator[OwnDevices]:
    """For what takes seconds: a host takes a processor for 100 ms now and then, which is no test's subject here."""
    with OwnDevices(tmp_path_factory.mktemp("own"), stall_s=PATIENT_STALL_S) as devices:
        yield devices


@pytest.fixture(scope="module")
def shared(shared_devices: OwnDevices) -> Iterator[RunningGateway]:
    """At most four restarts in all: five within a minute are the last."""
    gateway = start(shared_devices.directory / "state", rig=str(shared_devices.rig))
    yield gateway
    stop(gateway)


@pytest.fixture
def patient_devices(tmp_path: Path) -> Iterator[OwnDevices]:
    """The same for one test."""
    with OwnDevices(tmp_path, stall_s=PATIENT_STALL_S) as devices:
        yield devices


@pytest.fixture
def patient(patient_devices: OwnDevices) -> Iterator[RunningGateway]:
    """For one test, which ends it."""
    gateway = start(patient_devices.directory / "state", rig=str(patient_devices.rig))
    yield gateway
    stop(gateway)


def pressing(gateway: RunningGateway, volts: float = 4.0) -> None:
    """Direct voltage: what is on the wire is known to the millivolt."""
    answer = gateway.write(0, 1, 0, 0, 1, 0, round(1000 * volts))
    assert not answer.isError(), gateway.log.read_text()
    gateway.wait_until(lambda status: status["state"] == HOLDING)


def restarted(gateway: RunningGateway) -> None:
    """Until the next control process is ready, and asked."""
    gateway.next_ready()
    gateway.client.close()
    assert gateway.client.connect()
    gateway.wait_until(lambda status: status["state"] == OFF)


def stopping(gateway: RunningGateway, devices: OwnDevices, signal_number: int, *pids: int) -> float:
    """Press with 30 N, ask for a stop, and wait until the ramp has begun, which takes two seconds at 15 N/s. Returns when it
    was asked for, s. pids: who is asked, the gateway's own by default."""
    assert not gateway.write(0, 1, 3000, 0, 0, 0, 0).isError()
    gateway.wait_until(lambda status: status["force_measured"] > 2700, within_s=8.0)
    began_s = time.monotonic()
    for pid in pids or [gateway.process.pid]:
        os.kill(pid, signal_number)
    while len({heard.voltage_v for heard in devices.settings_since(began_s)}) < 12:
        assert time.monotonic() - began_s < 2.0, "no ramp"
        time.sleep(0.005)
    return began_s


def test_a_stop_that_every_process_is_asked_for_has_its_ramp(patient, patient_devices):
    """As a machine does that shuts down, a session that ends, or `pkill -f`: control died of it, and the force fell at once."""
    began_s = stopping(patient, patient_devices, signal.SIGTERM, *patient.ready["pids"].values())
    assert patient.process.wait(8) == 0
    on_the_way = [heard.voltage_v for heard in patient_devices.settings_since(began_s)]
    assert all(after <= before for before, after in pairwise(on_the_way))
    assert max(before - after for before, after in pairwise(on_the_way)) < 1.0, "a ramp, not a fall"
    assert on_the_way[-1] == 0.0
    assert "A401" not in patient.log.read_text()


def test_control_that_stands_still_on_the_last_ramp_is_answered_as_at_any_time(patient, patient_devices):
    """The ramp may take seconds; standing still may not."""
    stopping(patient, patient_devices, signal.SIGTERM)
    stopped_s = time.monotonic()
    os.kill(patient.ready["pids"]["control"], signal.SIGSTOP)
    assert patient_devices.until_safe(stopped_s) < 1.0, "140 ms; a busy machine may be late, but not the 5 s of a stop"
    assert patient.process.wait(3) == 0
    with EventReader(patient.state) as reader:
        (stop_words,) = [event.text for event in reader.read_stored() if "stopped as asked" in event.text]
    assert "without a tick" in stop_words


def test_five_restarts_in_a_minute_end_the_gateway_with_the_safe_voltage_held(tmp_path: Path):
    with OwnDevices(tmp_path) as devices:
        gateway = start(tmp_path / "state", rig=str(devices.rig))
        try:
            pressing(gateway)
            killed = kill_every_control(gateway)
        finally:
            stop(gateway)
        assert gateway.process.returncode == 1
        assert killed == 6
        assert "A402" in gateway.said("five restarts")
        assert devices.setting_v == 0.0


def kill_every_control(gateway: RunningGateway) -> int:
    """Each control process as soon as it is there, until the guardian gives up."""
    guardian = psutil.Process(gateway.process.pid)
    killed: set[int] = set()
    deadline_s = time.monotonic() + 20
    while gateway.process.poll() is None and len(killed) < 20:
        assert time.monotonic() < deadline_s
        for child in guardian.children() if guardian.is_running() else []:
            if child.pid not in killed and "gateway.service.control_process" in command_of(child):
                killed.add(child.pid)
                child.kill()
        time.sleep(0.002)
    return len(killed)


def command_of(process: psutil.Process) -> list[str]:
    try:
        return process.cmdline()
    except psutil.Error:
        return []


def test_what_a_careless_hand_sends_to_a_process_does_not_drop_the_force(rested, shared_devices):
    """`systemctl kill -s HUP`, `pkill -USR1`, `killall -INT`: as they come from log rotation and habit. What is meant for the
    gateway is the guardian's to answer."""
    pressing(rested)
    began_s, pids = time.monotonic(), rested.ready["pids"]
    assert len(pids) >= 3
    for name, pid in pids.items():
        os.kill(pid, signal.SIGUSR1)
        if name != "guardian":
            os.kill(pid, signal.SIGHUP)
            os.kill(pid, signal.SIGINT)
    assert rested.status()["state"] == HOLDING
    time.sleep(3 * STALL_S)  # the guardian hears of one that has died of it at once
    assert rested.status()["state"] == HOLDING
    assert all(psutil.pid_exists(pid) for pid in pids.values())
    assert {heard.voltage_v for heard in shared_devices.settings_since(began_s)} <= {shared_devices.setting_v}
    assert shared_devices.setting_v > 3.9


@pytest.mark.parametrize("half", [b"SET 51", b"MO"])
def test_half_a_command_left_on_the_wire_does_not_swallow_the_safe_voltage(rested, shared_devices, half):
    pressing(rested)
    with Path(os.ttyname(shared_devices.output.client)).open("wb", buffering=0) as dying:
        os.kill(rested.ready["pids"]["control"], signal.SIGSTOP)  # its last words are half a command
        killed_at_s = time.monotonic()
        dying.write(half)
    os.kill(rested.ready["pids"]["control"], signal.SIGKILL)
    assert shared_devices.until_safe(killed_at_s) < 1.0
    assert shared_devices.setting_v == 0.0
    assert any(heard.line.startswith(half) and b"SET 0" in heard.line for heard in shared_devices.heard[-20:])
    restarted(rested)


def test_a_silent_device_is_told_three_times_and_the_gateway_goes_on(rested, shared_devices):
    pressing(rested)
    said_before = len(rested.log.read_text().splitlines())
    shared_devices.is_silent = True
    killed_at_s = time.monotonic()
    os.kill(rested.ready["pids"]["control"], signal.SIGKILL)
    line = rested.said("not acknowledged", within_s=3.0, after=said_before)
    shared_devices.is_silent = False
    assert "A401" in line
    restarted(rested)
    zeros = [heard for heard in shared_devices.settings_since(killed_at_s) if heard.time_s < killed_at_s + 0.35]
    assert 3 <= len(zeros) <= 4
    assert {heard.voltage_v for heard in zeros} == {0.0}


def test_an_unplugged_regulator_is_a_fault_and_its_successor_hears_the_safe_voltage_first(rested, shared_devices):
    pressing(rested)
    shared_devices.pull_output()
    rested.wait_until(lambda status: status["state"] == FAULT)
    assert rested.words(110, 1) == [10], "output_lost"
    assert "unplugged" in rested.said("E102")
    pids = rested.ready["pids"].values()  # control lets go of the port at once, the guardian as soon as it hears of it
    rested.wait_until(lambda status: not [held for pid in pids for held in deleted_terminals(pid)])
    assert rested.words(110, 1) == [10], "still lost"
    plugged_at_s = time.monotonic()
    shared_devices.plug_output()
    deadline_s = time.monotonic() + 6
    while not shared_devices.settings_since(plugged_at_s):
        assert time.monotonic() < deadline_s
        time.sleep(0.01)
    assert shared_devices.settings_since(plugged_at_s)[0].voltage_v == 0.0
    assert rested.status()["state"] == FAULT, "latched"
    rested.wait_until(lambda status: not rested.write(0, 2, 0).isError() and rested.status()["state"] == OFF)
    rested.wait_until(lambda status: status["status_word"] & 2)  # the output is asked anew behind a reset
    pressing(rested)  # and the new line has been handed to the guardian as well:
    killed_at_s = time.monotonic()
    os.kill(rested.ready["pids"]["control"], signal.SIGKILL)
    assert shared_devices.until_safe(killed_at_s) < 0.5
    restarted(rested)


def test_what_ctrl_c_ramps_a_second_one_cuts(rested, shared_devices):
    """The last one of the gateway that they share."""
    began_s = stopping(rested, shared_devices, signal.SIGINT)
    on_the_way = [heard.voltage_v for heard in shared_devices.settings_since(began_s)]
    assert all(after <= before for before, after in pairwise(on_the_way))
    assert on_the_way[-1] > 0.5, "still on the ramp"
    cut_s = time.monotonic()
    rested.process.send_signal(signal.SIGINT)
    assert shared_devices.until_safe(cut_s) < 0.3
    assert rested.process.wait(3) == 0
    assert shared_devices.heard[-1].voltage_v == 0.0


def deleted_terminals(pid: int) -> list[str]:
    """Ports that a process has open and that are not there any more: the next adapter would not get their names."""
    files = (str(file.readlink()) for file in Path(f"/proc/{pid}/fd").iterdir())
    return [file for file in files if file.startswith("/dev/pts/") and file.endswith("(deleted)")]
