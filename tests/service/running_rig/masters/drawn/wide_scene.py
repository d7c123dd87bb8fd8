"""Scenes with more besides: serial faces and certificates, more spellings, other leases, standstills, a page that holds."""

from collections.abc import Callable
from dataclasses import replace
from random import Random
from struct import pack

from gateway.modbus import Peer
from tests.service.running_rig.masters.drawn.programs import (
    BEAT,
    FORCE,
    FORCE_AND_BEAT,
    SILENT,
    SPELLINGS,
    WORD,
    WORD_ALONE,
    WORD_AND_FORCE,
    Frame,
    Program,
    floats_frame,
    write_mask,
)
from tests.service.running_rig.masters.drawn.scene import HAPPENINGS, PAGE, Scene
from tests.service.running_rig.simulated_rig import CALIBRATE, ENABLE, SELF_TEST, TAKE, TICK_S, SmallRig

Pile = list[tuple[Program, Frame, tuple[int, int], int]]


def _low_floats(address: int, *names: str) -> Frame:
    def write(rig: SmallRig, peer: Peer, word: int, force: int, beat: int) -> None:
        told = {"word": word, "force": force / 100, "beat": beat, "": 0}
        high_first = (pack(">f", told[name]) for name in names)
        rig.bank.write_registers(address, b"".join(value[2:] + value[:2] for value in high_first), peer)

    return write


def _mask_beat(rig: SmallRig, peer: Peer, word: int, force: int, beat: int) -> None:
    rig.bank.mask_write(4, 0, beat, peer)


def _read_and_modify(rig: SmallRig, peer: Peer, word: int, force: int, beat: int) -> None:
    """Keeps what it knows nothing of, the valve's direction say."""
    rig.write(0, rig.words(0, 1)[0] & ~(ENABLE | CALIBRATE | SELF_TEST) | word, peer=peer)


def _whole_block_as_read(rig: SmallRig, peer: Peer, word: int, force: int, beat: int) -> None:
    words = list(rig.words(0, 13))
    words[0], words[1], words[4] = word, force, beat
    rig.write(0, *words, peer=peer)


LOW_FLOATS = _low_floats(300, "word", "force")
SILENT.update({LOW_FLOATS, _read_and_modify})
WORD_ALONE.add(_read_and_modify)
WIDE_SPELLINGS: dict[str, tuple[Frame, ...]] = {
    **SPELLINGS,
    "low floats": (_low_floats(300, "word", "force", "", "", "beat"),),
    "low float force and beat, word": (_low_floats(302, "force", "", "", "beat"), WORD),
    "low floats, beat": (LOW_FLOATS, BEAT),
    "float beat, word and force": (floats_frame(208, "beat"), WORD_AND_FORCE),
    "word and force, low float beat": (WORD_AND_FORCE, _low_floats(308, "beat")),
    "force and beat, read and modify": (FORCE_AND_BEAT, _read_and_modify),
    "whole block as read": (_whole_block_as_read,),
    "masked beat, mask, force": (_mask_beat, write_mask, FORCE),
}
LEASES_S = 0.05, 0.1, 0.2, 0.35, 0.5, 1.0, 2.0


