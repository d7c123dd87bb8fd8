"""A float at a limit of the rig does what the same number in a word does: it is pressed, trimmed, and limited by nothing."""

import struct
from collections.abc import Callable
from dataclasses import replace

import pytest

from gateway.registers.words import LimitedBy, State
from tests.service.rigs import demo
from tests.service.wired import ENABLE, MASTER, Wired

FLOAT_ABCD = 200


def _as_float(wired: Wired, force_n: float) -> None:
    wired.bank.write_registers(FLOAT_ABCD, struct.pack(">2f", ENABLE, force_n), MASTER)


def _as_word(wired: Wired, force_n: float) -> None:
    wired.write(0, ENABLE, round(100 * force_n))


@pytest.mark.parametrize("write", [_as_float, _as_word])
@pytest.mark.parametrize(("limit", "force_n"), [("force_max_n", 40.2), ("smallest_force_n", 2.3)])
def test_a_force_at_a_limit_is_held(write: Callable[[Wired, float], None], limit: str, force_n: float):
    rig = demo()
    limits = replace(rig.control.limits, **{limit: force_n})
    wired = Wired(replace(rig, control=replace(rig.control, limits=limits))).ready()
    write(wired, force_n)
    wired.run(3.0)
    assert wired.state is State.HOLDING
    assert LimitedBy(wired.word("limited_by")) is LimitedBy.NONE
    assert wired.value("trim") != 0.0, "what acts as a limit stops the trim"
    assert wired.force_n == pytest.approx(force_n, abs=0.2)
