"""A regulator that is moved behind our back while nothing is wanted of it: at its panel, by a second talker, by its supply."""

from collections.abc import Callable

import pytest

from gateway.registers.words import State
from tests.service.rigs import strict
from tests.service.running_rig.lines.output.played_output import Wire, wire
from tests.service.wired import RESET, Wired

__all__ = ["wire"]

REPEATED_S = 0.5


def disabled(wired: Wired) -> None:
    wired.write(0, 0)


def in_fault(wired: Wired) -> None:
    wired.fault("cell-cut")
    wired.run(0.2)
    wired.fault("cell-cut", on=False)


@pytest.mark.parametrize(("rests", "state"), [(disabled, State.OFF), (in_fault, State.FAULT)])
def test_an_output_that_was_moved_at_rest_is_told_the_safe_voltage_again(
    rests: Callable[[Wired], None], state: State
) -> None:
    wired = Wired(strict()).pressing(12.0)
    rests(wired)
    wired.run(2.0)
    assert wired.state is state
    wired.world.on_output_bytes(b"SET 409\r\n", wired.now_s)  # of somebody else; the observer reads our own wire
    moved_s = wired.now_s
    wired.run(0.3)
    assert wired.twin.pressure_pa > 0.0
    wired.run(REPEATED_S + 0.5)
    assert any(one.voltage_v == 0.0 for one in wired.settings_since(moved_s))
    wired.run(1.0)
    assert wired.force_n < 3.0
    wired.write(0, RESET, 0, 0, 0, 1)
    wired.pressing(12.0)
    wired.observer.check(wired.rig)


def say(wire: Wire, seconds: float, standing: str) -> list[str]:
    """What is asked meanwhile by an idle line, each question answered."""
    before, end_s = len(wire.written), wire.now_s + seconds
    while wire.now_s < end_s:
        heard = len(wire.written)
        wire.tick(0.01)
        if len(wire.written) > heard:
            wire.answer("0" if wire.last == "MON" else standing)
    return [line.decode().strip() for line in wire.written[before:]]


def test_at_rest_the_setting_is_repeated_and_the_pressure_asked_all_the_same(wire: Wire) -> None:
    wire.settle(0)
    said = say(wire, 5.0, "0")
    assert (
        7 <= said.count("SET 0") <= 10
        and said.count("MON") >= 30
        and len(said) == said.count("SET 0") + said.count("MON")
    )


def test_under_force_nothing_is_repeated_that_might_be_a_jump_where_the_device_has_lost_it(wire: Wire) -> None:
    wire.settle(409)
    assert set(say(wire, 3.0, "409")) == {"MON"}
