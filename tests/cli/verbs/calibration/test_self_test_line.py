"""A self-test by a serial line: what it shows leaves the lease that `init` writes its time."""

from types import SimpleNamespace

import pytest

from gateway import defaults
from gateway.cli.verbs.calibration import self_test
from gateway.registers import RegisterMap
from gateway.registers.words import SelfTestResult
from tests.cli.conftest import PlainBank
from tests.cli.force_hold.test_slow_line import SerialClient

BEATS = 20


@pytest.mark.parametrize("baud", [9600, 19200])
def test_what_is_shown_costs_no_lease(register_map: RegisterMap, monkeypatch: pytest.MonkeyPatch, baud: int) -> None:
    """At 9600 baud the self-test was stopped after its first line, by a fault A310 of which nothing was said."""
    bank = PlainBank(register_map)
    bank.set("self_test_result", SelfTestResult.RUNNING)
    client = SerialClient(bank, baud)

    def pass_time(seconds: float) -> None:
        client.now_s += seconds
        if len(client.beats_s) >= BEATS:
            bank.set("self_test_result", SelfTestResult.PASSED)

    monkeypatch.setattr(self_test, "time", SimpleNamespace(monotonic=lambda: client.now_s, sleep=pass_time))
    self_test._SelfTest(client).follow(shows=True)
    assert len(client.beats_s) > BEATS
    assert client.longest_between_s < 0.6 * defaults.LEASE_S
