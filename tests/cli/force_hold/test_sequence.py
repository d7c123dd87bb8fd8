"""What `hold` writes, against the whole gateway in virtual time; and the thread that writes it, against a plain bank."""

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise

import pytest

from gateway.cli.errors import CliError
from gateway.cli.force_hold.heartbeat import HeartbeatThread, KnownLease
from gateway.cli.force_hold.sequence import HoldEnd, HoldRun, HoldWrite, StatusReading, status_reading_of
from gateway.cli.master.client import GatewayClient
from gateway.cli.master.wires import RtuWire, TcpWire
from gateway.codes.faults import FaultCode
from gateway.codes.refusals import RefusalReason
from gateway.control.settings import LeaseAction
from gateway.devices import SerialSettings
from gateway.registers import RegisterMap
from gateway.registers.words import State
from tests.cli.conftest import PlainBank, Server
from tests.service.rigs import demo, with_supervision
from tests.service.wired import Wired

Serve, Beating = Callable[..., Server], Callable[..., HeartbeatThread]
LEASE_S, PERIOD_S, LOOK_S = 0.2, 0.05, 0.1


class Master:
    """Plays the thread: a beat every period, a look at the status every tenth of a second and after each command."""

    def __init__(self, wired: Wired, force_n: float, *, resets: bool = False) -> None:
        self.wired = wired
        self.run = HoldRun(force_n, heartbeat=wired.word("heartbeat"), resets=resets)
        self.stops = False
        self._look()

    def _look(self) -> None:
        status = self.wired.rig.register_map.registers_of("status")
        self._seen, self._looked_s = (
            status_reading_of({one.name: self.wired.value(one.name) for one in status}),
            self.wired.now_s,
        )

    def keep(self, seconds: float = 60.0, until: Callable[[], bool] = lambda: False) -> "Master":
        end_s = self.wired.now_s + seconds
        while self.wired.now_s < end_s and self.run.end is None and not until():
            write = self.run.next(self._seen, self.wired.now_s, stops=self.stops)
            if write and write.control_word is not None:
                self.wired.write(0, write.control_word, round(100 * write.setpoint_n), 0, 0, write.heartbeat)
            elif write:
                self.wired.write(4, write.heartbeat)
            if write and (write.control_word is not None or self.wired.now_s - self._looked_s >= LOOK_S):
                self._look()
            self.wired.run(PERIOD_S)
        return self


def leased(action: LeaseAction = LeaseAction.FAULT, ramp_n_per_s: float = 100.0) -> Wired:
    rig = with_supervision(demo(), lease_s=LEASE_S, lease_action=action)
    defaults = replace(rig.control.defaults, force_ramp_n_per_s=ramp_n_per_s)
    return Wired(replace(rig, control=replace(rig.control, defaults=defaults))).ready()


def test_a_force_is_held_as_long_as_it_is_wanted_under_a_lease() -> None:
    wired = leased()
    Master(wired, 12.0).keep(5.0)
    assert wired.state is State.HOLDING
    assert wired.force_n == pytest.approx(12.0, abs=1.0)


def test_letting_go_ramps_as_the_rig_does_and_then_disables() -> None:
    wired = leased(ramp_n_per_s=10.0)
    master = Master(wired, 12.0).keep(3.0)
    master.stops, began_s = True, wired.now_s
    forces = [master.keep(0.1).wired.value("force_applied") for _ in range(10)]
    assert all(before - after == pytest.approx(1.0, abs=0.6) for before, after in pairwise(forces))
    master.keep()
    assert master.run.end is HoldEnd.STOPPED
    assert wired.now_s - began_s == pytest.approx(1.2, abs=0.3), "12 N at 10 N/s"
    assert (wired.state, wired.fault_code, wired.word("control_word")) == (State.OFF, FaultCode.NONE, 0)
    wired.observer.check(wired.rig)


