"""An experiment: its moves become the voltages that it says, within the rig's limits, under the same supervision."""

from dataclasses import replace

import pytest

from gateway.codes.faults import FaultCode
from gateway.control.runs import experiment_schedule
from gateway.control.runs.experiment_plan import ExperimentPlan, Move, MoveKind, Part, plan_faults
from gateway.control.runs.experiment_run import ExperimentRun
from gateway.control.runs.experiment_schedule import Schedule, schedule_of, segments_of
from gateway.control.runs.ladder_stairs import highest_voltage_v
from gateway.registers.words import CalibrationPhase, State
from tests.control.bench import Bench, bsfm, settings

LIMITS = settings().limits
TOP_V = highest_voltage_v(LIMITS, bsfm())


def plan(*moves: Move, check: bool = False) -> ExperimentPlan:
    return ExperimentPlan(name="a plan", check=check, parts=(Part(name="one", moves=moves),))


def schedule(*moves: Move) -> Schedule:
    return Schedule(segments_of(plan(*moves), LIMITS, bsfm()), 0.0)


SHORT = plan(
    Move(do=MoveKind.STEP, to_v=3.0, hold_s=0.5),
    Move(do=MoveKind.RAMP, to_v=5.0, over_s=1.0, hold_s=0.3),
    Move(do=MoveKind.LADDER, to_v=4.0, stairs=4, hold_s=0.2),
    Move(do=MoveKind.REVERSALS, size_v=1.0, times=2, over_s=0.4, hold_s=0.1),
)


def test_a_plan_that_stays_at_rest_has_no_stairs_to_check() -> None:
    """Ten of them at the safe voltage would show nothing, and take their time."""
    rests = ExperimentRun(plan(Move(do=MoveKind.DWELL, hold_s=1.0), check=True), settings(), bsfm(), 0.0)
    moves = ExperimentRun(plan(Move(do=MoveKind.STEP, to_v=3.0, hold_s=1.0), check=True), settings(), bsfm(), 0.0)
    assert rests.eta_s < 3.0 < moves.eta_s


def test_moves_put_out_what_they_say() -> None:
    moved = Schedule(segments_of(SHORT, LIMITS, bsfm()), 0.0)
    volts = [moved.voltage_v(at_s) for at_s in (0.0, 0.49, 1.0, 1.6, 1.85, 2.45, 2.7, 2.85)]
    assert volts == pytest.approx([3.0, 3.0, 4.0, 5.0, 4.75, 4.0, 4.25, 4.5])
    assert moved.voltage_v(moved.duration_s + 1.0) == 4.0
    assert [moved.direction(at_s) for at_s in (0.1, 1.0, 2.0, 2.7, 3.0)] == [1, 1, -1, 1, -1]


def test_the_time_of_a_plan_is_known_without_a_rig() -> None:
    assert Schedule(segments_of(SHORT, LIMITS, bsfm()), 0.0).duration_s == pytest.approx(SHORT.duration_s)


def test_a_dwell_stays_where_the_move_before_has_ended() -> None:
    moved = schedule(Move(do=MoveKind.STEP, to_share=0.5, hold_s=1.0), Move(do=MoveKind.DWELL, hold_s=2.0))
    assert moved.voltage_v(2.5) == pytest.approx(0.5 * TOP_V)


def test_a_share_is_one_of_the_voltages_between_the_least_and_the_highest() -> None:
    asked = plan(
        Move(do=MoveKind.STEP, to_share=0.5, hold_s=1.0),
        Move(do=MoveKind.REVERSALS, size_share=0.2, times=1, hold_s=1.0),
    )
    for least_v in (0.0, 1.0):
        turns = segments_of(asked, replace(LIMITS, voltage_min_v=least_v), bsfm())[1:3]
        size_v, middle_v = 0.2 * (TOP_V - least_v), least_v + 0.5 * (TOP_V - least_v)
        assert [turn.to_v for turn in turns] == pytest.approx([middle_v + size_v / 2.0, middle_v - size_v / 2.0])


