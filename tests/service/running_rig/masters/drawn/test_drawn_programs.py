"""Programs on one or two hosts, as a seed draws them: what hangs presses nothing anew, and no other is refused for long."""

from collections.abc import Callable
from typing import Any

import pytest

from gateway.modbus import Peer
from gateway.registers import Refusal
from gateway.registers.words import State
from gateway.service.running_rig.handover import Handover
from tests.control.bench import settings
from tests.service.running_rig.masters.drawn.laws import LEASE_S
from tests.service.running_rig.masters.drawn.scene import Scene
from tests.service.running_rig.simulated_rig import CALIBRATE, ENABLE, OTHER, OWNER, RESET, TAKE, TARE, SmallRig

SEEDS = (
    *(7, 44, 59, 100, 130, 171, 180, 200, 209, 211),
    *(6068, 6115, 6129, 6166, 6198, 6205, 6223, 6259, 6278),
    *(7002, 7012, 7034, 7078, 7180, 7244, 7278, 7293),
    *(20265, 20323, 20431, 46717, 48176, 48242, 55539, 56117, 59728),
)
"""What hung began so, or what went on was refused so, once."""
STEPS, CYCLE_S = 20, 0.05
PAGE, TWIN = Peer("web"), Peer(OTHER.host, OTHER.port + 1)


@pytest.mark.parametrize("first", SEEDS)
def test_what_hangs_begins_nothing_and_what_goes_on_has_its_force(first: int, budget: int) -> None:
    for seed in (first, *range(100000 + 100 * first, 100000 + 100 * first + budget - 1)):
        scene = Scene(seed)
        scene.play(STEPS)
        assert scene.rig.trace


def begun(kept: dict[str, Any] | None = None, **supervision: object) -> SmallRig:
    rig, facts = SmallRig(settings(lease_s=LEASE_S, **supervision)), {} if kept is None else kept
    Handover(dict(facts), record=False).restore_held(rig.bank, rig.now(), lambda **told: facts.update(told))
    rig.beats = False
    return rig.run(0.5)


def flow(rig: SmallRig, cycles: int, *frames: Callable[[int], Refusal | None]) -> list[list[Refusal | None]]:
    """Each cycle's answers. frames: told the number of the cycle."""
    answers = []
    for cycle in range(cycles):
        answers.append([frame(cycle) for frame in frames])
        rig.run(CYCLE_S)
    return answers


def test_behind_a_death_a_heartbeat_that_only_goes_to_and_fro_is_a_sign_of_life() -> None:
    """Its frames had brought both values when its master was lost: it was refused until it wrote 0, whatever it wrote else."""
    rig = begun({"lost_beats": {OWNER.host: [0, 1]}})
    answers = flow(rig, 6, lambda cycle: rig.answer(0, ENABLE, 1200, 0, 0, cycle % 2))
    assert answers[0][0] and rig.state in (State.RAMPING, State.HOLDING)


def test_beside_a_program_that_writes_one_of_its_two_values_a_master_that_toggles_begins_behind_a_stop() -> None:
    rig = begun()
    flow(rig, 4, lambda cycle: rig.answer(0, ENABLE, 1200, 0, 0, cycle % 2))
    rig.write(0, 0, peer=OTHER)
    flow(rig, 4, lambda _: rig.answer(4, 0, peer=OTHER), lambda cycle: rig.answer(0, ENABLE, 1200, 0, 0, cycle % 2))
    assert rig.state in (State.RAMPING, State.HOLDING)


@pytest.mark.parametrize("has_died", [False, True])
def test_a_master_takes_over_whose_heartbeat_comes_in_a_frame_that_is_refused_beside_the_owner(has_died: bool) -> None:
    """Its word without a heartbeat was refused for its last one, and the frame with its heartbeat for the owner, for good."""
    rig = begun({"lost_beats": {OTHER.host: [7]}} if has_died else None)
    if not has_died:
        rig.write(0, ENABLE | TAKE, 1200, 0, 0, 7, peer=OTHER)
    rig.write(0, ENABLE | TAKE, 800, 0, 0, 1)
    flow(
        rig,
        5,
        lambda cycle: rig.answer(4, 2 + cycle),
        lambda cycle: rig.answer(1, 1200, 0, 0, 8 + cycle, peer=OTHER),
        lambda _: rig.answer(0, ENABLE | TAKE, peer=OTHER),
    )
    assert rig.bank.owner == OTHER.host


