"""The residual watch beside a running gateway: a process that nobody feels, and that names what has changed in the machine."""

import contextlib
import json
import os
import random
import signal
import socket
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import psutil
import pytest

from gateway.codes.warning_bits import WarningBit
from gateway.processes.scheduling.scheduler_counters import SchedulerCounters
from gateway.profiles import shipped_profiles_folder
from gateway.registers.residual_cause import ResidualCause
from tests.end_to_end.conftest import RunningGateway, start, stop
from tests.end_to_end.test_lean_processes import until_behind

WARNING_WORD, RESIDUAL_CAUSE = 111, 129
LOOP_HZ = 100.0


def ask(path: Path, request: dict[str, Any]) -> dict[str, Any]:
    with socket.socket(socket.AF_UNIX) as client:
        client.connect(str(path))
        client.sendall(json.dumps(request).encode() + b"\n")
        answer: dict[str, Any] = json.loads(client.recv(65536))
    assert answer["ok"], answer
    return answer


def health(running: RunningGateway) -> dict[str, Any]:
    return ask(running.state / "control.sock", {"do": "health"})


def shown(running: RunningGateway) -> tuple[bool, ResidualCause]:
    """The warning bit and the register, as a master reads them."""
    bit = bool(running.words(WARNING_WORD, 1)[0] & WarningBit.MODEL_DIFFERS)
    return bit, ResidualCause(running.words(RESIDUAL_CAUSE, 1)[0])


def watched_rig(directory: Path, watch: str) -> Path:
    """The demo rig with other settings of its watch."""
    rig = directory / "watched.yaml"
    text = (
        (shipped_profiles_folder() / "rigs" / "demo.yaml")
        .read_text(encoding="utf-8")
        .replace("name: demo", "name: watched")
    )
    rig.write_text(text + f"\nresidual_watch: {watch}\n", encoding="utf-8")
    return rig


@pytest.fixture(scope="module")
def watched_gateway(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningGateway]:
    """A watch that looks often at little."""
    folder = tmp_path_factory.mktemp("watched")
    gateway = start(folder / "state", "--sim", rig=str(watched_rig(folder, "{window_s: 5, every_s: 1}")))
    hurry(gateway.ready["pids"]["watch"])
    yield gateway
    stop(gateway)


def hurry(watch: int) -> None:
    """Let a watch run that a test waits for: other workers leave nothing to the idle class for half a minute. Only root may."""
    until_behind(watch)
    with contextlib.suppress(PermissionError):
        os.sched_setscheduler(watch, os.SCHED_OTHER, os.sched_param(0))
        os.setpriority(os.PRIO_PROCESS, watch, 0)
        Path(f"/proc/{watch}/autogroup").write_text("0")


@pytest.fixture
def watched(watched_gateway: RunningGateway) -> RunningGateway:
    watched_gateway.rest()
    return watched_gateway


def test_it_looks_says_so_and_leaves_an_idle_machine_alone(watched):
    deadline_s = time.monotonic() + 60.0
    while (figures := health(watched)["residual"]).get("looks", 0) < 2:
        assert time.monotonic() < deadline_s, watched.log.read_text()
        time.sleep(0.2)
    assert figures["cause"] == 0
    assert figures["judged"] == 0
    assert shown(watched) == (False, ResidualCause.NONE)


def test_a_control_that_is_killed_writes_on_in_the_same_ring_and_the_watch_stays(watched):
    watch = watched.ready["pids"]["watch"]
    os.kill(watched.ready["pids"]["control"], signal.SIGKILL)
    assert watched.next_ready()["pids"]["watch"] == watch
    deadline_s = time.monotonic() + 60.0
    while health(watched)["residual"].get("looks", 0) < 1:
        assert time.monotonic() < deadline_s
        time.sleep(0.2)


