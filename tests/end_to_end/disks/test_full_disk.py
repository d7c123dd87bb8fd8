"""A real disk that is full, or turns read-only, under a real gateway: the force is held, it is said, and all comes back."""

import os
import signal
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from gateway.audit.audit_reader import read_audit, verify_audit
from gateway.cli.control_socket import ask
from gateway.cli.errors import CliError
from gateway.profiles import load_calibration
from gateway.recording import list_recordings
from gateway.registers.upload.coefficients import CoefficientSet, words_of_block
from tests.calibrations.coefficients import staged
from tests.end_to_end.conftest import RunningGateway, start, stop
from tests.end_to_end.disks.small_disks import FailingExt4, fill, small_disk
from tests.end_to_end.kills.test_upload_kill import active_set, stage

pytestmark = pytest.mark.long  # the same laws at every single call, in virtual time: tests/disk
HELD_N, IN_BAND_N = 15.0, 1.0
OFF, HOLDING, COMMITTED, FAILED, NOT_STORED = 0, 3, 3, 4, 25
AGAIN_S = 8.0
"""The audit tries again after five seconds."""


def set_of(mark: int) -> bytes:
    """Words of a set that is nearly the rig's own, and none of the others."""
    demo = load_calibration("demo")
    low_n, middle_n, high_n = demo.rising_handles_n
    fresh = replace(demo, rising_handles_n=(low_n, (1 + 0.002 * mark) * middle_n, high_n))
    return staged(CoefficientSet.of_calibration(fresh), slot=mark)


def sent(mark: int) -> bytes:
    return words_of_block(set_of(mark))


def hold(gateway: RunningGateway) -> None:
    gateway.wait_until(lambda status: abs(status["force_measured"]) < 200 and bool(status["status_word"] & 2))
    assert not gateway.write(0, 1, round(100 * HELD_N)).isError()
    gateway.wait_until(lambda status: status["state"] == HOLDING, 8.0)


def is_held(gateway: RunningGateway, for_s: float = 0.5) -> None:
    end_s = time.monotonic() + for_s
    while time.monotonic() < end_s:
        assert abs(gateway.force_n() - HELD_N) <= IN_BAND_N
        assert gateway.status()["state"] == HOLDING
        time.sleep(0.02)


def refused(act: Callable[[], Any]) -> str:
    with pytest.raises(CliError) as caught:
        act()
    return str(caught.value)


def commit(gateway: RunningGateway, mark: int) -> list[int]:
    """Upload a set; commit_status, failing_index and reason when it is through."""
    stage(gateway, set_of(mark))
    assert not gateway.write(1145, 1).isError()
    deadline_s = time.monotonic() + 5.0
    while gateway.words(1146, 1)[0] not in (COMMITTED, FAILED):
        assert time.monotonic() < deadline_s
        time.sleep(0.02)
    return gateway.words(1146, 3)


def works_again(gateway: RunningGateway, recordings: int) -> None:
    """Everything that is stored is stored, and what waited in memory is."""
    gateway.said("A351 the audit is stored again", AGAIN_S)
    assert commit(gateway, 2)[0] == COMMITTED
    assert active_set(gateway) == sent(2)
    is_held(gateway)
    ask(gateway.state, {"do": "record", "on": True})
    time.sleep(0.4)
    assert ask(gateway.state, {"do": "record", "on": False})["rows"] > 10
    entries = list_recordings(gateway.state)
    assert [entry.fault for entry in entries] == [""] * recordings
    assert "not kept before this one" in (gateway.state / "events.jsonl").read_text()


def judge_audit(state: Path) -> None:
    assert verify_audit(state).broken is None
    what = [record["what"] for record in read_audit(state)]
    assert what.count("commit") >= 2 or what.count("calibration in use") >= 1, what


def test_a_full_disk_is_said_and_the_force_held_until_there_is_room(tmp_path: Path) -> None:
    with small_disk(tmp_path / "disk") as disk:
        gateway = start(disk, "--sim")
        try:
            hold(gateway)
            ask(gateway.state, {"do": "record", "on": True})
            time.sleep(0.3)
            ballast = fill(disk)
            gateway.said("E402")
            is_held(gateway)
            before = active_set(gateway)
            status, _, reason = commit(gateway, 1)
            assert (status, reason, active_set(gateway)) == (FAILED, NOT_STORED, before)
            fill_last_pages(gateway)
            is_held(gateway)
            kill_and_return(gateway)
            hold(gateway)
            ballast.unlink()
            works_again(gateway, recordings=2)
        finally:
            stop(gateway)
        judge_audit(gateway.state)


def fill_last_pages(gateway: RunningGateway) -> None:
    """Ask for what is refused, and audited, until what is left of the files' last pages is full, too."""
    deadline_s = time.monotonic() + 20.0
    while time.monotonic() < deadline_s:
        assert "No space left" in refused(lambda: ask(gateway.state, {"do": "record", "on": True}))
        said = gateway.log.read_text()
        if "A351" in said and "E150" in said:
            return
        assert gateway.write(1, 9000).isError()
        time.sleep(0.05)
    raise AssertionError("neither audit nor events have said that they are not stored")


def kill_and_return(gateway: RunningGateway) -> None:
    """Control dies on the full disk: another one answers as soon as ever."""
    began_s = time.monotonic()
    os.kill(gateway.ready["pids"]["control"], signal.SIGKILL)
    gateway.next_ready()
    gateway.client.close()
    assert gateway.client.connect()
    gateway.wait_until(lambda status: status["state"] == OFF)
    print(f"answers {time.monotonic() - began_s:.2f} s after a kill on a disk that takes nothing")
    assert time.monotonic() - began_s < 2.0
    gateway.wait_until(lambda status: bool(status["status_word"] & 2))


def test_a_disk_that_turns_read_only_is_said_and_the_force_held(tmp_path: Path) -> None:
    """For good: only another mount makes such a disk well; the gateway that is started then goes on with what was stored."""
    ext4 = FailingExt4(tmp_path / "image")
    with ext4.mounted(tmp_path / "disk") as disk:
        gateway = start(disk, "--sim")
        try:
            assert commit(gateway, 3)[0] == COMMITTED
            hold(gateway)
            ask(gateway.state, {"do": "record", "on": True})
            time.sleep(0.3)
            ext4.break_under(disk)
            gateway.said("E402")
            is_held(gateway)
            assert commit(gateway, 4)[0] == FAILED
            assert active_set(gateway) == sent(3)
            gateway.said("A351")
            gateway.said("E150")
            assert "Read-only" in refused(lambda: ask(gateway.state, {"do": "record", "on": True}))
            kill_and_return(gateway)
            assert active_set(gateway) == sent(3), "what was stored is read"
            hold(gateway)
            is_held(gateway)
        finally:
            stop(gateway)
        assert gateway.process.returncode == 0
        again = start(disk, "--sim")
        try:
            assert active_set(again) == sent(3)
            hold(again)
        finally:
            stop(again)