def test_a_fault_is_reset_by_a_master_whose_heartbeat_is_refused_beside_an_owner() -> None:
    rig = SmallRig(settings(lease_s=LEASE_S)).faulted()
    rig.write(1, 500, peer=PAGE)
    flow(
        rig,
        5,
        lambda cycle: rig.answer(1, 0, 0, 0, 50 + cycle, peer=OTHER),
        lambda _: rig.answer(0, RESET | TAKE, peer=OTHER) if rig.state is State.FAULT else None,
    )
    assert rig.state is State.OFF


def test_the_0_of_a_block_counts_that_is_refused_beside_an_owner() -> None:
    """It was told to write enable as 0 once, did so, and was told so again, for as long as another one owned."""
    rig = SmallRig(settings(lease_s=LEASE_S)).faulted()
    rig.beats = False
    assert rig.answer(0, ENABLE, 1200, 0, 0, 1, peer=OTHER)
    rig.write(0, RESET, 0, 0, 0, 4711, peer=PAGE)
    rig.write(1, 500, peer=PAGE)
    assert rig.answer(0, ENABLE | TAKE, 1200, 0, 0, 2, peer=OTHER)
    rig.answer(0, 0, 0, 0, 0, 3, peer=OTHER)
    assert rig.answer(0, ENABLE | TAKE, 1200, 0, 0, 4, peer=OTHER) is None


def test_of_two_programs_that_hung_on_one_host_one_does_not_press_behind_the_other_s_0() -> None:
    """Each 0 came before the lease was over, so that no master was lost: the other one's frame enabled anew, on and on."""
    rig = begun()
    rig.write(0, ENABLE, 1200, 0, 0, 7, peer=OTHER)
    flow(
        rig,
        40,
        lambda _: rig.answer(0, 0, peer=TWIN),
        lambda _: rig.answer(0, ENABLE, peer=OTHER),
        lambda _: rig.answer(1, 1200, 0, 0, 7, peer=OTHER),
    )
    assert rig.state is State.OFF


def test_behind_a_death_a_0_beside_a_hung_program_lets_its_frame_not_begin() -> None:
    rig = begun({"lost_beats": {OTHER.host: [7]}})
    answers = flow(
        rig, 40, lambda _: rig.answer(0, 0, peer=TWIN), lambda _: rig.answer(0, ENABLE, 1200, 0, 0, 7, peer=OTHER)
    )
    assert all(refused for _, refused in answers)


def test_behind_a_0_the_frame_of_a_hung_program_that_connects_anew_is_known() -> None:
    rig = begun()
    rig.is_cell_silent = True
    rig.run(0.5)
    frames = (Peer(OTHER.host, 6000 + k) for k in range(100))
    flow(rig, 5, lambda _: rig.answer(0, ENABLE, 1200, 0, 0, 7, peer=next(frames)))
    rig.write(0, 0, peer=TWIN)
    rig.is_cell_silent = False
    rig.run(0.2)
    answers = flow(rig, 20, lambda _: rig.answer(0, ENABLE, 1200, 0, 0, 7, peer=next(frames)))
    assert all(refused for (refused,) in answers)


def test_a_tare_of_a_program_that_hung_is_taken_by_no_process_behind_it() -> None:
    kept: dict[str, Any] = {}
    rig = begun(kept)
    assert rig.answer(0, TARE, 0, 0, 0, 7, peer=OTHER) is None
    rig = begun(kept)
    answers = flow(rig, 5, lambda _: rig.answer(0, TARE, 0, 0, 0, 7, peer=OTHER))
    assert all(refused for (refused,) in answers)


