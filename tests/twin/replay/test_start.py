"""A replay that begins in the middle goes on as if it had been there from the first row, when it is told what friction
remembers."""

from dataclasses import replace

import numpy as np
import pytest

from gateway.twin.plant import Contact, Cylinder, Friction, Plant, Regulator
from gateway.twin.replay.drive import AT_REST, StartState
from gateway.twin.replay.replay import Drive, Replay

RATE_HZ = 100.0
TIME_S = np.arange(1200) / RATE_HZ
BEFORE_V = np.interp(TIME_S, [0.0, 4.0, 5.0, 12.0], [0.0, 6.0, 6.0, 6.0])  # slides out all the way: strains are 1
AFTER_V = np.where(TIME_S < 6.0, BEFORE_V, 4.5 + 1.5 * np.cos(2.0 * np.pi * (TIME_S - 6.0) / 3.0))
CUT = 550  # half a second of rest before it moves again
PLANT = Plant(
    regulator=Regulator(lag_s=0.05),
    cylinder=Cylinder(area_m2=95.0e-6),
    friction=Friction(coulomb_n=1.5),
    contact=Contact(pad_stiffness_n_per_m=4.1e4),
)
RESTED = 1.0 - np.exp(-1.8)
FRICTIONS = {
    "rigid": {},
    "rigid with drag": {"viscous_n_s_per_m": 100.0},
    "presliding": {"presliding_m": 1.0e-4},
    "by speed": {"stribeck_n": 0.8, "stribeck_speed_m_per_s": 0.003},
    "by speed, presliding": {"stribeck_n": 0.8, "stribeck_speed_m_per_s": 0.003, "presliding_m": 1.0e-4},
}


def tail(friction: Friction, strains: tuple[float, float, float], lanes: int = 1) -> np.ndarray:
    """The part behind the cut, replayed alone."""
    plant = replace(PLANT, friction=friction)
    drive = Drive(time_s=TIME_S[CUT:] - TIME_S[CUT], command_v=AFTER_V[CUT:], before_v=None)
    return Replay(drive).run([plant] * lanes, [StartState(strains)] * lanes).force_n[-1]


@pytest.mark.parametrize("kind", FRICTIONS)
def test_it_goes_on_as_the_whole_does(kind: str) -> None:
    friction = replace(PLANT.friction, **FRICTIONS[kind])
    whole = Replay(Drive(time_s=TIME_S, command_v=AFTER_V)).run([replace(PLANT, friction=friction)]).force_n[0, CUT:]
    moved = 200 if "speed" in kind else 0  # at rest Stribeck's curve lets friction carry more than the branch does
    assert tail(friction, (1.0, 1.0, 1.0))[moved:] == pytest.approx(whole[moved:], abs=0.02)
    assert np.max(np.abs(tail(friction, (-1.0, -1.0, -1.0)) - whole)) > 1.0, "the other branch is another force"


@pytest.mark.parametrize("kind", FRICTIONS)
def test_plants_together_begin_as_one_alone_does(kind: str) -> None:
    friction = replace(PLANT.friction, **FRICTIONS[kind])
    plants = [replace(PLANT, friction=replace(friction, coulomb_n=1.5 + 0.01 * lane)) for lane in range(14)]
    starts = [StartState((-1.0, 0.3, 1.0 - 0.1 * lane), 2.0e4) for lane in range(14)]
    drive = Drive(time_s=TIME_S[CUT:] - TIME_S[CUT], command_v=AFTER_V[CUT:], before_v=None)
    together = Replay(drive).run(plants, starts).force_n
    for lane in (0, 13):
        alone = Replay(drive).run([plants[lane]], [starts[lane]]).force_n[0]
        assert together[lane] == pytest.approx(alone, abs=1.0e-6)


def test_no_strain_pulls_at_a_pad_that_nothing_presses() -> None:
    drive = Drive(time_s=TIME_S, command_v=BEFORE_V)
    found = Replay(drive).run([PLANT, PLANT], [StartState((1.0, 1.0, 1.0)), AT_REST]).force_n
    assert found.min() >= 0.0
    assert found[0] == pytest.approx(found[1])


def after(cut_row: int, plant: Plant, start: StartState) -> np.ndarray:
    """What the part behind a row is, replayed alone from a state."""
    drive = Drive(time_s=TIME_S[cut_row:] - TIME_S[cut_row], command_v=AFTER_V[cut_row:], before_v=None)
    return Replay(drive).run([plant], [start]).force_n[0]


def test_a_replay_that_begins_in_a_ramp_goes_on_with_the_pressure_that_is_behind() -> None:
    whole = Replay(Drive(time_s=TIME_S, command_v=AFTER_V)).run([PLANT])
    begun = whole.pressure_pa[0][200]
    ahead_pa = begun - 0.9e5 * AFTER_V[200]
    assert ahead_pa < -5.0e3, "it is in the middle of a ramp"
    found = after(200, PLANT, StartState((1.0, 1.0, 1.0), ahead_pa))
    assert found == pytest.approx(whole.force_n[0, 200:], abs=0.01)
    assert np.max(np.abs(after(200, PLANT, StartState((1.0, 1.0, 1.0))) - whole.force_n[0, 200:])) > 0.4


def test_a_replay_goes_on_with_stiction_that_has_grown() -> None:
    """Of a rest of 1.8 s a part had gone into the first micrometres of it."""
    plant = replace(PLANT, friction=replace(PLANT.friction, dwell_stiction_n=2.0, dwell_stiction_s=1.0))
    volts = np.where(TIME_S < 3.0, 4.0 * TIME_S / 3.0, np.where(TIME_S < 5.0, 4.0, 4.0 - 0.8 * (TIME_S - 5.0)))
    whole = Replay(Drive(time_s=TIME_S, command_v=volts)).run([plant]).force_n[0]
    drive = Drive(time_s=TIME_S[480:] - TIME_S[480], command_v=volts[480:], before_v=None)
    held = (95.0e-6 * 0.36e6 - whole[480]) / (1.5 + 2.0 * RESTED)
    rested = Replay(drive).run([plant], [StartState((held, held, held), stiction_share=RESTED)]).force_n[0]
    fresh = Replay(drive).run([plant], [StartState((1.0, 1.0, 1.0))]).force_n[0]
    assert rested == pytest.approx(whole[480:], abs=0.1)
    assert np.max(np.abs(fresh - whole[480:])) > 0.5


def test_a_replay_goes_on_with_creep_that_has_not_ended() -> None:
    plant = replace(PLANT, contact=replace(PLANT.contact, creep_share=0.1, creep_s=5.0))
    whole = Replay(Drive(time_s=TIME_S, command_v=AFTER_V)).run([plant, PLANT]).force_n
    behind_n = (whole[0, CUT] - whole[1, CUT]) / 0.1 - whole[1, CUT]
    found = after(CUT, plant, StartState((1.0, 1.0, 1.0), creep_n=behind_n))
    assert found == pytest.approx(whole[0, CUT:], abs=0.02)
