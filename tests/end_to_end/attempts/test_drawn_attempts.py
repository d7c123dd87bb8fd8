"""Attempts on a real gateway from outside, drawn from a seed: beside what is harmless a held force stays, whatever else is done
the gateway goes on, and where all is healed the force is back.

What is done is the seed's; when, is the machine's. `ATTEMPTS=40:60 ./tools/test --long tests/end_to_end/attempts` plays others.
"""

import os
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from pathlib import Path
from random import Random

import pytest

from tests.end_to_end.attempts import harmless, rough
from tests.end_to_end.attempts.attempted_gateway import Attempted, attempted, take_up

_FIRST, _, _END = os.environ.get("ATTEMPTS", "0:12").partition(":")
_ROUNDS = 8  # of one gateway: about four minutes
_HARMLESS_S, _ROUGH_S = 12.0, 10.0
_BACK_S = 10.0
"""Until the force is back: 2 s of a restart, and more where a simulated rig was killed again and again, which waits longer each
time before it is started."""
_ANSWER_S = 1.0

Act = Callable[[Attempted], None]


def drawn_for(scene: Attempted, lasts_s: float) -> Iterator[Act]:
    """Harmless acts by chance, for so long."""
    until_s = time.monotonic() + lasts_s
    while time.monotonic() < until_s:
        yield scene.draw.choice(harmless.ACTS)


def hold_beside(scene: Attempted, acts: Iterable[Act]) -> None:
    """A held force, these acts beside it, and people's verbs all the while."""
    began_s = time.monotonic()
    with ThreadPoolExecutor(1) as people:
        asked = people.submit(scene.verb, *harmless.choose_verb(scene))
        for act in acts:
            scene.say(act.__name__)
            act(scene)
            if asked.done():
                asked = people.submit(scene.verb, *harmless.choose_verb(scene))
            scene.is_over.wait(scene.draw.choice((0.0, 0.02, 0.1, 0.3)))
        ended_s = time.monotonic()
    looks = [look for look in scene.looks if began_s < look.at_s < ended_s]
    lost = [look for look in looks if not look.holds()]
    assert not lost, f"{lost[:3]} of {len(looks)} looks\n" + "\n".join(scene.said)
    seen_s = [began_s, *(look.at_s + look.took_s for look in looks), ended_s]
    assert max(later - earlier for earlier, later in pairwise(seen_s)) < _ANSWER_S, scene.said


def be_rough(scene: Attempted, lasts_s: float) -> None:
    """Whatever somebody may do to it."""
    began_s = time.monotonic()
    scene.is_held.clear()
    while time.monotonic() < began_s + lasts_s:
        act = scene.draw.choice(rough.ACTS)
        scene.say(act.__name__)
        act(scene)
        assert scene.gateway.process.poll() is None, "it ended\n" + "\n".join(scene.said[-30:])
        scene.is_over.wait(scene.draw.choice((0.0, 0.1, 0.5)))
    rough.heal(scene)


def test_a_held_force_stays_beside_what_is_harmless(tmp_path: Path) -> None:
    """Real time, two or three seconds: each act once, and refused writes at several places."""
    with attempted(tmp_path, Random(0)) as scene:
        take_up(scene, _BACK_S)
        hold_beside(scene, (*dict.fromkeys(harmless.ACTS), *[harmless.write_refused] * 10))
    assert not scene.faults


@pytest.mark.long
@pytest.mark.parametrize("seed", range(int(_FIRST), int(_END)))
def test_the_force_is_back_after_anything(tmp_path: Path, seed: int) -> None:
    """Four minutes each."""
    with attempted(tmp_path, Random(seed)) as scene:
        for _ in range(_ROUNDS):
            take_up(scene, _BACK_S)
            hold_beside(scene, drawn_for(scene, _HARMLESS_S))
            be_rough(scene, _ROUGH_S)
        took_s = take_up(scene, _BACK_S)
    print(f"seed {seed}: {len(scene.said)} things done, {len(scene.looks)} looks, in band again within {took_s:.1f} s")
    assert not scene.faults
