"""What the page may do to the force: Modbus requests of the master `web`, checked, owned and audited as any other's.

A rig with a lease wants a heartbeat. The browser that commands says once a second that it is there; while it does, this process
changes the heartbeat register four times in a lease. When the browser goes (closed, asleep, off the network), the beat ends
within GRACE_S (RELOAD_S where its connection has closed) and the lease does its work: no force is held for nobody. A reload
within that time loses nothing. A command that was refused makes nobody the commander, and who is overtaken ceases to be it.
While the output is off no lease counts: a beat that finds it so is the last one, or the next master's would meet it (W210).

Disabling is granted to every master, whoever owns the setpoint, and to nobody else's harm: that is what `stop` is. It ends an
enable that is on its way, too: that one asks before it writes, and whoever pressed Esc meanwhile wants no force after it.
"""

import asyncio
import contextlib
import struct
import time
from collections.abc import Awaitable, Callable
from math import isfinite
from typing import Any, Final

from gateway.defaults import BEATS_PER_LEASE
from gateway.live.control_link import ANSWER_S, ControlLink
from gateway.modbus import pdu as P  # noqa: N812
from gateway.registers.map.register_map import Register
from gateway.registers.words import ControlBit, Mode, StatusBit
from gateway.registers.writes.byte_order_echo import PROOF
from gateway.web.context import WebContext

GRACE_S: Final = 2.5
RELOAD_S: Final = 1.5
_REFUSED_BEATS: Final = 8
"""In a row: another master has the setpoint. More of them would fill its refusal registers and the log for as long as the
browser stays open."""
_MOST_WORDS: Final = 120
Words = dict[str, list[int]]


class RefusedCommand(ValueError):  # noqa: N818  reads as what it is
    """The gateway refused; the sentence is its own."""