def test_newtons_are_those_of_the_rising_branch() -> None:
    moved = schedule(Move(do=MoveKind.STEP, to_n=20.0, hold_s=1.0))
    assert bsfm().branches.rising.value(moved.voltage_v(0.5)) == pytest.approx(20.0)


def test_a_force_that_the_rig_presses_at_its_least_voltage_already_is_that_voltage() -> None:
    asked = plan(Move(do=MoveKind.STEP, to_n=1.0, hold_s=1.0))
    assert segments_of(asked, replace(LIMITS, voltage_min_v=1.0), bsfm())[-1].to_v == 1.0


@pytest.mark.parametrize(
    ("moves", "sentence"),
    [
        ((Move(do=MoveKind.STEP, to_v=9.5),), "move 1 (step): 9.5 V, allowed 0 .. 6.98 V (about 0 .. 49 N)"),
        ((Move(do=MoveKind.STEP, to_n=70.0),), "70 N, allowed up to"),
        (
            (Move(do=MoveKind.STEP, to_v=6.5), Move(do=MoveKind.REVERSALS, size_v=2.0, times=1, hold_s=1.0)),
            "2 V around 6.5 V",
        ),
        (
            (Move(do=MoveKind.STEP, to_v=0.2), Move(do=MoveKind.REVERSALS, size_v=1.0, times=1, hold_s=1.0)),
            "1 V around 0.2 V",
        ),
    ],
)
def test_beyond_the_rigs_limits_a_plan_is_refused_and_never_clipped(moves: tuple[Move, ...], sentence: str) -> None:
    with pytest.raises(ValueError, match="plan a plan, part one, move") as refused:
        segments_of(plan(*moves, Move(do=MoveKind.DWELL, hold_s=1.0)), LIMITS, bsfm())
    assert sentence in str(refused.value)


@pytest.mark.parametrize(
    ("move", "key", "sentence"),
    [
        (Move(do=MoveKind.STEP), "", "needs to_share or to_n or to_v"),
        (Move(do=MoveKind.STEP, to_v=1.0, to_n=2.0, hold_s=1.0), "to_v", "to_n is given already"),
        (Move(do=MoveKind.RAMP, to_v=1.0), "", "needs over_s"),
        (Move(do=MoveKind.DWELL, hold_s=1.0, times=2), "times", "means nothing in a dwell"),
        (Move(do=MoveKind.REVERSALS, size_v=1.0, times=2), "", "take no time"),
    ],
)
def test_a_move_without_its_sense_is_told_with_its_place(move: Move, key: str, sentence: str) -> None:
    path, told = next(plan_faults(plan(move, Move(do=MoveKind.DWELL, hold_s=1.0))))
    assert path == ("parts", 0, "moves", 0, *((key,) if key else ()))
    assert sentence in told


def test_an_empty_plan_and_an_endless_one_are_refused() -> None:
    assert ("parts", 0, "moves") in dict(plan_faults(plan()))
    assert [path for path, _ in plan_faults(ExperimentPlan(name="x", parts=()))] == [("parts",)]
    endless = plan(Move(do=MoveKind.REVERSALS, size_share=0.1, times=1000, hold_s=3600.0))
    assert "allowed up to 7200 s" in next(plan_faults(endless))[1]
    assert "the parts take 0 s" in next(plan_faults(plan(Move(do=MoveKind.STEP, to_v=3.0))))[1]


def begun(bench: Bench, asked: ExperimentPlan) -> Bench:
    bench.run(0.5)
    bench.controller.active_run.ask(asked)
    bench.run(0.05)
    return bench


