"""A run below the rig's largest force: which readings end it, and which it goes on with."""

from dataclasses import replace

import pytest

from gateway.bsfm import Branches, Bsfm, LinearBlend, RationalBezier
from gateway.codes.refusals import RefusalReason
from gateway.control import LineStatus
from gateway.control.runs.active_run import ActiveRun
from gateway.control.runs.ladder_run import LadderRow
from gateway.control.runs.ladder_stairs import stairs_of
from gateway.control.sample_conditioning import Reading
from tests.control.bench import Bench, bsfm, settings
from tests.control.runs.test_ladder_run import SHORT

LIMITS = replace(settings().limits, force_max_n=60.0, over_force_n=70.0)
UP_AND_DOWN = replace(SHORT, minor_points=0)
CONTROL = replace(settings(), limits=LIMITS)


class Obedient:
    """Stands for the force loop: what the run wants is put out."""

    voltage_v = 0.0

    def drive_run(self, voltage_v: float, branch_share: float) -> None:
        self.voltage_v = voltage_v


def climb(direction: float, strength: float = 1.0, before: Bsfm | None = None) -> tuple[list[LadderRow], str, float]:
    """Climb the whole ladder on a machine that presses so much stronger than the calibration says, and with the rig's largest
    force on each stair that is gone to in this direction: the rows, the sentence of the end, and the largest force.
    before: model of the calibration that was in use at first."""
    active, loop, rows, most_n = ActiveRun(CONTROL, before or bsfm()), Obedient(), list[LadderRow](), 0.0
    active.use(bsfm())
    active.begin(UP_AND_DOWN, is_local=True)
    for k in range(100_000):
        run = active.run
        assert run
        force_n = strength * run.model.force_n(loop.voltage_v, run.branch_share)
        most_n = max(most_n, force_n)
        if loop.voltage_v > 0.0 and run.branch_share == direction:
            force_n = LIMITS.force_max_n
        reading = Reading(force_n, force_n, 0.0, 0.01, True, True, True)
        ended = active.step(0.01 * k, reading, loop, LineStatus())  # type: ignore[arg-type]
        if active.last_row and active.last_row not in rows[-1:]:
            rows.append(active.last_row)
        if ended:
            return rows, ended.sentence, most_n
    raise AssertionError("the ladder never ends")


def test_the_largest_force_on_the_way_down_leaves_no_stair_out() -> None:
    """Where friction keeps it pressed, each stair below lowers it: stopping half way wins nothing, and half a loop is lost."""
    rows, end, _ = climb(-1.0)
    assert end.startswith("calibration ladder done")
    assert [row.stair for row in rows] == list(stairs_of(UP_AND_DOWN, LIMITS, bsfm()))


def test_the_largest_force_on_the_way_up_is_not_climbed_beyond() -> None:
    rows, _, _ = climb(1.0)
    assert len(rows) < len(stairs_of(UP_AND_DOWN, LIMITS, bsfm()))


@pytest.mark.parametrize("strength", [1.3, 1.7, 2.5])
def test_a_machine_that_is_stronger_than_it_was_calibrated_never_passes_the_largest_force(strength: float) -> None:
    """Not for a moment: the stair that would is left out before its voltage goes out."""
    rows, end, most_n = climb(0.0, strength)
    assert end.startswith("calibration ladder done")
    assert 0.5 * LIMITS.force_max_n < most_n <= LIMITS.force_max_n
    assert len(rows) < len(stairs_of(UP_AND_DOWN, LIMITS, bsfm()))


def test_what_keeps_a_run_below_goes_by_the_calibration_in_use_not_by_the_one_before() -> None:
    """By one that ends at 2 V nothing would rise beyond."""
    short = RationalBezier(0.0, 2.0, [0.0, 7.0, 14.0], [1.0, 1.0, 1.0])
    swapped = climb(0.0, 1.7, Bsfm(Branches(short, short), LinearBlend(6.0)))
    assert swapped == climb(0.0, 1.7) and swapped[2] <= LIMITS.force_max_n


def test_a_run_of_this_machine_takes_the_force_at_rest_as_zero_where_it_is_asked_to() -> None:
    for is_asked, zero_n in ((True, 2.0), (False, 0.0)):
        bench = Bench()
        bench.alter_sample = lambda sample: replace(sample, force_n=sample.force_n + 2.0)
        bench.run(0.5)
        bench.controller.active_run.ask(replace(SHORT, tare=is_asked))
        bench.run(0.1)
        assert bench.controller.active_run.running and bench.controller.zero_n == pytest.approx(zero_n, abs=0.15)
        assert any(event.startswith("tare") for event in bench.events) is is_asked
        assert bench.last.enable_block is RefusalReason.CALIBRATING


@pytest.mark.parametrize(("payload_n", "told_n"), [(8.0, 48.0), (-8.0, 40.0), (30.0, 60.0)])
def test_who_is_asked_before_a_run_is_told_of_the_payload_s_weight_too(payload_n: float, told_n: float) -> None:
    """What hangs below the tool presses beside the slide; what it takes away may be put down meanwhile."""
    model = bsfm()
    top_v, _ = model.voltage_v(40.0, 1.0)
    active = ActiveRun(CONTROL, model, lambda: payload_n)
    assert active.most_contact_n(top_v) == pytest.approx(told_n, abs=0.01)
