"""The loop never waits for the disk, and the controller never jumps."""

import asyncio
import threading
from itertools import pairwise
from pathlib import Path

from gateway.calibrations.activation import ActiveCalibration
from gateway.control import CalibrationInUse
from gateway.processes.disk_worker import DiskWorker
from gateway.registers.upload.coefficients import CoefficientSet
from gateway.registers.words import CommitStatus
from tests.calibrations.coefficients import calibration, staged
from tests.calibrations.failing_disk import disk
from tests.calibrations.upload_bench import Bench
from tests.control.bench import Bench as ControlBench
from tests.control.bench import settings
from tests.disk.threads import join_disk_threads


def in_use(active: ActiveCalibration) -> CalibrationInUse:
    return CalibrationInUse(active.model, active.calibration.number)


def test_the_loop_goes_on_while_the_disk_takes_its_time(bench: Bench):
    go, waiting, loop_thread = threading.Event(), threading.Event(), threading.get_ident()

    def slow(name: str) -> None:
        assert threading.get_ident() != loop_thread
        waiting.set()
        assert go.wait(10)

    async def upload() -> list[CommitStatus]:
        bench.upload.run_in_background = apart = DiskWorker()
        seen: list[CommitStatus] = []
        with disk() as there:
            there.before_fsync = slow
            bench.stage(staged(CoefficientSet.of_calibration(calibration(16))))
            bench.write(1145, 1)
            for _ in range(1000):
                await asyncio.sleep(0)
                seen.append(bench.status)
                if waiting.is_set() and len(seen) > 100:
                    break
                await asyncio.sleep(0.001 if not waiting.is_set() else 0)
            go.set()
            while bench.status is CommitStatus.WRITING:
                await asyncio.sleep(0.001)
        apart.close()
        return [*seen, bench.status]

    seen = asyncio.run(upload())
    assert list(dict.fromkeys(seen)) in (
        [CommitStatus.CHECKING, CommitStatus.WRITING, CommitStatus.COMMITTED],
        [CommitStatus.WRITING, CommitStatus.COMMITTED],
    )
    assert len(seen) > 100


def test_an_upload_that_no_thread_can_be_had_for_fails_and_the_next_one_does_not(bench: Bench, monkeypatch):
    """A container with few processes, or no memory: it must neither end control nor keep others out."""

    def refuse(thread: threading.Thread) -> None:
        raise RuntimeError("can't start new thread")

    async def upload() -> CommitStatus:
        bench.write(1145, 1)
        while bench.status in (CommitStatus.CHECKING, CommitStatus.WRITING):
            await asyncio.sleep(0.001)
        return bench.status

    async def main() -> None:
        bench.upload.run_in_background = apart = DiskWorker()
        bench.stage(staged(CoefficientSet.of_calibration(calibration(16))))
        with monkeypatch.context() as patch:
            patch.setattr(threading.Thread, "start", refuse)
            assert await upload() is CommitStatus.FAILED
        assert bench.log[-1].startswith("E431 no thread for the disk")
        assert await upload() is CommitStatus.COMMITTED
        apart.close()

    asyncio.run(main())


def test_what_the_disk_does_not_give_is_told_with_its_place(bench: Bench):
    bench.upload.run_in_background = lambda work, done: done(
        PermissionError(13, "Permission denied", "/cell/calibrations")
    )
    bench.upload.use(2)
    assert bench.upload.status()["said"].startswith("E431 /cell/calibrations: Permission denied; active set")


def test_a_loop_that_ends_before_the_disk_is_ready_leaves_the_old_set_or_the_new_one(bench: Bench):
    join_disk_threads()  # those of the tests before
    go = threading.Event()

    async def begin() -> None:
        bench.upload.run_in_background = apart = DiskWorker()
        bench.upload.use(2)
        apart.close()

    bench.upload_of(calibration(5))
    bench.upload_of(calibration(6))
    with disk() as there:
        there.before_fsync = lambda name: go.wait(10)
        asyncio.run(begin())
        go.set()
        assert join_disk_threads() == 1
    assert bench.restarted().upload.status()["active"] == 2