def test_a_run_goes_through_zero_and_check_and_then_by_the_clock_to_its_end_at_zero_volts() -> None:
    bench = begun(Bench(seed=3), ExperimentPlan(name="short", parts=SHORT.parts))
    phases, began = [], len(bench.history)
    while bench.controller.active_run.running:
        bench.run(0.01)
        phases.append(CalibrationPhase(bench.last.calibration_phase))
        assert phases[-1] is not CalibrationPhase.CHECK or bench.controller.active_run.progress == 0.0
    assert list(dict.fromkeys(phases)) == [
        CalibrationPhase.ZERO, CalibrationPhase.CHECK, CalibrationPhase.EXPERIMENT, CalibrationPhase.RECORDED,
    ]  # fmt: skip
    ran = [record for record in bench.history[began:] if record.output.calibration_phase == CalibrationPhase.EXPERIMENT]
    assert ran[-1].time_s - ran[0].time_s == pytest.approx(SHORT.duration_s, abs=0.03)
    moved = Schedule(segments_of(SHORT, LIMITS, bsfm()), 0.0)
    for record in ran:
        assert record.output.voltage_v == pytest.approx(moved.voltage_v(record.time_s - ran[0].time_s), abs=0.03) or (
            record.time_s - ran[0].time_s < 0.1  # the slew limit of the first step
        )
    assert bench.last.state is State.CALIBRATING, "the force goes to 0 along the ramp"
    bench.run(0.5)
    assert (bench.last.state, bench.last.voltage_v) == (State.OFF, 0.0)
    assert any(event.startswith("experiment short done") for event in bench.events)


def test_without_the_check_it_begins_after_the_zero() -> None:
    bench = begun(Bench(seed=4), SHORT)
    bench.run(0.9)
    assert bench.last.calibration_phase == CalibrationPhase.EXPERIMENT
    assert bench.last.voltage_v == pytest.approx(3.0)


def test_the_check_stops_an_inverted_cell_before_the_plan_begins() -> None:
    bench = begun(Bench(seed=5, sign=-1.0), ExperimentPlan(name="short", parts=SHORT.parts))
    bench.run(5.0)
    assert bench.last.fault is FaultCode.SIGN_INVERTED
    assert bench.last.voltage_v == 0.0
    assert not any(record.output.calibration_phase == CalibrationPhase.EXPERIMENT for record in bench.history)


def test_a_stop_ends_it_at_zero_volts() -> None:
    bench = begun(Bench(seed=6), SHORT)
    bench.run(1.5)
    assert bench.last.voltage_v > 2.0
    bench.controller.active_run.ask_stop("calibration stopped at this machine")
    bench.run(0.4)
    assert (bench.last.state, bench.last.voltage_v) == (State.OFF, 0.0)
    assert bench.last.calibration_phase == CalibrationPhase.STOPPED


def test_it_is_told_as_an_experiment_and_not_as_a_calibration() -> None:
    bench = begun(Bench(seed=6), SHORT)
    bench.run(0.1)
    bench.controller.stop()
    bench.run(0.4)
    assert "experiment begun by this machine" in bench.events
    assert "experiment stopped: ramping down" in bench.events
    bench.controller.active_run.ask(SHORT)
    bench.run(0.1)
    assert bench.events[-1].startswith("W305 experiment refused: ")


def test_a_silent_cell_is_a_fault_here_too() -> None:
    bench = begun(Bench(seed=7), SHORT)
    bench.run(1.5)
    bench.cell_silent = True
    bench.run(0.5)
    assert bench.last.fault is FaultCode.SAMPLE_STALE
    assert bench.last.voltage_v == 0.0


def test_a_plan_without_end_is_refused_by_the_number_of_its_turns() -> None:
    many = [Move(do=MoveKind.REVERSALS, size_v=0.1, times=1000, over_s=0.01, hold_s=0.0)] * 10
    start = Move(do=MoveKind.STEP, to_v=3.0, hold_s=0.5)
    with pytest.raises(ValueError, match="20011 stairs and turns, at most 20000"):
        segments_of(plan(start, *many), LIMITS, bsfm())


