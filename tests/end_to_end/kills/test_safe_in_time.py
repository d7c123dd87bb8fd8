"""What stands on the wire when control dies or stops, at the device's end of a real rig's ptys, and how soon."""

import os
import signal
import time
from collections.abc import Iterator

import pytest

from gateway.processes.event_file import EventReader
from tests.end_to_end.conftest import RunningGateway, start, stop
from tests.end_to_end.kills.test_last_word import STALL_S, pressing, restarted
from tests.end_to_end.own_devices import OwnDevices


@pytest.fixture(scope="module")
def devices(tmp_path_factory: pytest.TempPathFactory) -> Iterator[OwnDevices]:
    with OwnDevices(tmp_path_factory.mktemp("own")) as devices:
        yield devices


@pytest.fixture(scope="module")
def real(devices: OwnDevices) -> Iterator[RunningGateway]:
    """At most four restarts in all: five within a minute are the last."""
    gateway = start(devices.directory / "state", rig=str(devices.rig))
    yield gateway
    stop(gateway)


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