class Commands:
    """clock: monotonic seconds; sleep: waits for seconds of it. commander: the browser that enabled last, empty for none."""

    def __init__(
        self,
        context: WebContext,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], Awaitable[None]] = asyncio.sleep,
    ) -> None:
        self.commander = ""
        self._context, self._clock, self._sleep = context, clock, sleep
        self._seen_s = -GRACE_S
        self._present: set[str] = set()
        self._beat: asyncio.Task[None] | None = None
        self._number = 0
        self._stops = self._commanded = 0  # told so far

    # -- who is there

    def join(self, viewer: str) -> None:
        """Note that a browser has opened the stream of events."""
        self._present.add(viewer)
        self.note_alive(viewer)

    def leave(self, viewer: str) -> None:
        """Note that a browser's last stream has ended: it is being reloaded, or gone."""
        self._present.discard(viewer)
        if viewer == self.commander:
            self._seen_s = min(self._seen_s, self._clock() - (GRACE_S - RELOAD_S))

    def note_alive(self, viewer: str) -> None:
        """Note that a browser has said that it is there."""
        if viewer and viewer == self.commander and viewer in self._present:
            self._seen_s = self._clock()

    @property
    def is_attended(self) -> bool:
        """Decide whether the browser that commands is still there."""
        return self._clock() - self._seen_s < GRACE_S

    # -- what it wants

    async def enable(self, viewer: str, force_n: float) -> None:
        """Enable, with this setpoint, and with another heartbeat where there is a lease: behind a loss, or another one's stop,
        nothing else counts. RefusedCommand says why not."""
        stops = self._stops
        if self._context.profile.network.require_byte_order_echo:
            await self._write("byte_order_echo@proof", PROOF)
        lease_s = self._context.profile.control.supervision.lease_s
        words = await self._words_of_force(force_n, beats=lease_s is not None)
        if stops != self._stops:
            raise RefusedCommand("stopped meanwhile: nothing was enabled")
        words[0] |= int(ControlBit.ENABLE)
        await self._write_words("control_word", words)
        if stops == self._stops:  # else the stop is right behind it
            self._begin_to_beat(viewer)

    async def set_force(self, viewer: str, force_n: float) -> None:
        """Change the setpoint, N, of an output that is enabled. A stop told meanwhile, or by another master, is the end of it:
        the page would own a force that nobody wants, and keep other masters out."""
        stops = self._stops
        words = await self._words_of_force(force_n)
        if stops != self._stops or not words[0] & ControlBit.ENABLE:
            why = "stopped meanwhile" if stops != self._stops else "the output is not enabled"
            raise RefusedCommand(f"{why}: nothing was set")
        await self._write_words("force_setpoint", words[1:])
        if stops == self._stops:
            self._begin_to_beat(viewer)

    async def stop(self) -> None:
        """Switch the output off, whoever owns the setpoint; ends a run, too. The safe voltage is out before the answer."""
        self._stops += 1
        self._end_beat()
        self.commander = ""
        await self._send(P.write_registers_request(self._find("control_word").address, bytes(2)), is_stop=True)

    async def take_ownership(self, viewer: str) -> None:
        """Take the setpoint over from whoever owns it, whose heartbeat, once more, would be no beat of the page."""
        stops = self._stops
        await self._set_bit(ControlBit.TAKE_OWNERSHIP)
        words = await self.words("command")
        if stops == self._stops:
            self._number = words[self._find("heartbeat").address - self._find("control_word").address]
            self._begin_to_beat(viewer)

    async def reset(self) -> None:
        """Reset a latched fault: with setpoint 0 and another heartbeat, all in one write. Where somebody presses again
        meanwhile it is refused, and stops nobody."""
        first, beat = self._find("control_word").address, self._find("heartbeat").address
        words = (await self.words("command"))[: beat + 1 - first]
        words[0], words[self._find("force_setpoint").address - first] = int(ControlBit.RESET_FAULT), 0
        words[-1] = self._number = words[-1] % 65535 + 1
        await self._write_words("control_word", words)

    async def tare(self) -> None:
        """Take the force that rests on the cell now as 0."""
        await self._set_bit(ControlBit.TARE)

    async def beat_once(self) -> bool:
        """Change the heartbeat register; return whether the output is enabled behind it."""
        self._number = self._number % 65535 + 1
        beat, status = self._find("heartbeat"), self._find("status_word")
        data = self._encode(beat, self._number)
        answer = await self._send(P.read_write_request(status.address, 1, beat.address, data))
        return bool(int.from_bytes(answer[2:4], "big") & StatusBit.ENABLED)

    async def words(self, block: str, link: ControlLink | None = None) -> list[int]:
        """Return the registers of a block as they are now. link: way to control's socket, None for that of the commands."""
        place = self._context.profile.register_map.block(block)
        words: list[int] = []
        for first in range(place.first, place.last + 1, _MOST_WORDS):
            count = min(_MOST_WORDS, place.last + 1 - first)
            answer = await self._send(P.read_request(P.READ_HOLDING_REGISTERS, first, count), link=link)
            words += struct.unpack(f">{count}H", answer[2:])
        return words

    async def close(self) -> None:
        """End the heartbeat."""
        beat, self._beat = self._beat, None
        if beat:
            beat.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await beat

    # -- as requests

    def _checked(self, force_n: float) -> float:
        if not isfinite(force_n):
            raise RefusedCommand("a force in newtons is expected")
        return force_n

    async def _words_of_force(self, force_n: float, *, beats: bool = False) -> list[int]:
        """Return control_word, with the bits that stand, and force_setpoint; where another master has left voltage for a mode,
        in which a force would mean nothing, what lies between them and force as mode as well: all for one write. beats: and
        what lies between them and another heartbeat."""
        setpoint = self._encode(self._find("force_setpoint"), self._checked(force_n))
        first = self._find("control_word").address
        place, beat = self._find("mode").address - first, self._find("heartbeat").address - first
        words = await self.words("command")
        words[1], is_force = int.from_bytes(setpoint, "big"), words[place] == Mode.FORCE
        words[place] = int(Mode.FORCE)
        if beats:
            self._number = self._number % 65535 + 1
            if self._number == words[beat]:
                self._number = self._number % 65535 + 1
            words[beat] = self._number
            return words[: beat + 1]
        return words[: 2 if is_force else place + 1]

    async def _write_words(self, name: str, words: list[int]) -> None:
        """Write a row of registers that begins with this one."""
        data = struct.pack(f">{len(words)}H", *words)
        await self._send(P.write_registers_request(self._find(name).address, data))

    async def _set_bit(self, bit: ControlBit) -> None:
        address = self._find("control_word").address
        await self._send(P.mask_write_request(address, 0xFFFF & ~int(bit), int(bit)))

    async def _write(self, name: str, value: float) -> None:
        register = self._find(name)
        await self._send(P.write_registers_request(register.address, self._encode(register, value)))

    def _encode(self, register: Register, value: float) -> bytes:
        try:
            return register.encode(value)
        except (ValueError, OverflowError, struct.error):
            raise RefusedCommand(
                f"{register.name} = {value:g} {register.unit}: {register.minimum:g} .. {register.maximum:g} can be sent"
            ) from None

    def _find(self, name: str) -> Register:
        return self._context.profile.register_map.find(name)

    async def _send(self, pdu: bytes, *, is_stop: bool = False, link: ControlLink | None = None) -> bytes:
        unit = self._context.profile.network.units[0]
        request: dict[str, Any] = {"do": "modbus", "via": "web", "unit": unit, "pdu": pdu.hex()}
        if not is_stop:
            request["until_s"] = self._clock() + ANSWER_S
        answer = await (link or self._context.control).ask(request)
        pdu = bytes.fromhex(answer["pdu"])
        if P.is_exception(pdu):
            raise RefusedCommand(str(answer.get("refusal") or f"refused with exception {pdu[1]:02d}"))
        return pdu

    # -- the lease

    def _begin_to_beat(self, viewer: str) -> None:
        self.commander = viewer
        self._commanded += 1
        self._seen_s = self._clock()
        lease_s = self._context.profile.control.supervision.lease_s
        if lease_s is not None and (self._beat is None or self._beat.done()):
            self._beat = asyncio.create_task(self._keep_beating(lease_s / BEATS_PER_LEASE))

    def _end_beat(self) -> None:
        if self._beat:
            self._beat.cancel()
            self._beat = None

    async def _keep_beating(self, every_s: float) -> None:
        refused = 0
        while self.is_attended and refused < _REFUSED_BEATS:
            commanded = self._commanded
            try:
                if not await self.beat_once() and commanded == self._commanded:
                    return
                refused = 0
            except RefusedCommand:
                refused += 1
            except (OSError, ValueError):  # a control that is being restarted
                pass
            await self._sleep(every_s)
        if refused >= _REFUSED_BEATS:
            self.commander = ""