def test_a_dead_watch_is_started_again_and_control_does_not_notice(watched):
    watched.write(0, 1, 1500)
    watched.wait_until(lambda status: status["state"] == 3)
    missed, guardian = missed_of_its_own(watched), psutil.Process(watched.process.pid)
    (watch,) = watches_of(guardian)  # another one than at the start where this is tried again
    watch.send_signal(signal.SIGKILL)
    watched.said("A346 the residual watch ended (SIGKILL): it is started again in 5 s")
    assert watched.status()["state"] == 3
    deadline_s = time.monotonic() + 20.0
    while not [one for one in watches_of(guardian) if one != watch]:
        assert time.monotonic() < deadline_s
        time.sleep(0.1)
    assert watched.status()["state"] == 3
    assert missed_of_its_own(watched) - missed < 20


def missed_of_its_own(running: RunningGateway) -> float:
    """Ticks that control has missed, without those for which it waited for a processor: other tests, browsers among them, run
    beside this one. That the watch takes none from it is asked above, by its priority."""
    counters = SchedulerCounters(running.ready["pids"]["control"])
    waited_s = counters.waited_s() or 0.0
    counters.close()
    return float(health(running)["missed_ticks"]) - LOOP_HZ * waited_s


def watches_of(guardian):
    return [child for child in guardian.children() if "watch_process" in " ".join(child.cmdline())]


def test_a_rig_that_wants_no_watch_gets_none(tmp_path):
    gateway = start(tmp_path / "state", "--sim", rig=str(watched_rig(tmp_path, "{enabled: false}")))
    try:
        assert "watch" not in gateway.ready["pids"]
        assert health(gateway)["residual"]["age_s"] is None
    finally:
        stop(gateway)


CHANGES = {
    ResidualCause.NONE: {},
    ResidualCause.COULOMB_FRICTION: {"friction.coulomb_n": 2.5},
    ResidualCause.TRANSPORT_DELAY: {"regulator.delay_s": 0.14},
    ResidualCause.LINEAR_DRIFT: {"cell.drift_n_per_s": 0.1},
}


@pytest.mark.long
@pytest.mark.parametrize("cause", CHANGES)
def test_a_machine_that_changes_while_it_works_is_named(tmp_path, cause):
    """The whole way: twin, wires, control, ring, search, control socket, registers. Nothing rises before the change."""
    rig = watched_rig(tmp_path, "{window_s: 30, every_s: 10}")
    gateway = start(tmp_path / "state", "--sim", rig=str(rig))
    draw = random.Random(43)
    try:
        work(gateway, draw, lambda: health(gateway)["residual"].get("judged", 0) >= 1, within_s=300.0)
        work(gateway, draw, lambda: False, within_s=40.0)
        assert shown(gateway) == (False, ResidualCause.NONE)
        if CHANGES[cause]:
            ask(gateway.state / "rig.sock", {"do": "fault", "name": "plant", "values": CHANGES[cause]})
        work(gateway, draw, lambda: bool(CHANGES[cause]) and is_named(gateway, cause), within_s=300.0)
        assert shown(gateway)[0] == bool(CHANGES[cause]), health(gateway)
        assert is_named(gateway, cause), health(gateway)
    finally:
        stop(gateway)


def is_named(gateway: RunningGateway, cause: ResidualCause) -> bool:
    """By the register, or as one of the group that such a run cannot tell apart."""
    bit, named = shown(gateway)
    sentence = ask(gateway.state / "control.sock", {"do": "residual"})["sentence"]
    return named is cause or (bit and named is not ResidualCause.UNKNOWN and cause.effect in sentence)


def work(gateway: RunningGateway, draw: random.Random, is_done: Any, within_s: float) -> None:
    """Random setpoints until it is done, or the time is up (what follows will tell). A machine that is busy with other
    things may stall the loop for longer than the rig allows; then the fault is reset, as a master would."""
    deadline_s = time.monotonic() + within_s
    while time.monotonic() < deadline_s and not is_done():
        if gateway.status()["state"] == 4:
            gateway.write(0, 0, 0)
            gateway.write(0, 2, 0)
            gateway.write(0, 0, 0)
            time.sleep(0.2)
        gateway.write(0, 1, draw.randrange(400, 4000))
        time.sleep(1.0)
