"""Rates, log lines, and who may connect."""

import asyncio
import socket
from ipaddress import ip_network
from math import inf

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.defaults import PILE_S
from gateway.fieldbus import ServerSettings
from gateway.fieldbus.peers import Peers, address_of, is_loopback
from gateway.fieldbus.rate_limits import Backlog, LogLimiter, RequestRate
from gateway.fieldbus.waiting_bytes import count_waiting


@given(st.floats(1.0, 1000.0), st.lists(st.floats(0.0, 0.5), max_size=100))
def test_no_timing_gets_more_than_the_rate_and_one_burst(rate_per_s: float, pauses_s: list[float]) -> None:
    rate, now_s, run = RequestRate(rate_per_s, 0.0), 0.0, 0
    for pause_s in pauses_s:
        now_s += pause_s
        while rate.wait_s(now_s) == 0.0 and run < 10_000:
            rate.spend()
            run += 1
    assert run <= max(1.0, 0.25 * rate_per_s) + rate_per_s * now_s + 1e-3


def test_the_wait_that_is_told_is_long_enough() -> None:
    rate, now_s = RequestRate(7.0, 0.0), 0.0
    for _ in range(100):
        while (wait_s := rate.wait_s(now_s)) > 0.0:
            now_s += wait_s
        rate.spend()
    assert now_s == pytest.approx((100 - 1.75) / 7.0, rel=1e-6)


def test_who_was_quiet_has_saved_up_one_burst_and_no_more() -> None:
    rate = RequestRate(200.0, 0.0)
    for now_s in (0.0, 3600.0):
        burst = 0
        while rate.wait_s(now_s) == 0.0:
            rate.spend()
            burst += 1
        assert burst == 50


def test_ten_lines_a_second_of_a_cause_and_the_rest_counted() -> None:
    lines: list[tuple[str, str]] = []
    gate = LogLimiter(lambda cause, sentence: lines.append((cause, sentence)))
    for number in range(500):
        gate("framing", f"line {number}", 10.0 + number / 1000)
        gate("idle", "other", 10.0) if number == 250 else None
    gate("framing", "later", 11.5)
    assert [sentence for cause, sentence in lines if cause == "framing"] == [
        *(f"line {number}" for number in range(10)),
        "later (490 more lines like this were left out)",
    ]
    assert ("idle", "other") in lines


def test_log_lines_are_bounded_in_each_second_and_ten_of_one_leave_none_out() -> None:
    """A port scan of minutes is as bounded in its last second as in its first; what was not left out is not told of."""
    lines: list[str] = []
    gate = LogLimiter(lambda cause, sentence: lines.append(sentence))
    for second in range(5):
        for number in range(30 if second < 3 else 10):
            gate("refused", f"line {second}.{number}", 20.0 + second + number / 100)
    assert [sum(line.startswith(f"line {second}.") for line in lines) for second in range(5)] == [10] * 5
    assert [line for line in lines if "left out" in line] == [
        f"line {second}.0 (20 more lines like this were left out)" for second in (1, 2, 3)
    ]


NETWORK = ServerSettings(allow=(ip_network("192.0.2.0/24"), ip_network("2001:db8::/32")))


@pytest.mark.parametrize(
    ("host", "allowed"),
    [
        ("192.0.2.7", True),
        ("::ffff:192.0.2.7", True),
        ("2001:db8::1", True),
        ("198.51.100.1", False),
        ("2001:db9::1", False),
        ("127.0.0.1", False),
    ],
)
def test_beyond_loopback_the_allow_list_decides(host: str, allowed: bool) -> None:
    assert (Peers(NETWORK, guarded=True).refusal(host) is None) == allowed


def test_on_loopback_the_allow_list_is_not_asked() -> None:
    assert Peers(NETWORK, guarded=False).refusal("127.0.0.1") is None


@pytest.mark.parametrize("host", ["127.0.0.1", "127.8.8.8", "::1", "localhost", "::ffff:127.0.0.1", "::1%lo"])
def test_loopback_is_known_in_all_its_spellings(host: str) -> None:
    assert is_loopback(host)


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "", "192.0.2.7", "robot.example", "fe80::1%eth0"])
def test_what_others_can_reach_is_not_loopback(host: str) -> None:
    assert not is_loopback(host)


