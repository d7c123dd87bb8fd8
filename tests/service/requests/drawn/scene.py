"""Parties on all faces of one gateway ask what a seed draws; each request is judged where it is executed."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from random import Random

import pytest

from gateway.fieldbus import connection
from gateway.profiles import Rig, load_rig
from gateway.registers.words import State
from tests.service.requests.drawn.bus import Bus
from tests.service.requests.drawn.draws import READ_STATUS, STOPS, Upload, draw_request
from tests.service.requests.drawn.judging import Judge
from tests.service.requests.drawn.looks import Look, differences
from tests.service.requests.drawn.outsiders.browsers import Browsers
from tests.service.requests.drawn.outsiders.callers import Callers
from tests.service.requests.drawn.outsiders.places import Crowd
from tests.service.requests.drawn.outsiders.strangers import Strangers
from tests.service.requests.drawn.parties import KEEPER, Client, Keeper
from tests.service.requests.drawn.reference import UNITS
from tests.service.requests.drawn.tools import Tools
from tests.service.requests.drawn.world import World
from tests.service.rigs import demo, with_supervision

STEPS, PAUSES_S = 70, (0.0, 0.001, 0.003, 0.01, 0.05)
PRESSING = State.RAMPING, State.HOLDING
TOOLS, FOREIGN_UNITS = ("web", "mqtt"), (2, 7, 247, 254)
NARROW, GIVES_WAY_S = {"connections": 8, "per_address": 3, "idle_s": 1.2, "partial_s": 0.3}, 0.5
"""Bounds of a face that a crowd comes to, in a time as short as a scene's."""


def drawn_rig(draw: Random, *, is_kept: bool) -> Rig:
    owners = (None, KEEPER, KEEPER) if is_kept else (*[None] * 5, "10.0.0.5", "certificate setpoint")
    rig = load_rig("paper-pull") if draw.random() < 0.2 else demo()
    rig = with_supervision(rig, lease_s=draw.choice((None, None, 0.35)))
    network = replace(rig.network, allow_plain_upload=draw.random() < 0.5, owner=draw.choice(owners))
    return replace(rig, network=network)


