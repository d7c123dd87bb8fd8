"""The register `watchdogs` says who writes the safe voltage when control, or this machine, is gone: never one who would not."""

from types import SimpleNamespace
from typing import Any

import pytest

from gateway.registers.words import WatchdogBit
from gateway.service.running_rig.lines.watchdog_word import WatchdogRegister, watchdog_word

NONE = WatchdogBit(0)


def word(*, guarded: bool = False, accepts_none: bool = False, **checks: bool) -> WatchdogBit:
    known: dict[str, Any] = {"has_watchdog": True, "is_armed": False, "is_tripped": False} | checks
    rig, ports = SimpleNamespace(accept_no_device_watchdog=accepts_none), SimpleNamespace(is_guarded=guarded)
    line = SimpleNamespace(checks=SimpleNamespace(**known))
    return WatchdogBit(watchdog_word(rig, ports, line))  # type: ignore[arg-type]


@pytest.mark.parametrize("guarded", [False, True])
def test_the_guardian_watches_only_a_line_that_it_has(guarded: bool) -> None:
    bit = WatchdogBit.GUARDIAN_WATCHES if guarded else NONE
    assert word(guarded=guarded) == bit
    assert word(guarded=guarded, is_armed=True) == bit | WatchdogBit.DEVICE_ARMED
    assert word(guarded=guarded, is_tripped=True) == bit | WatchdogBit.DEVICE_TRIPPED
    assert word(guarded=guarded, is_armed=True, is_tripped=True) == bit | 6, "both, where both are said"


def test_an_arming_that_the_device_has_forgotten_is_told_once_each_time() -> None:
    checks, shown, told = SimpleNamespace(times_forgotten=0, unarmed="", is_armed=True), list[int](), list[str]()
    register = WatchdogRegister(SimpleNamespace(checks=checks), shown.append, lambda cause, text: told.append(text))  # type: ignore[arg-type]
    for word, times in ((3, 0), (3, 0), (1, 1), (3, 1), (3, 1), (3, 2)):
        checks.times_forgotten = times
        register.follow(word)
    assert shown == [3, 1, 3]
    assert [text[:4] for text in told] == ["W249", "W249"]


def test_a_watchdog_that_does_not_arm_is_told_once_until_it_has_been_armed() -> None:
    checks, told = SimpleNamespace(times_forgotten=0, unarmed="", is_armed=False), list[str]()
    line: Any = SimpleNamespace(checks=checks)
    register = WatchdogRegister(line, lambda word: None, lambda cause, text: told.append(text))
    steps = [("", False), ("?", False), ("?", False), ("", False), ("?", False), ("", True), ("no", False)]
    for checks.unarmed, checks.is_armed in steps:
        register.follow(0)
    says = "W251 the output device's watchdog does not arm, and the rig accepts that"
    assert told == [f"{says}: ?", f"{says}: no"]


@pytest.mark.parametrize("accepts_none", [False, True])
def test_that_there_is_none_is_said_where_the_rig_accepts_it(accepts_none: bool) -> None:
    bit = WatchdogBit.DEVICE_HAS_NONE if accepts_none else NONE
    assert word(has_watchdog=False, is_armed=True, accepts_none=accepts_none) == bit
    assert word(accepts_none=accepts_none) == NONE, "it has one"
