"""Behind an end without a word, a power cut say, nobody knows whose program had hung: nothing is held for one whose last frame
flows on. Who lives presses with its first frame, and is held for."""

from dataclasses import replace

import pytest

from gateway.control import LeaseAction
from gateway.registers.words import State
from tests.control.bench import settings
from tests.service.running_rig.runs.test_runs_and_masters import LEASE_S
from tests.service.running_rig.simulated_rig import ENABLE, OWNER, TAKE, SmallRig

BEAT = 139
FRAMES = {
    "a block": ((0, ENABLE, 1200, 0, 0, BEAT),),
    "setpoint and heartbeat": ((0, ENABLE, 1200), (4, BEAT)),
    "heartbeat and setpoint": ((4, BEAT), (0, ENABLE, 1200)),
    "two blocks": ((0, ENABLE, 1200, 0, 0, BEAT), (0, ENABLE, 1200, 0, 0, BEAT + 1, 0)),
    "a takeover": ((0, ENABLE | TAKE, 1200, 0, 0, BEAT),),
}


def held(*, is_restarted: bool = True) -> SmallRig:
    rig = SmallRig(settings(lease_s=LEASE_S, lease_action=LeaseAction.HOLD), is_restarted=is_restarted)
    rig.beats = False
    return rig


@pytest.mark.parametrize(
    ("name", "is_reconnected"),
    [*((name, False) for name in FRAMES), ("a block", True), ("setpoint and heartbeat", True)],
)
def test_what_a_program_that_had_hung_presses_ends_with_its_lease(name: str, is_reconnected: bool) -> None:
    """12 N were held until somebody came."""
    rig = held()
    for cycle in range(120):
        for words in FRAMES[name]:
            rig.answer(*words, peer=replace(OWNER, port=4001 + cycle * is_reconnected))
        rig.run(0.1)
    trace = rig.trace[-round(len(rig.trace) * 0.5) :]
    assert {(state, voltage_v) for state, voltage_v, _ in trace} == {(State.OFF, 0.0)}


@pytest.mark.parametrize(("is_restarted", "beats"), [(True, 3), (False, 0)])
def test_what_a_living_program_pressed_is_held_behind_its_loss(is_restarted: bool, beats: int) -> None:
    rig = held(is_restarted=is_restarted)
    for beat in range(beats + 1):
        rig.write(0, ENABLE, 1200, 0, 0, BEAT + beat)
        rig.run(0.1)
    assert rig.run(5.0).state is not State.OFF and rig.trace[-1][1] > 1.0
