"""What happens on the wire when a process in the middle goes away."""

import os
import signal
import time

import psutil
import pytest

from gateway.processes.event_file import EventReader
from gateway.profiles import shipped_profiles_folder
from tests.end_to_end.conftest import POLL_S, start, stop

OFF, FAULT = 0, 4


def pressing(running, setpoint=2000):
    running.write(0, 1, setpoint)
    running.wait_until(lambda status: status["force_measured"] > setpoint - 200)


def reconnect(running, within_s=10.0):
    deadline_s = time.monotonic() + within_s
    running.client.close()
    while not running.client.connect():
        assert time.monotonic() < deadline_s
        time.sleep(POLL_S)
    while True:
        try:
            return running.status()
        except Exception:
            assert time.monotonic() < deadline_s
            time.sleep(POLL_S)
            running.client.close()
            running.client.connect()


def test_killing_control_drops_the_force_and_restarts_in_off(shared):
    pressing(shared)
    os.kill(shared.ready["pids"]["control"], signal.SIGKILL)
    status = reconnect(shared)
    assert status["state"] == OFF
    assert status["output_voltage"] == 0
    assert shared.words(111, 1)[0] & 1, "the restarted warning"
    shared.wait_until(lambda status: abs(status["force_measured"]) < 200)
    shared.next_ready()
    pressing(shared)


def test_a_stopped_guardian_is_not_felt(shared):
    """Control says itself what is due; the guardian goes on where it was."""
    pressing(shared)
    control = shared.ready["pids"]["control"]
    shared.process.send_signal(signal.SIGSTOP)
    end_s = time.monotonic() + 0.3
    try:
        while time.monotonic() < end_s:
            assert shared.status()["state"] in (2, 3), "ramping or holding"
            time.sleep(0.02)
    finally:
        shared.process.send_signal(signal.SIGCONT)
    time.sleep(0.15)  # longer than a heartbeat may be away
    assert shared.status()["state"] in (2, 3)
    assert psutil.Process(control).is_running()


def test_a_stopped_control_process_is_killed_and_replaced(shared):
    pressing(shared)
    os.kill(shared.ready["pids"]["control"], signal.SIGSTOP)
    assert reconnect(shared)["state"] == OFF
    shared.next_ready()


def test_ctrl_c_ramps_to_zero_and_leaves_no_process_and_no_socket(shared):
    """The last one of the gateway that they share."""
    shared.rest()
    pressing(shared, 3000)
    children = psutil.Process(shared.process.pid).children(recursive=True)
    shared.process.send_signal(signal.SIGINT)
    assert shared.process.wait(6) == 0
    assert not any(child.is_running() and child.status() != psutil.STATUS_ZOMBIE for child in children)
    assert not list(shared.state.glob("*.sock"))


def test_a_dead_guardian_takes_control_and_rig_with_it(running):
    pressing(running)
    children = psutil.Process(running.process.pid).children(recursive=True)
    running.process.kill()
    _, alive = psutil.wait_procs(children, timeout=5)
    assert not alive
    with EventReader(running.state) as reader:
        said = [event.code for event in reader.read_stored() if event.severity == "error"]
    assert said == ["A412"], "no plug of the simulated rig, whose ports went with it"


@pytest.mark.sampled
@pytest.mark.parametrize("is_prepared", [True, False])
def test_a_rig_file_that_is_edited_meanwhile_is_for_the_next_start(tmp_path, is_prepared):
    """Half done, as editors leave files, when control dies, and then the simulated rig: all goes on as it was started, and
    control says so; also where the process that both are forked from was gone already, the first that a machine without
    memory takes."""
    rig = tmp_path / "cell.yaml"
    rig.write_text((shipped_profiles_folder() / "rigs" / "demo.yaml").read_text().replace("name: demo", "name: cell"))
    gateway = start(tmp_path / "state", rig=str(rig))
    try:
        rig.write_text("name: cell\nlimits: {force_max_n: 6")
        if not is_prepared:
            os.kill(gateway.ready["pids"]["fork_server"], signal.SIGKILL)
            gateway.said("A407")
        os.kill(gateway.ready["pids"]["control"], signal.SIGKILL)
        assert reconnect(gateway)["state"] == OFF
        assert "go" in gateway.said("W247 the files of rig cell have faults now")
        gateway.next_ready()
        pressing(gateway)
        os.kill(gateway.ready["pids"]["rig"], signal.SIGKILL)
        gateway.wait_until(lambda status: status["state"] == FAULT)
        gateway.wait_until(lambda status: not gateway.write(0, 2, 0).isError())  # once the rig is there again
        gateway.wait_until(lambda status: status["status_word"] & 2 and abs(status["force_measured"]) < 200)
        pressing(gateway)
    finally:
        assert stop(gateway) == 0