def test_a_fault_while_holding_ends_it_and_is_reset_on_request_alone() -> None:
    wired = leased()
    master = Master(wired, 12.0).keep(2.0)
    wired.fault("cell-cut")
    assert master.keep(2.0).run.end is HoldEnd.FAULT
    wired.fault("cell-cut", False)
    wired.run(0.5)
    assert Master(wired, 12.0).keep(0.5).run.end is HoldEnd.FAULT, "nobody asked for a reset"
    again = Master(wired, 12.0, resets=True).keep(3.0)
    assert again.run.end is None
    assert wired.state is State.HOLDING, wired.log
    wired.fault("cell-cut")
    assert again.keep(2.0).run.end is HoldEnd.FAULT, "a reset was asked for the beginning alone"


def test_a_ramp_is_waited_for_while_it_makes_way_and_three_seconds_more() -> None:
    run, status = HoldRun(12.0, heartbeat=0xFFFE, resets=False), StatusReading(State.HOLDING, applied_n=12.0)
    writes = [run.next(status, 0.0, stops=stops) for stops in (False, True)]
    assert [write and write.heartbeat for write in writes] == [0xFFFF, 0], "a register has 16 bits"
    for second in range(1, 9):
        write = run.next(replace(status, applied_n=12.0 - second), float(second), stops=True)
        assert write and write.control_word is None
    stuck = replace(status, applied_n=4.0)
    assert run.next(stuck, 10.9, stops=True) and run.end is None
    assert run.next(stuck, 11.1, stops=True) == HoldWrite(10, 0) and run.end is HoldEnd.STOPPED


def test_somebody_who_disables_ends_it() -> None:
    wired = leased()
    master = Master(wired, 12.0).keep(2.0)
    wired.write(0, 0)
    assert master.keep(1.0).run.end is HoldEnd.DISABLED
    assert wired.word("control_word") == 0, "it is not enabled again"


def test_let_go_before_it_began_nothing_is_written() -> None:
    wired = leased()
    master = Master(wired, 12.0)
    master.stops = True
    assert master.keep(1.0).run.end is HoldEnd.STOPPED
    assert wired.state is State.OFF


@pytest.mark.parametrize(
    ("length_s", "period_s"), [(None, 0.05), (0.2, 0.05), (1.0, 0.05), (0.05, 0.0125), (0.01, 0.005)]
)
def test_several_beats_fit_into_a_lease(length_s: float | None, period_s: float) -> None:
    assert KnownLease(length_s).period_s == pytest.approx(period_s)


# -- the thread


@pytest.fixture
def bank(register_map: RegisterMap) -> PlainBank:
    bank = PlainBank(register_map)
    bank.set("state", State.HOLDING)
    bank.set("force_applied", 0.0)
    return bank


@pytest.fixture
def beating() -> Iterator[Callable[..., HeartbeatThread]]:
    """beating(server, lease) starts the thread; its connection is closed at the end."""
    clients: list[GatewayClient] = []

    def start(server: Server, lease: KnownLease | None = None) -> HeartbeatThread:
        host, _, port = server.address.partition(":")
        clients.append(GatewayClient(TcpWire(host, int(port)), 1, server.bank.register_map))
        beat = HeartbeatThread(clients[-1], HoldRun(12.0, heartbeat=7, resets=False), lease, time.monotonic)
        beat.start()
        return beat

    yield start
    for client in clients:
        client.close()


def waited(condition: Callable[[], bool]) -> bool:
    end_s = time.monotonic() + 5.0
    while not condition() and time.monotonic() < end_s:
        time.sleep(0.002)
    return condition()


def test_the_heart_beats_whatever_the_terminal_does(bank: PlainBank, serve: Serve, beating: Beating) -> None:
    """Nobody shows anything here, as when stdout blocks; and each beat has another value."""
    bank.set("mode", 1)  # what another master has left
    bank.set("force_ramp", 2.0)
    beat = beating(serve(bank), KnownLease(0.02))
    assert waited(lambda: len(bank.writes) > 20)
    beat.stopping.set()
    beat.join(5.0)
    assert beat.failure is None and beat.hold.end is HoldEnd.STOPPED
    heartbeats = [words[-1] for address, words in bank.writes if address + len(words) == 5]
    assert heartbeats == list(range(8, 8 + len(heartbeats)))
    assert bank.writes[0] == (0, (1, 1200, 0, 0, 8)), "setpoint, enable and heartbeat in one request"
    assert bank.writes[-1][1][:2] == (0, 0)


