"""A gateway that presses on a real rig's file, and what can be done to its processes; for process_faults.py.

Each function does one thing to a scene and returns two times: until the wire was safe (0: it was, or nothing had to become
so), and until the gateway was ready again. What must not happen is asserted.
"""

import contextlib
import io
import os
import signal
import tempfile
import time
from pathlib import Path
from typing import Any

import psutil

from gateway.cli.control_socket import ask
from gateway.recording import list_recordings
from tests.end_to_end.conftest import RunningGateway, start, stop
from tests.end_to_end.own_devices import OwnDevices

OFF, HOLDING, FAULT = 0, 3, 4
PRESSED_V = 4.0
PTYS_TRIED = 3
"""A gateway that has outlived its own bench opens any pty that gets the number of the one it has lost."""
UNDISTURBED_S = 0.25
"""So long it is looked whether a force stays that must stay."""
BATCH_S = 0.25
"""What a kill may cost a recording: 0.1 s, and what was on its way through a busy machine."""
Times = tuple[float, float]


class Scene:
    """A gateway that can press, and its devices. is_watched: with the residual watch beside it."""

    def __init__(self, *, is_watched: bool = False) -> None:
        self._folder = tempfile.TemporaryDirectory()
        self._passed: list[OwnDevices] = []
        for _ in range(PTYS_TRIED):
            self.devices = OwnDevices(Path(tempfile.mkdtemp(dir=self._folder.name)))
            if is_watched:
                with self.devices.rig.open("a") as rig:
                    rig.write("plant: paper-slide\nresidual_watch: {enabled: true}\n")
            self.devices.__enter__()
            try:
                self.gateway: RunningGateway = self._start()
                return
            except AssertionError as error:
                self._passed.append(self.devices)  # its number stays taken, so that the next one is another
                if "E103" not in str(error):
                    raise
        raise AssertionError("every pty is held by somebody")

    def _start(self) -> RunningGateway:
        return start(Path(self._folder.name) / "state", rig=str(self.devices.rig))

    def close(self) -> str:
        """Stop the gateway, then its devices. Return what it said."""
        with contextlib.redirect_stdout(io.StringIO()) as said:  # it prints the log, for tests
            stop(self.gateway)
        for devices in (self.devices, *self._passed):
            devices.__exit__()
        self._folder.cleanup()
        return said.getvalue()

    def press(self) -> None:
        """Hold 4 V."""
        self.gateway.wait_until(lambda status: bool(status["status_word"] & 2))  # an enable would be accepted
        assert not self.gateway.write(0, 1, 0, 0, 1, 0, round(1e3 * PRESSED_V)).isError()
        self.gateway.wait_until(lambda status: status["state"] == HOLDING)

    def reconnect(self) -> None:
        """Wait until a new control process answers, in OFF."""
        self.gateway.next_ready()
        self.gateway.client.close()
        while not self.gateway.client.connect():
            time.sleep(0.002)
        self.gateway.wait_until(lambda status: status["state"] == OFF)

    def start_again(self) -> None:
        """Start the gateway whose guardian has died, as a service manager does: once its children are gone."""
        old, pids = self.gateway, self.gateway.ready["pids"]
        old.client.close()
        old.process.wait()
        if old.process.stdout:
            old.process.stdout.close()
        deadline_s = time.monotonic() + 5.0
        while not all(has_ended(pid) for pid in pids.values()):
            assert time.monotonic() < deadline_s, "a child has outlived the guardian"
            time.sleep(0.002)
        self.gateway = self._start()
        self.gateway.wait_until(lambda status: status["state"] == OFF)

    def child(self, module: str) -> int:
        """Return the process number of the guardian's child that runs this module, as soon as there is one."""
        deadline_s = time.monotonic() + 10.0
        while time.monotonic() < deadline_s:
            for child in psutil.Process(self.gateway.process.pid).children(recursive=True):
                with contextlib.suppress(psutil.Error):
                    if any(module in word for word in (child.name(), *child.cmdline())):
                        return child.pid
            time.sleep(0.01)
        raise AssertionError(f"no {module}")

    def stays_pressed(self, since_s: float) -> None:
        """Look for a while whether 4 V stay out, and nothing else has been said since."""
        while time.monotonic() < since_s + UNDISTURBED_S:
            assert self.gateway.status()["state"] == HOLDING
            time.sleep(0.02)
        said = {round(heard.voltage_v or 0.0, 1) for heard in self.devices.settings_since(since_s)}
        assert said <= {PRESSED_V}, f"it was disturbed: {said}"

    def recording(self, answer: dict[str, Any]) -> Path:
        """Return the file that is recorded to, once the disk has taken it. answer: to `record`."""
        deadline_s = time.monotonic() + 2.0
        while not answer["recording"]:
            assert time.monotonic() < deadline_s, f"it does not record: {answer}"
            time.sleep(0.002)
            answer = ask(self.gateway.state, {"do": "record"})
        return Path(answer["recording"])

    def disable(self) -> None:
        """Let go, and wait for OFF."""
        assert not self.gateway.write(0, 0).isError()
        self.gateway.wait_until(lambda status: status["state"] == OFF)


