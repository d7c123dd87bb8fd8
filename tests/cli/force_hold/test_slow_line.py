"""A hold by a slow serial line: what it asks between two beats leaves the lease that `init` writes its time."""

from itertools import pairwise
from typing import Any

from gateway import defaults
from gateway.cli.force_hold.heartbeat import HeartbeatThread
from gateway.cli.force_hold.sequence import HoldRun
from gateway.modbus.rtu import silence_s
from gateway.registers import RegisterMap
from gateway.registers.words import State
from tests.cli.conftest import PlainBank
from tests.cli.force_hold.test_lost_orders import LossyClient

BEATS = 20


class SerialClient(LossyClient):
    """Counts what each exchange takes on a line, requests and answers with the silence behind each; `beats_s`: when the
    heartbeat was through."""

    def __init__(self, bank: PlainBank, baud: int) -> None:
        super().__init__(bank, losses=0)
        self.now_s, self.beats_s = 0.0, list[float]()
        self._character_s = 11 / baud
        self._silence_s = silence_s(baud, self._character_s)

    @property
    def longest_between_s(self) -> float:
        """The longest time between two beats."""
        return max(after - before for before, after in pairwise(self.beats_s))

    def _ask(self, method: str, request: str, *arguments: Any, **options: Any) -> Any:
        is_read = method == "read_holding_registers"
        asked, answered = (8, 5 + 2 * options["count"]) if is_read else (9 + 2 * len(arguments[1]), 8)
        self.now_s += asked * self._character_s + self._silence_s
        if not is_read:
            self.beats_s.append(self.now_s)
        answer = super()._ask(method, request, *arguments, **options)
        self.now_s += answered * self._character_s + self._silence_s
        return answer


def test_between_two_beats_no_more_is_read_than_a_lease_has_time_for(register_map: RegisterMap) -> None:
    """The whole status block took 0.23 s: the force was there, and gone by a fault A310."""
    bank = PlainBank(register_map)
    bank.set("state", State.HOLDING)
    client = SerialClient(bank, 4800)
    beat = HeartbeatThread(client, HoldRun(12.0, heartbeat=0, resets=False), None, lambda: client.now_s)
    beat._look()
    for _ in range(BEATS):
        beat._step(client.now_s)
    assert len(client.beats_s) >= BEATS
    assert client.longest_between_s < 0.9 * defaults.LEASE_S