def test_an_ipv4_peer_is_the_same_through_an_ipv6_socket() -> None:
    assert address_of("::ffff:192.0.2.7") == address_of("192.0.2.7")
    assert str(address_of("fe80::7%eth0")) == "fe80::7", "whichever card it comes by"


def test_leaving_and_coming_back_is_no_way_to_a_new_burst() -> None:
    peers = Peers(ServerSettings(requests_per_s=200.0), guarded=False)
    host = "192.0.2.7"
    peers.join(host)
    rate = peers.rate(host, 0.0)
    assert rate is not None
    while rate.wait_s(0.0) == 0.0:
        rate.spend()
    peers.forget(10.0)
    assert peers.rate(host, 10.0) is rate, "a second connection beside it shares its rate"
    while rate.wait_s(10.0) == 0.0:
        rate.spend()
    peers.leave(host)
    peers.forget(10.01)
    assert peers.rate(host, 10.01) is rate
    peers.forget(11.0)
    assert peers.rate(host, 11.0) is not rate


@pytest.mark.parametrize(
    ("taken", "waiting", "is_late"), [(5_000, 1_200.0, False), (60, 3_000.0, True), (60, inf, True)]
)
def test_only_who_has_more_under_way_than_is_soon_answered_is_late(taken: int, waiting: float, is_late: bool) -> None:
    """A client with forty requests always under way has its answers within milliseconds; its heartbeats must count."""
    backlog = Backlog()
    for tick in range(60):
        backlog.note(0.01 * tick, taken * (tick + 1), waiting)
        assert backlog.is_late is (is_late and tick >= 25)
    backlog.note(0.6, 100 * taken, 0.0)
    assert not backlog.is_late


def test_a_pile_is_one_until_its_last_byte_is_taken() -> None:
    """Its end has waited for as long as its beginning, though so little of it is left that it looks like a burst."""
    backlog = Backlog()
    for tick in range(60):
        backlog.note(0.01 * tick, 12 * (tick + 1), 5000.0)
    assert backlog.is_late
    backlog.note(0.61, 5720, 12.0)
    assert backlog.is_late
    backlog.note(0.62, 5732, 0.0)
    assert not backlog.is_late


def test_what_waits_in_a_socket_is_counted_and_of_one_that_is_closed_nobody_knows() -> None:
    ours, theirs = socket.socketpair()

    class Transport(asyncio.BaseTransport):
        def get_extra_info(self, name: str, _default: object = None) -> object:
            return {"socket": ours}.get(name)

    theirs.sendall(bytes(3000))
    assert count_waiting(Transport()) == 3000.0
    ours.recv(1000)
    assert count_waiting(Transport()) == 2000.0
    ours.close()
    theirs.close()
    assert count_waiting(Transport()) == inf
    assert count_waiting(asyncio.BaseTransport({})) == inf, "one without a socket"


@pytest.mark.parametrize("lines", [10, 11, 12])
def test_each_line_that_was_left_out_is_told_of_one_alone_too(lines: int) -> None:
    passed = list[str]()
    limiter = LogLimiter(lambda cause, sentence: passed.append(sentence))
    for _ in range(lines):
        limiter("refused", "no", 5.0)
    limiter("refused", "again", 6.0)
    left_out = f" ({lines - 10} more lines like this were left out)" if lines > 10 else ""
    assert passed[10:] == [f"again{left_out}"]


def test_what_waits_is_late_by_the_pace_at_which_it_is_taken() -> None:
    """Ten bytes that wait are soon answered where many are taken in four seconds, and late where few are."""
    for taken, is_late in ((round(40.0 / PILE_S) - 5, True), (round(40.0 / PILE_S) + 5, False)):
        backlog = Backlog()
        backlog.note(0.0, 0, 10)
        backlog.note(4.0, taken, 10)
        assert backlog.is_late is is_late