def has_ended(pid: int) -> bool:
    """Tell whether a process runs no more. An orphan's body is its new parent's business."""
    try:
        return bool(psutil.Process(pid).status() == psutil.STATUS_ZOMBIE)
    except psutil.NoSuchProcess:
        return True


def fault_control(scene: Scene, number: int) -> Times:
    """Send this signal to control, which presses; it is safe, and another one answers."""
    scene.press()
    began_s = time.monotonic()
    os.kill(scene.gateway.ready["pids"]["control"], number)
    safe_s = scene.devices.until_safe(began_s)
    scene.reconnect()
    return safe_s, time.monotonic() - began_s


def fault_recording(scene: Scene, number: int) -> Times:
    """Send it to one that records: the recording, too, ends where control did, and goes on in another file behind it."""
    state = scene.gateway.state
    scene.press()
    path = scene.recording(ask(state, {"do": "record", "on": True}))
    recorded_s = time.monotonic()
    time.sleep(UNDISTURBED_S)
    lasted_s = time.monotonic() - recorded_s
    times = fault_control(scene, number)
    (entry,) = (entry for entry in list_recordings(state) if entry.path == path)
    assert not entry.fault, entry.fault
    assert entry.duration_s >= lasted_s - BATCH_S, f"{entry.duration_s:.2f} s of {lasted_s:.2f} s are kept"
    assert scene.recording(ask(state, {"do": "record"})) > path
    ask(state, {"do": "record", "on": False})
    return times


def kill_guardian(scene: Scene) -> Times:
    """Kill the guardian: control says the safe voltage and ends; a service manager starts the gateway again."""
    scene.press()
    began_s = time.monotonic()
    scene.gateway.process.kill()
    safe_s = scene.devices.until_safe(began_s)
    scene.start_again()
    return safe_s, time.monotonic() - began_s


def stop_guardian(scene: Scene) -> Times:
    """Stop the guardian for a while: control needs it for no force, and it goes on where it was."""
    scene.press()
    control, began_s = scene.gateway.ready["pids"]["control"], time.monotonic()
    scene.gateway.process.send_signal(signal.SIGSTOP)
    try:
        scene.stays_pressed(began_s)
    finally:
        scene.gateway.process.send_signal(signal.SIGCONT)
    went_on_s = time.monotonic()
    scene.stays_pressed(went_on_s)
    assert scene.child("control_process") == control, "control was started again"
    scene.disable()
    return 0.0, 0.0


def fault_watch(scene: Scene, number: int) -> Times:
    """Send this signal to the residual watch: the force does not feel it. A stopped one goes on afterwards."""
    watch = scene.child("watch_process")
    scene.press()
    began_s = time.monotonic()
    os.kill(watch, number)
    scene.stays_pressed(began_s)
    if number == signal.SIGSTOP:
        os.kill(watch, signal.SIGCONT)
    else:
        assert "started again" in scene.gateway.said("A346")
    scene.disable()
    return 0.0, 0.0


def pull_plug(scene: Scene) -> Times:
    """Return (until the safe voltage is the first word to what is plugged in, until ready) after the plug is back, s."""
    scene.press()
    scene.devices.pull_output()
    scene.gateway.wait_until(lambda status: status["state"] == FAULT)
    scene.devices.plug_output()
    plugged_s = time.monotonic()
    safe_s = scene.devices.until_safe(plugged_s)
    assert scene.devices.settings_since(plugged_s)[0].voltage_v == 0.0, "the first word was not safe"
    scene.gateway.wait_until(lambda _: not scene.gateway.write(0, 2, 0).isError(), within_s=5.0)
    scene.gateway.wait_until(lambda status: status["state"] == OFF)
    return safe_s, time.monotonic() - plugged_s
