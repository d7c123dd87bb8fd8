"""A master that writes in cycles sends the same words with another heartbeat. That has a short way, which must end where the
long one does, whatever has happened in between."""

import struct
from collections.abc import Callable, Iterator, Sequence
from random import Random

import pytest

from gateway.codes.refusals import RefusalReason
from gateway.modbus import Peer, Role
from gateway.registers import BankRules, Command, Refusal, RegisterBank, RegisterMap, Status
from gateway.registers.words import ControlBit, State
from gateway.registers.writes.proposed_write import EdgeRefusal, ProposedWrite
from tests.calibrations.coefficients import calibration
from tests.registers.conftest import memory

ROBOT = Peer("10.0.0.1", 1)
PEERS = (
    *(ROBOT,) * 6,
    Peer("10.0.0.1", 2),
    Peer("10.0.0.2", 3),
    Peer("10.0.0.1", 4, role=Role.MONITOR),
    Peer("10.0.0.1", 5, is_behind=True),
    Peer("10.0.0.1", 6, "press"),
)
FIRST_WORDS = ((1, 1200), (1, 1200), (0, 0), (1, 0), (3, 1200), (9, 1200), (33, 0), (0x4001, 100))
TAILS = (8 * (0,), (200, 0, 0, 0, 0, 500, 0, 0))
SWITCHES_OFF, REFUSES = 7, 9  # what control does at these heartbeats


OTHER_EVENTS: tuple[tuple[str, Sequence[object]], ...] = (
    ("words", [(*two, 0, 0, 0, *rest)[:count] for two in FIRST_WORDS for rest in TAILS for count in (1, 3, 5, 13)]),
    ("again", [(at, word) for at in (1, 2, 6, 10) for word in (0, 700)]),
    ("elsewhere", [1, 2, 5, 202]),
    ("coil", [(k, is_set) for k in range(7) for is_set in (False, True)]),
    ("float", (0.0, 5.0, 12.0)),
    ("state", (State.OFF, State.HOLDING, State.HOLDING, State.CALIBRATING)),
    ("clear", (None,)),
    ("release", (None,)),
    ("limit", ((0.0, 6.0), (0.0, 40.0), (13.0, 40.0))),
    ("hold", (0, 0, int(ControlBit.START_CALIBRATION))),
)


def draw_events(chance: Random) -> Iterator[tuple]:
    """A master that writes in cycles, and now and then something else."""
    for _ in range(100):
        yield from (("limit", ROBOT, (0.0, 40.0)), ("state", ROBOT, State.HOLDING), ("clear", ROBOT, None))
        yield from (("release", ROBOT, None), *(("hold", peer, 0) for peer in PEERS))
        yield "words", ROBOT, (chance.choice((0, 1, 1)), 0, 0, 0, 0, *chance.choice(TAILS))[: chance.choice((5, 13))]
        yield "again", ROBOT, (1, 1200)
        for _ in range(10):
            name, arguments = chance.choice(OTHER_EVENTS)
            if chance.random() < 0.75:
                name, arguments = "beat", range(40)
            yield name, chance.choice(PEERS), chance.choice(arguments)


class Watched:
    """A bank, and what its control was handed. has_short_way: else every write is judged at length."""

    def __init__(self, register_map: RegisterMap, *, has_short_way: bool) -> None:
        supported = ControlBit(0x7F)
        rules = BankRules(rig_name="demo", force_max_n=60.0, supported_bits=supported)
        self.now_s = 0.0
        self.bank = RegisterBank(register_map, rules, now=lambda: self.now_s)
        self.handed: list[Command] = []
        self.repeated, self._words = 0, [0] * 13
        self.bank._repeat = self._counted(self.bank._repeat) if has_short_way else lambda data, peer: False
        self.bank.on_command, self.bank.on_asked = self._use, self._judge

    def meet(self, event: tuple) -> tuple:
        """Let this happen, and return all that can be seen of the bank behind it."""
        name, peer, argument = event
        bank, said = self.bank, ""
        self.now_s += 0.1
        acts: dict[str, Callable[[], object]] = {
            "beat": lambda: self._write([*self._words[:4], argument, *self._words[5:]], peer),
            "words": lambda: self._write(list(argument), peer),
            "again": lambda: self._write(
                [argument[1] if k == argument[0] else word for k, word in enumerate(self._words)], peer
            ),
            "elsewhere": lambda: self._write(self._words[:7], peer, argument),
            "coil": lambda: bank.write_bits(argument[0], [argument[1]], peer),
            "float": lambda: bank.write_registers(202, struct.pack(">f", argument), peer),
            "state": lambda: bank.publish(Status(state=argument)),
            "clear": bank.clear_command,
            "release": bank.release_owner,
            "limit": lambda: bank.set_active_model(calibration(force_limits_n=argument)),
            "hold": lambda: bank.held_runs.keep(peer.identity, argument),
        }
        try:
            acts[name]()
        except Refusal as refusal:
            said = str(refusal)
        seen = bank.command, bank.owner, bank.owner_refused, bank.last_writer, bank.held_runs.by_host
        return said, self.handed[-2:], memory(bank), seen

    def _write(self, words: list[int], peer: Peer, address: int = 0) -> None:
        self._words = words
        self.bank.write_registers(address, struct.pack(f">{len(words)}H", *words), peer)

    def _counted(self, repeat: Callable[[bytes, Peer], bool]) -> Callable[[bytes, Peer], bool]:
        def count(data: bytes, peer: Peer) -> bool:
            is_taken = repeat(data, peer)
            self.repeated += is_taken
            return is_taken

        return count

    def _use(self, command: Command) -> None:
        self.handed.append(command)
        if command.heartbeat == SWITCHES_OFF:
            self.bank.clear_command()

    def _judge(self, asked: ProposedWrite) -> EdgeRefusal | None:
        is_refused = asked.command.heartbeat == REFUSES
        return EdgeRefusal(RefusalReason.TARE_REFUSED, ControlBit(0), f"not {asked.changes()}") if is_refused else None


@pytest.mark.sampled
@pytest.mark.parametrize("seed", range(6))
def test_a_repeated_write_ends_where_one_that_is_judged_at_length_does(register_map: RegisterMap, seed: int) -> None:
    short, long = (Watched(register_map, has_short_way=has_short_way) for has_short_way in (True, False))
    for event in draw_events(Random(seed)):
        assert short.meet(event) == long.meet(event), event
    assert short.repeated > 150


def test_the_cycles_of_a_master_go_the_short_way_from_the_third_on(register_map: RegisterMap):
    """The first is the rise of enable, the second is judged as a plain write."""
    watched = Watched(register_map, has_short_way=True)
    watched.meet(("words", ROBOT, (1, 1200, 0, 0, 0, 0, 0, 0)))
    for k in range(1, 5):
        watched.meet(("beat", ROBOT, k))
    assert watched.repeated == 3
    assert [command.heartbeat for command in watched.handed] == list(range(5))
    assert [command.number for command in watched.handed] == list(range(1, 6))