class WideScene(Scene):
    """page_beats: the page holds a force, and its heartbeat goes on; dies_behind: so many frames from now the process dies."""

    hosts = "10.0.0.5", "10.0.0.6", "plc", "robot", "serial:1", "serial:2"
    counts = 1, 2, 2, 3
    spellings = WIDE_SPELLINGS
    happenings = (
        *HAPPENINGS,
        "stands still",
        "is suspended",
        "stands still",
        "death between",
        "page holds",
        "page goes",
    )

    def __init__(self, seed: int) -> None:
        self.lease_s = Random(f"lease {seed}").choice(LEASES_S)
        self.page_beats, self.page_beat, self.dies_behind = False, 100, 0
        super().__init__(seed)
        for program in self.programs:  # by two lasting connections
            program.pools = program.may_pool and Random(f"pool {seed}").random() < 0.3
        self.told[0] += f" lease {self.lease_s}"

    def happen_elsewhere(self, name: str) -> None:
        if name in ("stands still", "is suspended"):
            self.stand_still(self.draw.choice((3, 10, 30, 60, 150, 300)), is_suspended=name == "is suspended")
        elif name == "death between":
            self.dies_behind = self.draw.choice((1, 2, 3))
        elif name == "page holds":
            self.page_beats = True
            self.from_page(lambda: self.rig.write(0, ENABLE | TAKE, 500, 0, 0, self.page_beat, peer=PAGE))
        elif name == "page goes":
            self.page_beats = False
        else:
            self.page_beats = self.page_beats and name != "stop"
            super().happen_elsewhere(name)

    def from_page(self, write: Callable[[], None]) -> None:
        self.page_beat = self.page_beat % 65535 + 1
        self.meant(PAGE.identity)
        self.answer(write)

    def tick(self) -> None:
        if self.page_beats and self.rig.ticks % max(1, round(self.lease_s / TICK_S / 4)) == 0:
            if self.rig.bank.owner == PAGE.identity:
                self.from_page(lambda: self.rig.write(4, self.page_beat, peer=PAGE))
            else:
                self.page_beats = False
        super().tick()

    def send(self, program: Program, frame: Frame) -> None:
        super().send(program, frame)
        if self.dies_behind:
            self.dies_behind -= 1
            if not self.dies_behind:
                self.told.append(f"{self.rig.now():.2f} death between")
                self.end_process("death")

    def calm(self) -> None:
        self.page_beats, self.dies_behind = False, 0
        super().calm()

    # -- standstills

    def stand_still(self, ticks: int, *, is_suspended: bool) -> None:
        """The process does not come by; suspended, its clock does not go on either."""
        self.dies_behind = 0  # who wakes and dies at once has told the next process nothing
        rig, before, began_s = self.rig, self.rig.ticks, self.rig.now()
        waits = {
            id(program): self.draw.random() < 0.5 for program in self.programs
        }  # for an answer, before it writes on
        sent: Pile = []
        cut = set[str]()
        for _ in range(ticks):
            for program in self.programs:
                for frame in program.due(rig.ticks):
                    if program.asks and not (waits[id(program)] and any(p is program for p, *_ in sent)):
                        sent.append((program, frame, program.asks, program._beat))
                    elif program.is_live:  # leaves out the rest of its cycle, its heartbeat, too
                        cut.add(program.identity)
            rig.ticks += 1
            rig.plant.advance(rig.wire.voltage_v, 10)
        self.told[-1] += f" {ticks} ({len(sent)} wait)"
        if is_suspended:
            rig.ticks, rig.suspended_s = before, rig.suspended_s + ticks * TICK_S
            for program in self.programs:
                program._due, program._next = program._due - ticks, program._next - ticks
        for host, moved_s in self.moved_s.items():
            if began_s - moved_s <= self.longest_s(host):  # what waits was sent then, and counts
                self.moved_s[host] += rig.now() - began_s
        self.moved_s.update(dict.fromkeys(cut, rig.now()))
        self.deliver(sent)
        for program in self.programs:
            program.begin_anew()

    def deliver(self, sent: Pile) -> None:
        peers = {id(program): program.peer for program in self.programs}
        for place, (program, frame, asks, beat) in enumerate(sent):
            is_behind = any(later is program for later, *_ in sent[place + 1 :])
            now = program.asks, program._beat
            program.asks, program._beat = asks, beat
            connection = peers[id(program)]
            program.peer = lambda c=connection, b=is_behind: replace(c(), is_behind=b)  # type: ignore[method-assign, misc]
            try:
                self.send(program, frame)
            finally:
                program.asks, program._beat = now
                program.peer = connection  # type: ignore[method-assign]