def test_turns_that_are_too_many_are_counted_and_never_made(monkeypatch: pytest.MonkeyPatch) -> None:
    """A try of such a plan, which a line may hold, stood in the loop for a second: a held force went with it."""
    many = Move(do=MoveKind.REVERSALS, size_v=0.1, times=1000, over_s=0.001)
    asked = plan(Move(do=MoveKind.STEP, to_v=3.0, hold_s=0.5), *[many] * 500)
    monkeypatch.setattr(experiment_schedule, "Segment", pytest.fail)
    with pytest.raises(ValueError, match="plan a plan: the parts have 1000501 stairs and turns, at most 20000"):
        segments_of(asked, LIMITS, bsfm())


def test_a_plan_is_counted_as_it_is_made() -> None:
    assert SHORT.segments == len(segments_of(SHORT, LIMITS, bsfm()))


def test_the_voltages_of_a_run_are_made_once_from_the_question_to_its_begin(monkeypatch: pytest.MonkeyPatch) -> None:
    made, make = [], experiment_schedule.segments_of
    monkeypatch.setattr(experiment_schedule, "segments_of", lambda *asked: made.append(asked) or make(*asked))
    schedule_of.cache_clear()
    bench = begun(Bench(seed=8), SHORT)
    assert bench.controller.active_run.running and len(made) == 1


@pytest.mark.parametrize(
    ("slew_v_per_s", "gain_n_per_v", "most_n"),
    [(2.0, 15.0, 55.0), (100.0, 9.0, 52.0)],
    ids=["the output still rises", "the force still rises"],
)
def test_behind_a_turn_of_the_plan_the_force_stays_below_the_rigs_largest_too(
    slew_v_per_s: float, gain_n_per_v: float, most_n: float
) -> None:
    """The plan went down already, so nobody looked: 76 N were pressed where the rig allows 50."""
    up, down = Move(do=MoveKind.STEP, to_v=6.5, hold_s=0.03), Move(do=MoveKind.STEP, to_v=6.0, hold_s=4.0)
    rig = settings()
    limits = replace(rig.limits, voltage_slew_v_per_s=slew_v_per_s, over_force_n=80.0)
    bench = begun(Bench(replace(rig, limits=limits), seed=9, gain_n_per_v=gain_n_per_v), plan(up, down))
    bench.run(6.0)
    assert max(record.force_n for record in bench.history) < most_n
    assert any(event.startswith("A350") for event in bench.events) and bench.last.state is State.OFF


@pytest.mark.parametrize("path", [("name",), ("parts", 0, "name"), ("columns", 0), ("by_hand", 0)])
def test_what_a_plan_is_called_writes_on_nobodys_terminal(path: tuple[str | int, ...]) -> None:
    """A colleague's file is shown before its run, and its name stands in the log."""
    texts = dict.fromkeys(("name", "part", "columns", "by_hand"), "wheel 3")
    texts["part" if path[0] == "parts" else str(path[0])] = "\x1b[2J"
    part = Part(name=texts["part"], moves=(Move(do=MoveKind.DWELL, hold_s=1.0),))
    asked = ExperimentPlan(name=texts["name"], parts=(part,), columns=(texts["columns"],), by_hand=(texts["by_hand"],))
    assert [fault[0] for fault in plan_faults(asked)] == [path]


def test_the_check_of_a_plan_begins_at_the_safe_voltage_of_the_rig() -> None:
    """From 0 V a rig that keeps its tool up with 2 V would let it down first."""
    rig = replace(settings(), limits=replace(LIMITS, safe_voltage_v=2.0, voltage_min_v=2.0))
    run = ExperimentRun(plan(Move(do=MoveKind.STEP, to_v=6.0, hold_s=1.0), check=True), rig, bsfm(), 0.0)
    assert min(stair.voltage_v for stair in run._check.stairs) == 2.0
