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


@pytest.fixture
def devices(tmp_path: Path) -> Iterator[OwnDevices]:
    with OwnDevices(tmp_path) as devices:
        yield devices


@pytest.fixture
def patient_devices(tmp_path: Path) -> Iterator[OwnDevices]:
    """For what takes seconds: a host takes a processor for 100 ms now and then, which is no test's subject here."""
    with OwnDevices(tmp_path, stall_s=PATIENT_STALL_S) as devices:
        yield devices


@pytest.fixture
def patient(patient_devices: OwnDevices) -> Iterator[RunningGateway]:
    gateway = start(patient_devices.directory / "state", rig=str(patient_devices.rig))
    yield gateway
    stop(gateway)


@pytest.fixture
def real(devices: OwnDevices) -> Iterator[RunningGateway]:
    gateway = start(devices.directory / "state", rig=str(devices.rig))
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


def safe_after_s(gateway: RunningGateway, devices: OwnDevices, signal_number: int) -> float:
    """From this signal to control, which presses, until the safe voltage is on the wire; a new control is ready behind it."""
    pressing(gateway)
    signalled_s = time.monotonic()
    os.kill(gateway.ready["pids"]["control"], signal_number)
    took_s = devices.until_safe(signalled_s)
    restarted(gateway)
    return took_s


def best_of_two(gateway: RunningGateway, devices: OwnDevices, signal_number: int) -> float:
    """A bound of milliseconds on a machine that does other things too: one of two tries must keep it."""
    first_s = safe_after_s(gateway, devices, signal_number)
    return first_s if first_s <= STALL_S + 0.04 else min(first_s, safe_after_s(gateway, devices, signal_number))


def test_a_start_says_the_safe_voltage_first(real: RunningGateway, devices: OwnDevices):
    assert devices.heard[0].voltage_v == 0.0
    assert {heard.voltage_v for heard in devices.settings_since(0.0)} == {0.0}


def test_a_stopped_control_process_has_the_safe_voltage_on_the_wire_in_time(real, devices):
    took_s = best_of_two(real, devices, signal.SIGSTOP)
    print(f"SIGSTOP to the safe voltage: {took_s * 1e3:.0f} ms, allowed {(STALL_S + 0.04) * 1e3:.0f} ms")
    assert took_s <= STALL_S + 0.04
    assert real.words(110, 1) == [12], "the cause is readable: loop_stalled"
    assert real.words(111, 1)[0] & 1, "restarted"
    assert "stalled" in real.said("A401")
    assert "acknowledged" in real.said("A401")


def test_a_killed_control_process_has_the_safe_voltage_on_the_wire_in_time(real, devices):
    took_s = best_of_two(real, devices, signal.SIGKILL)
    print(f"SIGKILL to the safe voltage: {took_s * 1e3:.1f} ms")
    assert took_s <= 0.025 or took_s <= STALL_S, "25 ms; a machine that is busy may take as long as for a stall"
    with EventReader(real.state) as reader:
        events = list(reader.read_stored())
    pressed = max(n for n, event in enumerate(events) if event.source == "control" and "enabled by" in event.text)
    deaths = [event.source for event in events[pressed:] if event.code == "A401"]
    assert deaths == ["guardian"], "one file, in the order in which it happened"


@pytest.mark.parametrize("half", [b"SET 51", b"MO"])
def test_half_a_command_left_on_the_wire_does_not_swallow_the_safe_voltage(real, devices, half):
    pressing(real)
    with Path(os.ttyname(devices.output.client)).open("wb", buffering=0) as dying:
        os.kill(real.ready["pids"]["control"], signal.SIGSTOP)  # its last words are half a command
        killed_at_s = time.monotonic()
        dying.write(half)
    os.kill(real.ready["pids"]["control"], signal.SIGKILL)
    assert devices.until_safe(killed_at_s) < 1.0
    assert devices.setting_v == 0.0
    assert any(heard.line.startswith(half) and b"SET 0" in heard.line for heard in devices.heard[-20:])
    restarted(real)


