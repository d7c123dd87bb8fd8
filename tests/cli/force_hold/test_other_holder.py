"""A second hold beside one that beats: two of one host would share the setpoint."""

import threading
import time
from typing import Any

import pytest

from gateway.cli.force_hold import other_holder
from gateway.registers.words import State, StatusBit


@pytest.fixture
def held(fake: Any, monkeypatch: pytest.MonkeyPatch) -> Any:
    """A gateway that presses 12 N, as somebody has told it."""
    monkeypatch.setattr(other_holder, "_WATCHED_S", 0.05)
    fake.bank.set("state", State.HOLDING)
    fake.bank.set("status_word", StatusBit.ENABLED)
    fake.bank.set("force_requested", 12.0)
    return fake


def test_a_second_hold_is_refused_while_the_first_one_beats(held: Any, call: Any) -> None:
    """The first one pressed 20 N from then on, and was told at the second one's end that somebody had cleared enable."""
    over = threading.Event()

    def beat() -> None:
        while not over.wait(0.005):
            held.bank.set("heartbeat", time.monotonic_ns() // 1_000_000 % 50_000)

    beating = threading.Thread(target=beat)
    beating.start()
    try:
        done = call("hold", "20", "--for", "50ms", "--gateway", held.address)
    finally:
        over.set()
        beating.join()
    assert (done.exit_code, done.stderr.split()[0]) == (65, "E137")
    assert f"{held.address}: somebody holds 12.00 N there already" in done.stderr
    assert held.bank.writes == [], "the force stays what it was"


@pytest.mark.parametrize("bits", [StatusBit(0), StatusBit.ENABLED])
def test_a_force_that_was_left_is_taken_over(held: Any, call: Any, bits: StatusBit) -> None:
    """By a hold that was killed, on a rig without a lease, say."""
    held.bank.set("status_word", bits)
    done = call("hold", "20", "--for", "50ms", "--json", "--gateway", held.address)
    assert done.exit_code == 0, done.output
    assert held.bank.writes[0][1][:2] == (1, 2000)
