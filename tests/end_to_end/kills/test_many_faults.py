"""Each process of a real gateway killed and stopped, 200 times each, while 4 V are out.

What is not control's must not be felt at all: the guardian stopped, the residual watch killed or stopped. The push gate does
each once, in the files beside this one.
"""

import pytest

from tools.bench.faults.process_faults import Fault, faults, p99, run

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
