"""An order that no gateway has heard is no order given: `hold` says that it has let go when the gateway has been told."""

from types import SimpleNamespace
from typing import Any

import pytest

from gateway.cli.errors import CliError
from gateway.cli.force_hold.heartbeat import HeartbeatThread, KnownLease
from gateway.cli.force_hold.sequence import HoldEnd, HoldRun, HoldWrite, StatusReading
from gateway.cli.master.client import GatewayClient
from gateway.cli.master.wires import TcpWire
from gateway.cli.verbs.operation.hold import _report_end
from gateway.codes.faults import FaultCode
from gateway.codes.warning_bits import WarningBit
from gateway.modbus.peer import NOBODY
from gateway.processes import exit_codes
from gateway.registers import RegisterMap
from gateway.registers.words import State
from tests.cli.conftest import PlainBank


class LossyClient(GatewayClient):
    """A gateway that holds a force. The first orders to disable get lost with their connection; each enable is answered by
    `on_enabled`."""

    def __init__(self, bank: PlainBank, losses: int) -> None:
        super().__init__(TcpWire("127.0.0.1", 5020), 1, bank.register_map)
        self.bank, self.losses = bank, losses
        self.on_enabled = lambda: None
        self.deaf = 0

    def _ask(self, method: str, request: str, *arguments: Any, **options: Any) -> Any:
        if self.deaf:
            self.deaf -= 1
            raise CliError("E130 no gateway at 127.0.0.1:5020", exit_codes.DEVICE)
        if method == "read_holding_registers":
            data = self.bank.read(arguments[0], options["count"])
            return SimpleNamespace(
                registers=[int.from_bytes(data[at : at + 2], "big") for at in range(0, len(data), 2)]
            )
        address, words = arguments
        if address == 0 and words[0] == 0 and self.losses:
            self.losses -= 1
            raise CliError("E131 127.0.0.1:5020 closed the connection: gone", exit_codes.DEVICE)
        self.bank.write_registers(address, b"".join(word.to_bytes(2, "big") for word in words), NOBODY)
        if address == 0 and words[0] == 1:
            self.on_enabled()
        return None


@pytest.mark.parametrize(("order", "applied_n"), [("stopping", 0.0), ("dropping", 12.0)])
@pytest.mark.parametrize("losses", [1, 3])
def test_a_disable_that_got_lost_is_sent_again(
    order: str, applied_n: float, losses: int, register_map: RegisterMap
) -> None:
    """It was told as `0 N, disabled` while the gateway went on pressing."""
    bank = PlainBank(register_map)
    bank.set("state", State.HOLDING)
    bank.set("force_applied", applied_n)
    client = LossyClient(bank, losses)
    beat = beating(client, None)
    client.on_enabled = getattr(beat, order).set
    beat.run()
    assert beat.failure is None and beat.hold.end is HoldEnd.STOPPED
    assert client.losses == 0 and bank.words[0] == 0


def test_a_ramp_down_that_got_lost_is_begun_again_and_nothing_is_enabled_that_is_off() -> None:
    run = HoldRun(12.0, heartbeat=0, resets=False)
    assert run.next(StatusReading(State.OFF), 0.0, stops=False) == HoldWrite(1, 1, 12.0)
    pressing = StatusReading(State.HOLDING, applied_n=12.0)
    lowered = run.next(pressing, 0.1, stops=True)
    assert lowered == HoldWrite(2, 1, 0.0)
    run.note_lost(lowered)
    assert run.next(pressing, 0.2, stops=True) == HoldWrite(3, 1, 0.0)
    run.note_lost(HoldWrite(3, 1, 0.0))
    assert run.next(StatusReading(State.OFF), 0.3, stops=True) is None and run.end is HoldEnd.STOPPED


@pytest.mark.parametrize(("is_heard", "code"), [(False, "E131"), (True, "W336")])
def test_an_enable_that_nobody_has_heard_was_cleared_by_nobody(
    is_heard: bool, code: str, register_map: RegisterMap
) -> None:
    """Noise on a serial line takes one request: somebody else was blamed. Once it was seen to press, that is so."""
    bank = PlainBank(register_map)
    beat = beating(LossyClient(bank, 0), None)
    send, looks = beat._send, [State.HOLDING, State.OFF] if is_heard else []

    def lose(write: HoldWrite) -> None:
        if write.control_word == 1:
            bank.set("state", looks.pop(0) if looks else State.OFF)
            raise CliError("E131 no answer", exit_codes.DEVICE)
        bank.set("state", looks.pop(0) if looks else State.OFF)
        send(write)

    beat._send = lose  # type: ignore[method-assign]
    beat._looked_s = -10.0
    beat.run()
    assert beat.failure is None and beat.hold.end is HoldEnd.DISABLED
    with pytest.raises(CliError, match=code):
        _report_end(beat, "127.0.0.1:5020", as_json=False)


