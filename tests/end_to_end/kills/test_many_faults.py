"""Each process of a real gateway killed and stopped, 200 times each, while 4 V are out.

What is not control's must not be felt at all: the guardian stopped, the residual watch killed or stopped. The push gate does
each once, in the files beside this one.
"""

from typing import Any

import pytest

from tests.gate.tried_again import STOLEN_S
from tools.bench.faults.process_faults import Fault, faults, p99, run, undisturbed

ROUNDS = 200
FAULTS = faults()


@pytest.mark.long
@pytest.mark.parametrize("fault", FAULTS, ids=[fault.name for fault in FAULTS])
def test_hundreds_of_them(fault: Fault) -> None:
    """Minutes: a gateway is started for every fourth death of control."""
    times = run(fault, ROUNDS)
    assert len(times) == ROUNDS
    if fault.safe_s is not None and fault.ready_s is not None:
        assert p99([safe_s for safe_s, _ in times]) <= fault.safe_s
        assert p99([ready_s for _, ready_s in times]) <= fault.ready_s


@pytest.mark.parametrize("fails", [False, True])
def test_a_round_in_which_the_host_took_a_processor_decides_nothing(fails: bool) -> None:
    """Of 200 there is always such a one on a shared host; before, each run stopped there, after seven or eight."""

    def act(_: Any) -> tuple[float, float]:
        if fails:
            raise ConnectionResetError
        return 0.01, 0.2

    fault, scene = Fault("any", act, 0.005, None), Any
    assert undisturbed(fault, scene, iter([{"cpu0": 1.0}, {"cpu0": 1.0 + STOLEN_S}]).__next__) is None
    calm = iter([{"cpu0": 1.0}, {"cpu0": 1.01}]).__next__
    if fails:
        with pytest.raises(ConnectionResetError):
            undisturbed(fault, scene, calm)
    else:
        assert undisturbed(fault, scene, calm) == (0.01, 0.2)