def test_a_swap_while_pressing_moves_the_voltage_no_faster_than_the_slew_limit(tmp_path: Path, register_map):
    """The controller as the cell wires it: on_use goes to Controller.use, in every state of a stroke."""
    slew_v_per_s, tick_s = settings().limits.voltage_slew_v_per_s, 0.01
    for moment_ms in (0, 3, 10, 40, 110, 250, 600, 1500):
        service = Bench(tmp_path / str(moment_ms), register_map)
        control = ControlBench()
        service.upload.on_use = lambda taken, control=control: control.controller.use(in_use(taken))
        control.run(0.2)
        control.enable(20.0)
        control.run(moment_ms / 1000)
        before_v = control.voltage_v
        assert service.upload_of(calibration(60))[0] is CommitStatus.COMMITTED
        after_v = control.step().voltage_v
        bump_v = abs(after_v - before_v)
        assert bump_v <= slew_v_per_s * tick_s
        if moment_ms >= 600:
            assert bump_v < 0.005, "settled: no more than the trim moves in a step"
        start = len(control.history)
        control.run(2.0)
        steps = list(control.voltages())[start - 1 :]
        for (earlier_s, low_v), (later_s, high_v) in pairwise(steps):
            assert high_v - low_v <= slew_v_per_s * (later_s - earlier_s + tick_s) + 1e-9
            assert low_v - high_v <= slew_v_per_s * (later_s - earlier_s + tick_s) + 1e-9, "falling as well"
        assert control.controller.calibration_id == 2
        assert abs(control.plant.force_n - 20.0) < 1.0


def test_committing_the_read_back_while_pressing_leaves_every_later_voltage_as_it_would_have_been(
    tmp_path, register_map
):
    """With slip stops, whose memory no share tells whole: reversals after the commit would show a lost one."""
    own = calibration(8, number=1, slip_radii_v=(0.4, 0.8, 1.5), slip_shares=(0.5, 0.25, 0.25))

    def voltages(commits: bool) -> list[float]:
        service = Bench(tmp_path / str(commits), register_map, own)
        control = ControlBench()
        control.controller.use(CalibrationInUse(own.model(), 1))
        service.upload.on_use = lambda taken: control.controller.use(in_use(taken))
        control.run(0.2)
        control.enable(30.0)
        control.run(1.0)
        for force_n in (18.0, 24.0, 12.0, 21.0):
            control.force(force_n)
            control.run(0.3)
            if commits:
                assert service.upload_of(own, 3)[0] is CommitStatus.COMMITTED
        assert control.controller.calibration_id == 1
        return [voltage_v for _, voltage_v in control.voltages()]

    assert voltages(commits=True) == voltages(commits=False)


def test_a_swap_leaves_a_voltage_that_is_driven_directly_alone(bench: Bench):
    control = ControlBench()
    bench.upload.on_use = lambda taken: control.controller.use(in_use(taken))
    control.run(0.2)
    control.voltage(3.0)
    control.run(1.0)
    assert bench.upload_of(calibration(60))[0] is CommitStatus.COMMITTED
    control.run(0.5)
    assert {voltage_v for time_s, voltage_v in control.voltages() if time_s > 0.9} == {3.0}


def test_a_service_that_is_closed_begins_nothing_more_and_says_so(bench: Bench) -> None:
    """Its thread would hold the process, and the folder, beyond the end."""

    async def upload() -> None:
        bench.upload.run_in_background = bench.upload._thread
        bench.upload.close()
        bench.stage(staged(CoefficientSet.of_calibration(calibration(16))))
        bench.write(1145, 1)
        while bench.upload.status()["busy"]:
            await asyncio.sleep(0)

    asyncio.run(asyncio.wait_for(upload(), 5.0))
    assert bench.upload.status()["failed"] and bench.log[-1].startswith("E431 no thread for the disk")
    assert bench.store.list() == []
