"""kill -9 at any point of a commit: the old set or the new one is in use, never a mixture, and what was acknowledged stays."""

import contextlib
import os
import signal
import struct
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from itertools import count
from pathlib import Path
from random import Random

import psutil
import pytest

from gateway.calibrations.store import CalibrationStore
from gateway.profiles import load_calibration
from gateway.registers.upload.coefficients import CoefficientSet, words_of_block
from tests.calibrations.coefficients import calibration, mark_of, requests_of, staged
from tests.calibrations.slots import slot_number
from tests.end_to_end.conftest import POLL_S, RunningGateway, start, stop

KILLS, KILLS_LONG = 50, 2000
PER_STATE = 25
COMMITTED = 3
RAMPING, HOLDING = 2, 3


class Uploads:
    def __init__(self, process: "subprocess.Popen[str]") -> None:
        self._process = process

    def start(self, *words: object) -> int:
        """A child's process id."""
        assert self._process.stdin
        self._process.stdin.write(" ".join(map(str, words)) + "\n")
        self._process.stdin.flush()
        return int(self.line().removeprefix("child "))

    def line(self) -> str:
        assert self._process.stdout
        return self._process.stdout.readline().strip()

    def until_gone(self) -> list[int]:
        """Marks of commits that have returned."""
        lines = list(iter(self.line, "gone"))
        return [int(line) for line in lines]


