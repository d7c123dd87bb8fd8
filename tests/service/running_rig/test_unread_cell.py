"""A load cell that speaks in another unit or format is no silent one: refusal, fault and warning quote what it says."""

from collections.abc import Callable

import pytest

from gateway.codes.faults import FaultCode
from gateway.registers.refusal import Refusal
from gateway.registers.words import State
from tests.service.rigs import strict
from tests.service.wired import ENABLE, Wired

QUOTED = "it says 'ST,GS,"


def speak(wired: Wired, change: Callable[[bytes], bytes]) -> None:
    send = wired.world._send_cell
    wired.world._send_cell = lambda data: send(change(data))


def in_kilonewtons(frame: bytes) -> bytes:
    return frame.replace(b"kg", b"kN")


def test_an_enable_is_refused_with_what_the_cell_says() -> None:
    """W215 sent people to its power and its cable."""
    wired = Wired()
    speak(wired, in_kilonewtons)
    wired.run(0.5)
    with pytest.raises(Refusal, match=rf"W215 .*{QUOTED}.*kN', in kN: .* reads kg or lb or g or N; set the device"):
        wired.write(0, ENABLE, 1000)


def test_a_unit_that_changes_under_force_is_a_fault_that_tells_it() -> None:
    wired = Wired(strict()).pressing(20.0)
    speak(wired, in_kilonewtons)
    wired.until(lambda: wired.state is State.FAULT, 0.2)
    assert wired.fault_code is FaultCode.SAMPLE_STALE
    (sentence,) = wired.said("A311")
    assert QUOTED in sentence and "in kN" in sentence
    assert "wires" not in sentence


def test_a_stream_that_was_never_understood_is_quoted_by_the_warning_of_noise() -> None:
    wired = Wired()
    speak(wired, lambda frame: frame.replace(b".", b""))
    wired.run(0.5)
    (sentence,) = wired.said("A341")
    assert QUOTED in sentence and "other decimals, another format" in sentence


def test_what_a_cut_has_left_of_a_line_makes_no_silent_cell_a_talking_one() -> None:
    wired = Wired(strict()).pressing(20.0)
    wired.loop.on_cell_bytes(b"ST,GS,+00\r\n", wired.now_s)
    wired.fault("cell-cut")
    wired.until(lambda: wired.state is State.FAULT, 0.2)
    (sentence,) = wired.said("A311")
    assert "power, wires or stream mode" in sentence