@pytest.mark.parametrize("zeros", [(0, 0), (0, 0, 0), (0, 0, 0, 0, 0, 0)])
def test_a_run_of_a_program_that_hung_begins_not_anew_behind_the_zeros_of_another_one(zeros: tuple[int, ...]) -> None:
    """Each of them ended it, and the next frame began it again: a start of the ladder in each cycle."""
    rig = begun()
    answers = flow(
        rig,
        40,
        lambda _: rig.answer(*zeros, peer=OTHER),
        lambda cycle: rig.answer(0, CALIBRATE, 0, 0, 0, min(cycle, 3)),
    )
    assert [bool(refused) for _, refused in answers] == [cycle > 3 for cycle in range(40)]
    assert rig.answer(0, CALIBRATE, 0, 0, 0, 4) is None, "its program goes on"


@pytest.mark.parametrize("cycles", [40, 1])
def test_of_two_programs_on_one_host_one_that_has_just_hung_begins_nothing_behind_its_lease(cycles: int) -> None:
    """The other's 0 came within the lease, and no loss was seen: it pressed once more, and its lease began anew. Behind one
    refusal of it the next process knows of that."""
    rig = begun(kept := dict[str, Any]())
    flow(rig, 2, lambda cycle: rig.answer(0, ENABLE, 1200, 0, 0, cycle, peer=OTHER))
    rig.run(LEASE_S - 2 * CYCLE_S).write(0, 0, peer=TWIN)
    rig.run(2 * CYCLE_S)
    answers = flow(rig, cycles, lambda _: rig.answer(0, ENABLE, 1200, 0, 0, 1, peer=OTHER))
    behind = begun(kept)
    answers += flow(behind, cycles, lambda _: behind.answer(0, ENABLE, 1200, 0, 0, 1, peer=OTHER))
    assert all(refused for (refused,) in answers) and {rig.state, behind.state} == {State.OFF}


def test_who_beats_only_while_it_presses_presses_again_behind_its_own_0() -> None:
    rig = begun()
    flow(rig, 4, lambda cycle: rig.answer(0, ENABLE, 1200, 0, 0, cycle))
    rig.write(0, 0)
    rig.run(1.0).write(0, ENABLE, 1200)
    assert rig.run(CYCLE_S).state is not State.OFF


def test_a_master_that_toggles_begins_between_the_stops_of_another_one() -> None:
    """Its 0 right behind a stop was taken for the bank's own zeroing, and each second one of its heartbeats was none."""
    rig = begun()
    answers = flow(
        rig,
        8,
        lambda cycle: rig.answer(0, ENABLE, 300, 0, 0, 100 + cycle, peer=OTHER),
        lambda cycle: rig.answer(0, 0, 0, peer=OTHER),
        lambda cycle: rig.answer(4, cycle % 2),
        lambda cycle: rig.answer(0, ENABLE, 1200),
    )
    assert not any(word for *_, word in answers[2:])


@pytest.mark.parametrize("word", [CALIBRATE, ENABLE])
def test_beside_zeros_of_its_own_host_a_program_that_hung_begins_nothing_in_the_next_process(word: int) -> None:
    """Each 0 had its host missed no more: what was refused in one process, the next one took."""
    kept: dict[str, Any] = {}
    rig = begun(kept)
    rig.is_cell_silent = True
    rig.run(0.5)
    flow(rig, 10, lambda _: rig.answer(0, word, 0, 0, 0, 7, peer=OTHER), lambda _: rig.answer(0, 0, peer=TWIN))
    rig = begun(kept)
    answers = flow(rig, 10, lambda _: rig.answer(0, word, 0, 0, 0, 7, peer=OTHER))
    assert all(refused for (refused,) in answers)


def test_beside_zeros_of_its_own_host_a_tare_of_a_program_that_hung_is_taken_once() -> None:
    rig = begun()
    frame = lambda _: rig.answer(0, TARE, 0, 0, 0, 7, peer=OTHER)  # noqa: E731
    answers = flow(rig, 40, frame, lambda _: rig.answer(0, 0, peer=TWIN))
    assert [tare is None for tare, _ in answers] == [cycle == 0 for cycle in range(40)]
    rig.run(0.8)
    assert frame(0) is None, "who has written 0 and waited means it"