@pytest.fixture
def uploads() -> Iterator[Uploads]:
    root = Path(__file__).parents[3]
    process = subprocess.Popen(
        [sys.executable, "-m", "tests.end_to_end.kills.commit_forks"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        cwd=root,
    )
    with process:
        yield Uploads(process)
        assert process.stdin
        process.stdin.close()
        assert process.wait(10) == 0


def active_mark(state: Path) -> int:
    """The mark in use; everything in the store is whole, and every part of a calibration is of one mark."""
    store = CalibrationStore(state)
    assert not [entry.fault for entry in store.list() if entry.fault]
    selected = store.find_selected()
    assert selected.notes == ()
    assert selected.document is not None
    mark = mark_of(selected.document)
    assert selected.selection.slot == mark % 8
    assert slot_number(store, mark % 8) == selected.selection.number
    return mark


def test_killed_at_every_call_of_a_commit(uploads: Uploads, tmp_path: Path):
    for n in count(1):
        state = tmp_path / str(n)
        store = CalibrationStore(state)
        store.use(store.add(calibration(1)), 1)
        uploads.start(state, 2, n)
        if uploads.until_gone() == [2]:
            assert active_mark(state) == 2
            break
        assert active_mark(state) in (1, 2)
        store.use(store.add(calibration(3)), 3)
        assert active_mark(state) == 3
    print(f"killed at each of {n - 1} calls")
    assert n > 14


def test_killed_at_any_time_in_a_row_of_commits(uploads: Uploads, tmp_path: Path, budget: int):
    seed = int.from_bytes(os.urandom(4), "big")
    print(f"seed {seed}")
    rng = Random(seed)
    commits, unsaid, mark, began_s = 0, 0, 0, time.monotonic()
    kills = KILLS_LONG if budget > 1 else KILLS
    for kill in range(kills):
        state = tmp_path / str(kill // PER_STATE)
        mark = mark + 1 if kill % PER_STATE else 1
        pid = uploads.start(state, mark)
        first = int(uploads.line())
        time.sleep(rng.uniform(0.0, 0.02))
        os.kill(pid, signal.SIGKILL)
        said = [first, *uploads.until_gone()]
        assert said == list(range(mark, mark + len(said)))
        mark = active_mark(state)
        assert mark in (said[-1], said[-1] + 1), f"kill {kill}: {said[-1]} was acknowledged, {mark} is in use"
        commits += len(said)
        unsaid += mark == said[-1] + 1
    spent_s = time.monotonic() - began_s
    print(f"{kills} kills in {commits} commits, 0 torn, {unsaid} done but not yet said; {spent_s:.1f} s")


# -- the whole gateway


def control_process(gateway: RunningGateway) -> psutil.Process:
    for child in psutil.Process(gateway.process.pid).children():
        with contextlib.suppress(psutil.NoSuchProcess):
            if "gateway.service.control_process" in child.cmdline():
                return child
    raise AssertionError("there is no control process")


def words_of(mark: int) -> bytes:
    return staged(CoefficientSet.of_calibration(calibration(mark)), slot=mark % 8)


def sent(mark: int) -> bytes:
    return words_of_block(words_of(mark))


def stage(gateway: RunningGateway, block: bytes) -> None:
    for address, part in requests_of(block, 100):
        assert not gateway.write(address, *struct.unpack(f">{len(part) // 2}H", part)).isError()


def active_set(gateway: RunningGateway) -> bytes:
    return words_of_block(struct.pack(">200H", *gateway.words(1500, 100), *gateway.words(1600, 100)))


def await_commit(gateway: RunningGateway) -> None:
    deadline_s = time.monotonic() + 5.0
    while gateway.words(1146, 1)[0] != COMMITTED:
        assert time.monotonic() < deadline_s
        time.sleep(POLL_S)


def kill_all(gateway: RunningGateway) -> None:
    processes = [*psutil.Process(gateway.process.pid).children(recursive=True), psutil.Process(gateway.process.pid)]
    for process in processes:
        process.kill()
    stop(gateway)
    assert not psutil.wait_procs(processes, timeout=10)[1]


def reconnect(gateway: RunningGateway) -> None:
    deadline_s = time.monotonic() + 20.0
    while True:
        gateway.client.close()
        try:
            assert gateway.client.connect()
            gateway.status()
            return
        except Exception:
            assert time.monotonic() < deadline_s
            time.sleep(0.02)


def test_the_gateway_killed_in_a_commit_comes_back_with_the_old_set_or_the_new_one(tmp_path: Path, budget: int):
    """Three kills of the control process for each gateway, for the guardian gives up after five; then one of them all."""
    seed = int.from_bytes(os.urandom(4), "big")
    print(f"seed {seed}")
    rng = Random(seed)
    mark, seen = 1, {"old": 0, "new": 0}
    gateway = start(tmp_path / "state", "--sim")
    try:
        stage(gateway, words_of(mark))
        gateway.write(1145, 1)
        await_commit(gateway)
        for _ in range(max(1, budget // 4)):
            for _ in range(3):
                stage(gateway, words_of(mark + 1))
                control = control_process(gateway)
                gateway.write(1145, 1)
                time.sleep(rng.uniform(0.0, 0.012))
                control.kill()
                reconnect(gateway)
                found = active_set(gateway)
                assert found in (sent(mark), sent(mark + 1))
                is_new = found == sent(mark + 1)
                seen["new" if is_new else "old"] += 1
                mark += is_new
                assert gateway.words(1644, 1) == [mark % 8]
                assert gateway.status()["state"] == 0
            kill_all(gateway)
            gateway = start(tmp_path / "state", "--sim")
            assert active_set(gateway) == sent(mark)
    finally:
        stop(gateway)
    print(f"after the kills {seen}")


def test_a_commit_while_pressing_makes_no_bump(running: RunningGateway):
    demo = load_calibration("demo")
    low_n, middle_n, high_n = demo.rising_handles_n
    better = replace(demo, rising_handles_n=(low_n, 1.05 * middle_n, high_n))
    words = staged(CoefficientSet.of_calibration(better), slot=7)
    running.write(0, 1, 2000)
    stands_mv, since_s = 0, time.monotonic()

    def is_steady(status: dict[str, int]) -> bool:
        """Held, and the trim has done its work: what moves afterwards is the commit's doing."""
        nonlocal stands_mv, since_s
        if abs(status["output_voltage"] - stands_mv) > 15:
            stands_mv, since_s = status["output_voltage"], time.monotonic()
        return status["state"] == HOLDING and time.monotonic() - since_s >= 0.6

    running.wait_until(is_steady, 10.0)
    own, block = running.words(414, 2), struct.pack(">200H", *running.words(1500, 100), *running.words(1600, 100))
    stage(running, block[:288] + struct.pack(">H", 7) + block[290:])
    running.write(1145, 1)
    await_commit(running)
    facts = [running.words(address, count) for address, count in ((122, 1), (414, 2), (1644, 1))]
    assert facts == [[1], own, [7]], "the read-back of the shipped set is the shipped set"
    stage(running, words)
    since_s = time.monotonic()
    before = running.wait_until(is_steady, 10.0)
    running.write(1145, 1)
    await_commit(running)
    assert running.words(122, 1) == [2], "the new number is there with the word committed"
    assert (active_set(running), running.words(1644, 1)) == (words_of_block(words), [7])
    bump_mv = abs(running.status()["output_voltage"] - before["output_voltage"])
    assert bump_mv <= 30
    worst, deadline_s = 0, time.monotonic() + 2.0
    while time.monotonic() < deadline_s:
        time.sleep(POLL_S)
        status = running.status()
        assert status["state"] in (RAMPING, HOLDING)
        worst = max(worst, abs(status["force_measured"] - 2000))
    print(f"bump {bump_mv} mV, worst error in the 2 s after it {worst / 100:.2f} N")
    assert worst <= 150