def test_a_second_order_to_stop_skips_the_ramp(bank: PlainBank, serve: Serve, beating: Beating) -> None:
    bank.set("force_applied", 12.0)
    beat = beating(serve(bank))
    assert waited(lambda: len(bank.writes) > 2)
    beat.dropping.set()
    beat.stopping.set()
    beat.join(5.0)
    assert not beat.is_alive() and not any(words[:2] == (1, 0) for _, words in bank.writes)
    assert bank.writes[-1][1][:2] == (0, 0)


def test_a_gateway_that_is_gone_is_told_with_what_happens_now(bank: PlainBank, serve: Serve, beating: Beating) -> None:
    server = serve(bank)
    beat = beating(server, KnownLease(0.2, "ramp"))
    assert waited(lambda: len(bank.writes) > 2)
    server.stop()
    beat.join(10.0)
    assert isinstance(beat.failure, CliError)
    assert beat.failure.exit_code == 69
    seen = "E131 closed the connection, though it answered before"
    assert beat.failure.format_message().startswith(f"E180 the gateway at {server.address} is lost ({seen}); ")
    assert beat.failure.format_message().endswith("the lease of 200 ms is over: it ramps to 0 N")


@pytest.mark.parametrize(
    ("wire", "told", "seen"),
    [
        (
            TcpWire("cell-3", 5020),
            "E131 cell-3:5020 closed the connection: no",
            "E131 closed the connection",
        ),
        (
            TcpWire("::1", 5020),
            "E130 no gateway at [::1]:5020: Connection refused; not running",
            "E130 Connection refused",
        ),
        (
            RtuWire("/dev/ttyS7", SerialSettings(baud=19200)),
            "E123 /dev/ttyS7: no answer within 1 s: no",
            "E123 no answer within 1 s",
        ),
    ],
)
def test_what_was_seen_of_a_loss_is_more_than_the_place(
    wire: TcpWire | RtuWire, told: str, seen: str, register_map: RegisterMap
) -> None:
    """`E131 127.0.0.1` or `E123 /dev/ttyS7` was all that it said."""
    beat = HeartbeatThread(
        GatewayClient(wire, 1, register_map), HoldRun(12.0, heartbeat=1, resets=False), None, time.monotonic
    )
    assert beat._lost_words(CliError(told)) == f"the gateway at {wire.where} is lost ({seen}); nothing had been enabled"


def test_a_gateway_that_comes_back_in_time_is_held_on(bank: PlainBank, serve: Serve, beating: Beating) -> None:
    server = serve(bank)
    beat = beating(server, KnownLease(5.0))
    assert waited(lambda: len(bank.writes) > 2)
    server.stop()
    before = len(bank.writes)
    serve(bank, server.port)
    assert waited(lambda: len(bank.writes) > before + 3)
    beat.dropping.set()
    beat.join(5.0)
    assert beat.failure is None


def test_a_refusal_ends_it_with_its_reason(bank: PlainBank, serve: Serve, beating: Beating) -> None:
    bank.refuse[1] = (3, RefusalReason.OUT_OF_RANGE)
    beat = beating(serve(bank))
    beat.join(5.0)
    assert beat.failure is not None and beat.failure.exit_code == 1
    assert beat.failure.format_message().startswith("W204 value out of range: exception 03")


def test_a_fault_is_reset_once_behind_a_beat_of_its_own_and_one_that_comes_behind_the_reset_ends_it() -> None:
    run, fault = HoldRun(10.0, heartbeat=5, resets=True), StatusReading(State.FAULT)
    first, second = (run.next(fault, now_s, stops=False) for now_s in (0.0, 0.1))
    assert first == HoldWrite(6, 0), "a beat alone: the gateway has zeroed the heartbeat with the fault"
    assert second is not None and (second.heartbeat, second.setpoint_n) == (7, 0.0) and second.control_word
    assert run.next(fault, 0.2, stops=False) is None and run.end is HoldEnd.FAULT