class Scene:
    """first: the same scene, played before."""

    def __init__(self, seed: int, state: Path, patch: pytest.MonkeyPatch, first: "Scene | None" = None) -> None:
        self.seed, self.draw, self.beat = seed, (draw := Random(seed)), 0
        is_kept, is_narrow = draw.random() < 0.4, draw.random() < 0.5
        self.judge = Judge(first.judge if first else None)
        if is_narrow:
            patch.setattr(connection, "GIVES_WAY_S", GIVES_WAY_S)
        rig, settings = drawn_rig(draw, is_kept=is_kept), NARROW if is_narrow else {}
        self.world = world = World(state, rig, settings, patch, self.judge.judged)
        self.judge.follow(world)
        self.keeper = Keeper(world) if is_kept else None
        self.keeps = bool(self.keeper) and world.wired.state in PRESSING
        self.clients = [Client(world, *one) for one in self._drawn_clients()]
        self.crowd = Crowd(world.places, world.connect, world.clock.time) if is_narrow else None
        self.buses, self.tools = [self._bus(place) for place in range(draw.randrange(1, 3))], Tools(world, draw)
        self.strangers, self.callers = Strangers(world, draw), Callers(world, draw, patch)
        self.browsers = Browsers(world, draw, patch)
        if self.crowd:
            self.crowd.fill(draw, world.run)
        self.uploads = {one.name: Upload(draw) for one in (*self.clients, *self.buses)}

    def _bus(self, place: int) -> Bus:
        face = self.world.buses[place]
        return Bus(self.world, face, lambda: self.judge.asked.get(face.server.settings.peer.host, []))

    def _drawn_clients(self) -> list[tuple[str, str]]:
        plain = [(host, "") for host in ("10.0.0.5", "10.0.0.6", "127.0.0.1")]
        tls = [("10.0.0.9", name) for name in ("monitor", "setpoint", "calibration", "admin")]
        return self.draw.sample(plain, 2) + [*self.draw.sample(tls, 2), tls[0]][:2]

    def play(self) -> list[str]:
        try:
            for _ in range(STEPS):
                self._act()
                self.world.run(self.draw.choice(PAUSES_S))
                self._look_around()
                if self.judge.broken:
                    break
            else:
                self._end()
        finally:
            self.callers.close()
            self.browsers.close()
            self.world.close()
        return self.judge.broken

    # -- what happens

    def _act(self) -> None:
        draw = self.draw
        self.beat = self.beat % 65000 + 1
        acts: tuple[tuple[Callable[[], str], int], ...] = (
            (self._ask, 80),
            (self._ask_the_bus, 6),
            (self._overhear, 6),
            (self._come_in_crowds, 14 if self.crowd else 0),
            (lambda: self.strangers.act(self._look, _differences), 3),
            (self._call, 10),
            (lambda: self.browsers.act(self._look, _differences), 5),
            (self._ask_in_pieces, 3),
            (self._ask_many, 3),
            (self._ask_and_not_read, 1),
            (self._leave, 2),
            (self._send_no_modbus, 1),
            (self._stop, 0 if self.keeper else 5),
            (self._beats, 8),
            (self._use_tools, 14),
        )
        (act,) = draw.choices([one for one, _ in acts], [weight for _, weight in acts])
        self.judge.told.append(f"{self.world.clock.now_s:.3f} {act.__name__}")
        self.judge.told.append(f"  : {act()}")

    def _drawn(self, client: Client) -> bytes:
        pdu = draw_request(self.draw, self.beat, self.uploads[client.name])
        return READ_STATUS if self.keeper and self.judge.would_stop(pdu, client.peer) else pdu

    def _call(self) -> str:
        told = self.callers.act(self._look, _differences)
        self.judge.is_disturbed |= any(word in told for word in ("calibrat", "plant"))
        return told

    def _someone(self) -> Client:
        """One who is connected; whom a crowd keeps out waits until it may."""
        for _ in range(40):
            client = self.draw.choice(self.clients)
            if client.is_there():
                return client
            self.world.run(0.1)
        raise AssertionError("all are kept out, and silent ones give way")

    def _ask(self) -> str:
        client = self._someone()
        client.send(client.frame(self._drawn(client), self._unit()))
        return client.name

    def _unit(self) -> int:
        return self.draw.choice(FOREIGN_UNITS if self.draw.random() < 0.04 else UNITS)

    def _ask_in_pieces(self) -> str:
        client = self._someone()
        data = b"".join(client.frame(self._drawn(client)) for _ in range(self.draw.randrange(1, 4)))
        while data:
            at = self.draw.randrange(1, len(data) + 1)
            client.send(data[:at])
            data = data[at:]
            self.world.run(self.draw.choice((0.0, 0.001, 0.01)))
            client.owed = type(client.owed)((self.world.clock.now_s, *rest) for _, *rest in client.owed)
        client.collect()
        return client.name

    def _ask_many(self) -> str:
        """More at once than are answered in one turn, or one by one more than its address may."""
        client, count = self._someone(), self.draw.choice((5, 20, 44, 70))
        frames = [client.frame(self._drawn(client)) for _ in range(count)]
        for data in frames if count == 70 else (b"".join(frames),):
            client.send(data)
        return f"{client.name} {count}"

    def _ask_and_not_read(self) -> str:
        client = self._someone()
        client.reads = False
        client.forgive()
        for _ in range(40):
            client.send(b"".join(client.frame(bytes.fromhex("030064001f")) for _ in range(8)))
            self.world.run(0.005)
            other = self.draw.choice([one for one in self.clients if one is not client])
            if other.is_there():
                other.send(other.frame(bytes.fromhex("0300640010")))
            self.judge.judge_bounds()
        client.reads = True
        client.wire.close()
        client.connect()
        return client.name

    def _leave(self) -> str:
        client = self._someone()
        return f"{client.name} {client.leave(self.draw)}"

    def _send_no_modbus(self) -> str:
        client = self._someone()
        client.forgive()
        speak = client.wire.send_raw if client.certificate and self.draw.random() < 0.5 else client.send
        speak(
            self.draw.choice((b"\0\1\0\1\0\6", b"\0\1\0\0\0\1", b"\0\1\0\0\xff\xff", b"GET / HTTP/1.1\r\n")) + bytes(8)
        )
        self.world.run(0.3)
        client.collect()
        if not client.is_closed:
            self.judge.broken.append(f"{client.name} sends no Modbus and is still connected")
        client.wire.close()
        client.connect()
        return client.name

    def _of_bus(self, bus: Bus) -> bytes:
        pdu = draw_request(self.draw, self.beat, self.uploads[bus.name])[:253]
        return READ_STATUS if self.keeper and self.judge.would_stop(pdu, bus.peer) else pdu

    def _ask_the_bus(self) -> str:
        draw, bus = self.draw, self.draw.choice(self.buses)
        pdu = self._of_bus(bus)
        noise = draw.randbytes(draw.randrange(1, 20)) if draw.random() < 0.2 else b""
        cuts = tuple(draw.random() for _ in range(draw.choice((0, 0, 1, 2))))
        bus.ask(pdu, draw.choice((*[bus.unit] * 7, 0, 9)), noise, cuts)
        return f"{bus.name} {pdu.hex()}"

    def _overhear(self) -> str:
        bus = self.draw.choice(self.buses)
        return bus.overhear(self.draw, self._of_bus(bus))

    def _come_in_crowds(self) -> str:
        return self.crowd.act(self.draw, self.world.run) if self.crowd else ""

    def _look(self) -> tuple[Look, int]:
        """And how many requests of masters have been executed."""
        return self.judge.look(), sum(len(done) for who, done in self.judge.asked.items() if who not in TOOLS)

    def _beats(self) -> str:
        """Whoever owns lives a while."""
        for client in self.clients:
            if client.peer.identity == self.world.bank.owner and client.is_there():
                for _ in range(self.draw.randrange(2, 7)):
                    self.beat = self.beat % 65000 + 1
                    client.send(client.frame(b"\6\0\4" + self.beat.to_bytes(2, "big")))
                    self.world.run(0.1)
                return client.name
        self.world.run(0.2)
        return "nobody"

    def _stop(self) -> str:
        """Whoever owns, and whatever goes on: who may command at all may end it, now."""
        draw = self.draw
        clients = [one for one in self.clients if one.role > 0 and one.is_there() and not one.owed]
        pdu, by = draw.choice(STOPS), draw.choice((*clients, self.buses[0], "web", "http", "mqtt"))
        name = by if isinstance(by, str) else by.name
        if isinstance(by, Client):
            by.send(by.frame(pdu))
        elif isinstance(by, Bus):
            by.ask(pdu, draw.choice((by.unit, 0)))
        else:
            self.browsers.stop() if by == "http" else self.tools.stop(by)
        if not any(one.owed for one in self.clients):  # else what has waited may begin anew behind it
            self._judge_stopped(name)
        return f"{name} {pdu.hex()}"

    def _judge_stopped(self, by: str) -> None:
        state, word = State(self.world.wired.word("state")), self.world.wired.word("control_word")
        volts = self.world.wired.loop.decision.voltage_v  # type: ignore[union-attr]
        if word & 1 or state in (State.RAMPING, State.HOLDING) or (state is not State.CALIBRATING and volts):
            self.judge.broken.append(f"{by} has stopped, and it is {state.name} with {word:#x} at {volts:.3f} V")

    def _use_tools(self) -> str:
        told = self.tools.act(self.judge.look, differences)
        self.judge.is_disturbed |= self.tools.disturbs
        return told

    def _look_around(self) -> None:
        for client in self.clients:
            client.collect()
            client.judge_time()
        self.callers.judge_soon()
        self.browsers.judge_soon()
        if self.crowd:
            self.crowd.look()
        faces = (self.tools, self.strangers, self.callers, self.browsers, self.world.places, self.world.secure_places)
        for one in (*self.clients, *self.buses, *faces):
            self.judge.broken += one.broken
        if self.keeper:
            self.keeper.judge_time()
            self.judge.broken += self.keeper.broken
            if self.keeps and not self.judge.is_disturbed and (state := self.world.wired.state) not in PRESSING:
                self.judge.broken.append(
                    f"the force of who keeps it is gone: {state.name}, {self.world.wired.log[-3:]}"
                )
        self.judge.look_around()

    def _end(self) -> None:
        for _ in range(15):  # whoever has asked more than its address may waits for its turn
            self.world.run(0.2)
            self._look_around()
            if not any(one.owed for one in self.clients):
                break
        self.judge.end()
        owed = [one for one in self.clients if one.owed and not one.is_closed]
        self.judge.broken += [f"{one.name} is owed {len(one.owed)} answers" for one in owed]


def _differences(before: tuple[Look, int], after: tuple[Look, int]) -> list[str]:
    """Where a master's request was executed meanwhile, which had waited, nobody can say whose they are."""
    return differences(before[0], after[0]) if before[1] == after[1] else []


def told(scene: Scene) -> str:
    return json.dumps([f"seed {scene.seed}", *scene.judge.told[-8:], *scene.judge.broken[:4]], indent=1)