def test_beside_a_program_that_hung_on_its_own_host_a_living_one_presses_and_resets() -> None:
    """Its word brings no heartbeat, and that of its other frame was forgotten with each refusal of the hung one."""
    rig = SmallRig(settings(lease_s=LEASE_S)).faulted()
    rig.beats = False

    def beat(cycle: int) -> Refusal | None:
        return rig.answer(1, 0 if rig.state is State.FAULT else 900, 0, 0, cycle % 2, peer=OTHER)

    def word(_: int) -> Refusal | None:
        return rig.answer(0, RESET if rig.state is State.FAULT else ENABLE, peer=OTHER)

    answers = flow(rig, 12, lambda _: rig.answer(0, ENABLE | TAKE, 0, 0, 0, 9, peer=TWIN), word, beat)
    assert rig.state in (State.RAMPING, State.HOLDING) and not any(told for _, told, _ in answers[4:])


def test_beside_an_owner_a_tare_counts_again_whose_heartbeat_is_refused_for_that_owner() -> None:
    rig = begun()
    flow(rig, 2, lambda cycle: rig.answer(4, cycle, peer=OTHER), lambda _: rig.answer(0, TARE, peer=OTHER))
    rig.write(1, 500)
    flow(rig, 2, lambda cycle: rig.answer(4, 5 + cycle, peer=OTHER))
    assert rig.answer(0, TAKE | TARE, peer=OTHER) is None


def test_two_programs_of_one_host_tare_beside_each_other_as_often_as_their_heartbeat_moves() -> None:
    rig = begun()
    answers = flow(
        rig,
        10,
        lambda cycle: rig.answer(4, cycle, peer=TWIN),
        lambda cycle: rig.answer(0, TARE, 0, 0, 0, 100 + cycle, peer=OTHER),
        lambda _: rig.answer(0, TARE, peer=TWIN),
    )
    assert not any(refused for answer in answers[2:] for refused in answer)


@pytest.mark.parametrize("lives", [True, False])
def test_two_programs_of_one_host_tare_by_the_same_words_each_by_its_connection(lives: bool) -> None:
    """By each tare of the one the other's was taken for one that came again, in each cycle and for good."""
    rig = begun()
    answers = flow(
        rig,
        10,
        lambda cycle: rig.answer(4, 100 + cycle, peer=TWIN),
        lambda cycle: rig.answer(1, 0, 0, 0, cycle if lives else 0, peer=OTHER),
        lambda _: rig.answer(0, TARE, peer=OTHER),
        lambda _: rig.answer(0, TARE, peer=TWIN),
    )
    assert not any(refused for answer in answers[2:] for refused in answer)


def test_who_was_taken_over_from_while_its_takeover_was_refused_takes_nothing_back_when_it_hangs() -> None:
    """Of its two frames one was refused for another reason, and was no takeover: with the other one it took over."""
    rig = begun()
    force_and_beat = lambda _: rig.answer(1, 1200, 0, 0, 7, peer=OTHER)  # noqa: E731
    word = lambda _: rig.answer(0, ENABLE | TAKE, peer=OTHER)  # noqa: E731
    rig.is_cell_silent = True
    rig.run(0.5)
    flow(rig, 4, lambda cycle: rig.answer(1, 1200, 0, 0, 3 + cycle, peer=OTHER), word)
    rig.is_cell_silent = False
    flow(rig, 4, force_and_beat, word)
    rig.write(0, ENABLE | TAKE, 500, 0, 0, 4711)
    flow(rig, 4, force_and_beat, word)
    assert rig.bank.owner != OTHER.host


def test_a_fault_is_reset_by_a_master_that_toggles_and_is_refused_for_another_reason_in_each_second_cycle() -> None:
    """Of its two values the one that came beside a latched fault was not heard, and the other one was the same each time."""
    rig = SmallRig(settings(lease_s=LEASE_S)).faulted()
    rig.write(4, 0, peer=OTHER)
    rig.run(1.0).write(1, 500, peer=PAGE)
    words = ENABLE, ENABLE | TAKE, RESET, RESET | TAKE
    answers = [
        rig.run(CYCLE_S).answer(0, word, 0, 0, 0, 1 - cycle % 2, 0, peer=OTHER)
        for cycle, word in enumerate((*words, *words[:2], *words[:2], *words))
        if rig.state is State.FAULT
    ]
    assert rig.state is State.OFF, answers