def test_a_status_that_nobody_here_understands_ends_at_the_safe_voltage_and_is_told(register_map: RegisterMap) -> None:
    """A later gateway may have another fault: the thread died over it, and `hold` told `0 N, disabled` with exit code 0."""
    bank = PlainBank(register_map)
    bank.set("state", State.HOLDING)
    client = LossyClient(bank, 0)
    beat = beating(client, None)
    client.on_enabled = lambda: bank.set("limited_by", 99)
    beat.run()
    assert isinstance(beat.failure, ValueError) and bank.words[0] == 0
    with pytest.raises(ValueError, match="99 is not a valid LimitedBy"):
        _report_end(beat, "127.0.0.1:5020", as_json=False)


def beating(client: LossyClient, length_s: float | None, step_s: float = 0.001) -> HeartbeatThread:
    times, run = iter(range(100_000)), HoldRun(12.0, heartbeat=0, resets=False)
    beat = HeartbeatThread(client, run, KnownLease(length_s), lambda: step_s * next(times))
    beat._pause.set()
    return beat


@pytest.mark.parametrize(("looks", "is_seen"), [(1, True), (60, True), (400, False)])
def test_an_output_that_does_not_obey_the_last_safe_voltage_ends_it_as_a_fault(
    looks: int, is_seen: bool, register_map: RegisterMap
) -> None:
    """It was told as `0 N, disabled`, with exit code 0, while the tool went on pressing."""
    bank = PlainBank(register_map)
    bank.set("state", State.HOLDING)
    client = LossyClient(bank, 0)
    beat = beating(client, None)
    client.on_enabled = beat.dropping.set
    looked, look = [0], beat._look

    def look_again() -> None:
        looked[0] += beat.hold.end is not None
        if looked[0] == looks:
            bank.set("state", State.FAULT)
            bank.set("fault_code", FaultCode.OUTPUT_SILENT)
        look()

    beat._look = look_again  # type: ignore[method-assign]
    beat.run()
    assert beat.hold.end is (HoldEnd.FAULT if is_seen else HoldEnd.STOPPED) and beat.failure is None


def test_a_gateway_that_ends_behind_a_hold_is_none_that_was_lost(register_map: RegisterMap) -> None:
    bank = PlainBank(register_map)
    bank.set("state", State.HOLDING)
    client = LossyClient(bank, 0)
    beat = beating(client, None)
    client.on_enabled = beat.dropping.set
    watch = beat._watch_output

    def watch_nobody() -> None:
        client.deaf = 10
        watch()

    beat._watch_output = watch_nobody  # type: ignore[method-assign]
    beat.run()
    assert beat.failure is None and beat.hold.end is HoldEnd.STOPPED


def test_an_enable_is_looked_at_before_anything_is_made_of_it(register_map: RegisterMap) -> None:
    """By the status of before it would seem disabled, and be left alone while it presses."""
    bank = PlainBank(register_map)
    client = LossyClient(bank, 0)
    beat = beating(client, None)

    def enabled() -> None:
        bank.set("state", State.HOLDING)
        beat.stopping.set()

    client.on_enabled = enabled
    beat.run()
    assert beat.hold.end is HoldEnd.STOPPED and bank.words[0] == 0


@pytest.mark.parametrize(("length_s", "is_lost"), [(0.05, True), (1.0, False), (None, False)])
def test_a_lost_gateway_is_looked_for_as_long_as_the_lease_may_run(
    register_map: RegisterMap, length_s: float | None, is_lost: bool
) -> None:
    """It comes back after twenty looks, each of which takes 10 ms of this clock."""
    bank = PlainBank(register_map)
    bank.set("state", State.HOLDING)
    client = LossyClient(bank, 1)
    beat = beating(client, length_s, step_s=0.01)
    beat._wait = lambda seconds: None  # type: ignore[method-assign]
    client.on_enabled = beat.dropping.set
    lose = client._ask

    def ask(*given: Any, **options: Any) -> Any:
        before = client.losses
        try:
            return lose(*given, **options)
        finally:
            client.deaf = 20 if client.losses < before else client.deaf

    client._ask = ask  # type: ignore[method-assign]
    beat.run()
    assert (beat.failure is not None, bank.words[0] == 0) == (is_lost, not is_lost)


def test_a_warning_that_has_gone_is_remembered_for_the_end(register_map: RegisterMap) -> None:
    bank = PlainBank(register_map)
    bank.set("state", State.HOLDING)
    bank.set("warning_word", WarningBit.MASTER_LOST)
    client = LossyClient(bank, 0)
    beat = beating(client, None)

    def enabled() -> None:
        bank.set("warning_word", 0)
        bank.set("state", State.OFF)

    client.on_enabled = enabled
    beat.run()
    assert beat.hold.end is HoldEnd.DISABLED and beat.warned & WarningBit.MASTER_LOST