def test_a_silent_device_is_told_three_times_and_the_gateway_goes_on(real, devices):
    pressing(real)
    devices.is_silent = True
    killed_at_s = time.monotonic()
    os.kill(real.ready["pids"]["control"], signal.SIGKILL)
    line = real.said("not acknowledged", within_s=3.0)
    devices.is_silent = False
    assert "A401" in line
    restarted(real)
    zeros = [heard for heard in devices.settings_since(killed_at_s) if heard.time_s < killed_at_s + 0.35]
    assert 3 <= len(zeros) <= 4
    assert {heard.voltage_v for heard in zeros} == {0.0}


def test_an_unplugged_regulator_is_a_fault_and_its_successor_hears_the_safe_voltage_first(patient, patient_devices):
    pressing(patient)
    patient_devices.pull_output()
    patient.wait_until(lambda status: status["state"] == FAULT)
    assert patient.words(110, 1) == [10], "output_lost"
    assert "unplugged" in patient.said("E102")
    pids = patient.ready["pids"].values()  # control lets go of the port at once, the guardian as soon as it hears of it
    patient.wait_until(lambda status: not [held for pid in pids for held in deleted_terminals(pid)])
    assert patient.words(110, 1) == [10], "still lost"
    plugged_at_s = time.monotonic()
    patient_devices.plug_output()
    deadline_s = time.monotonic() + 6
    while not patient_devices.settings_since(plugged_at_s):
        assert time.monotonic() < deadline_s
        time.sleep(0.01)
    assert patient_devices.settings_since(plugged_at_s)[0].voltage_v == 0.0
    assert patient.status()["state"] == FAULT, "latched"
    patient.wait_until(lambda status: not patient.write(0, 2, 0).isError() and patient.status()["state"] == OFF)
    pressing(patient)  # and the new line has been handed to the guardian as well:
    killed_at_s = time.monotonic()
    os.kill(patient.ready["pids"]["control"], signal.SIGKILL)
    assert patient_devices.until_safe(killed_at_s) < 0.5
    restarted(patient)


def deleted_terminals(pid: int) -> list[str]:
    """Ports that a process has open and that are not there any more: the next adapter would not get their names."""
    files = (str(file.readlink()) for file in Path(f"/proc/{pid}/fd").iterdir())
    return [file for file in files if file.startswith("/dev/pts/") and file.endswith("(deleted)")]


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


def test_what_ctrl_c_ramps_a_second_one_cuts(patient, patient_devices):
    began_s = stopping(patient, patient_devices, signal.SIGINT)
    on_the_way = [heard.voltage_v for heard in patient_devices.settings_since(began_s)]
    assert all(after <= before for before, after in pairwise(on_the_way))
    assert on_the_way[-1] > 0.5, "still on the ramp"
    cut_s = time.monotonic()
    patient.process.send_signal(signal.SIGINT)
    assert patient_devices.until_safe(cut_s) < 0.3
    assert patient.process.wait(3) == 0
    assert patient_devices.heard[-1].voltage_v == 0.0


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


def test_what_a_careless_hand_sends_to_a_process_does_not_drop_the_force(patient, patient_devices):
    """`systemctl kill -s HUP`, `pkill -USR1`, `killall -INT`: as they come from log rotation and habit. What is meant for the
    gateway is the guardian's to answer."""
    pressing(patient)
    began_s, pids = time.monotonic(), patient.ready["pids"]
    assert len(pids) >= 3
    for name, pid in pids.items():
        os.kill(pid, signal.SIGUSR1)
        if name != "guardian":
            os.kill(pid, signal.SIGHUP)
            os.kill(pid, signal.SIGINT)
    assert patient.status()["state"] == HOLDING
    time.sleep(3 * STALL_S)  # the guardian hears of one that has died of it at once
    assert patient.status()["state"] == HOLDING
    assert all(psutil.pid_exists(pid) for pid in pids.values())
    assert {heard.voltage_v for heard in patient_devices.settings_since(began_s)} <= {patient_devices.setting_v}
    assert patient_devices.setting_v > 3.9


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
