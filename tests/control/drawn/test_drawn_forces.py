"""Drawn scenes of the force loop under a plain enable: machines that are stronger, weaker, slower or stickier than calibrated,
masters that ask for every force in every way, and whatever befalls air, contact, cell, output and calibration meanwhile.

A scene is one seed. The laws are the judge's own.
"""

from tests.control.drawn.scene import Scene

SCENES = 10
KEPT = 726, 1135
"""A swap beside a trim at its limit, and one to the first measured response."""


def test_a_force_keeps_to_its_limits_arrives_and_tells_whatever_machine_and_master_are(budget: int) -> None:
    """Takes two seconds of processor, a sixth of one for each scene of a quarter of a minute."""
    played = [Scene(seed).play() for seed in (*KEPT, *range(SCENES * budget))]
    assert [(one.seed, one.judge.broken, one.told) for one in played if one.judge.broken] == []
