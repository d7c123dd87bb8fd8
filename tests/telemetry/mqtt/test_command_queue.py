"""Commands that wait for control: a stop never behind others, none from before a standstill, and few at a time."""

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

import pytest

from gateway.live.standstill import Standstill
from gateway.profiles import load_rig
from gateway.telemetry.mqtt.command_queue import ROOM, CommandQueue
from gateway.telemetry.mqtt.register_commands import RegisterCommands, is_stop
from gateway.telemetry.mqtt.round_trips import RoundTrips


class Clock:
    def __init__(self) -> None:
        self.now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


def play(scene: Callable[[CommandQueue, Clock], Awaitable[None]]) -> None:
    async def run() -> None:
        clock = Clock()
        standstill = Standstill(clock)
        keeping = asyncio.create_task(standstill.keep_time())
        await asyncio.sleep(0.0)
        async with asyncio.timeout(5.0):
            trips = RoundTrips(clock)
            await scene(CommandQueue(lambda payload: payload == b"stop", standstill, trips), clock)
        keeping.cancel()

    asyncio.run(run())


async def drained(queue: CommandQueue) -> list[bytes]:
    queue.put("end", b"end")
    taken = []
    while (message := (await queue.get())[0]).topic != "end":
        taken.append(message.payload)
    return taken


def test_a_stop_goes_before_all_that_wait() -> None:
    """They would be undone by it; and whoever sends faster than control takes waits for minutes."""

    async def scene(queue: CommandQueue, clock: Clock) -> None:
        for payload in (b"1", b"2", b"stop", b"3"):
            queue.put("command", payload)
        assert await drained(queue) == [b"stop", b"3"]
        assert (queue.take_dropped(), queue.take_dropped()) == (2, 0)

    play(scene)


def test_of_more_than_there_is_room_for_the_oldest_go_and_never_a_stop() -> None:
    async def scene(queue: CommandQueue, clock: Clock) -> None:
        for number in range(5 * ROOM):
            queue.put("command", b"%d" % number)
        assert await drained(queue) == [b"%d" % number for number in range(4 * ROOM + 1, 5 * ROOM)]
        queue.put("command", b"stop")
        for number in range(5 * ROOM):
            queue.put("command", b"%d" % number)
        assert (await drained(queue))[:2] == [b"stop", b"%d" % (4 * ROOM + 2)]
        assert queue.take_dropped() == 4 * ROOM + 1 + 4 * ROOM + 2

    play(scene)


def test_what_came_while_the_process_stood_still_presses_nothing_and_a_stop_stops() -> None:
    """Frozen for four seconds, as by a machine that swaps: a command from before would press when nobody expects it."""

    async def scene(queue: CommandQueue, clock: Clock) -> None:
        queue.put("command", b"1")
        assert (await queue.get())[1] == ""
        clock.now_s = 4.0
        queue.put("command", b"2")
        assert "stood still" in (await queue.get())[1]
        clock.now_s = 4.4
        queue.put("command", b"3")
        assert "stood still" in (await queue.get())[1], "a piece that the kernel hands over later"
        queue.put("command", b"stop")
        assert (await queue.get())[1] == ""
        clock.now_s = 4.6
        queue.put("command", b"4")
        assert (await queue.get())[1] == ""

    play(scene)


@pytest.mark.parametrize(
    ("payload", "stops"),
    [
        (b'{"control_word": 0}', True),
        (b'{"control_word@float_abcd": 0.0}', True),
        (b'{"control_word": 2}', False),  # a reset wants the heartbeat that came before it
        (b'{"control_word": 0, "control_word@float_abcd": 1}', False),
        (b'{"force_setpoint": 0, "control_word": 0}', True),
        (b'{"force_setpoint": 30, "control_word": 0}', True),
        (b'{"force_ramp": 30, "control_word": 0}', True),
        (b'{"heartbeat": 7, "control_word": 0}', True),  # as whoever commands a rig with a lease sends it
        (b'{"heartbeat@float_abcd": 7, "force_setpoint": 0, "control_word": 0}', True),
        (b'{"heartbeat": 7}', False),
        (b'{"force_setpoint": 0}', False),
        (b"{}", False),
        (b"[", False),
        (b"\xff", False),
    ],
)
def test_a_stop_is_what_clears_the_control_word_whatever_stands_beside_it(payload: bytes, stops: bool) -> None:
    assert is_stop(payload) is stops


def test_who_waits_for_the_next_message_lets_others_run() -> None:
    """Also behind one that has come: else nothing else would ever happen in this process."""

    async def scene(queue: CommandQueue, clock: Clock) -> None:
        waits, wait = 0, queue._ready.wait

        async def counted() -> bool:
            nonlocal waits
            waits += 1
            assert waits < 10, "it asks without end"
            return await wait()

        queue._ready.wait = counted  # type: ignore[method-assign]
        queue.put("command", b"1")
        assert (await queue.get())[0].payload == b"1"
        waiting = asyncio.create_task(queue.get())
        await asyncio.sleep(0.0)
        queue.put("command", b"2")
        assert (await waiting)[0].payload == b"2"

    play(scene)


class Control:
    """Refuses each write that enables; of the block it reads 0.01 N, ramp 0x0102, mode 0 and so on."""

    def __init__(self) -> None:
        self.asked: list[str] = []

    async def ask(self, request: dict[str, Any]) -> dict[str, Any]:
        pdu = request["pdu"]
        self.asked.append(pdu)
        if pdu.startswith("03"):
            count = int(pdu[6:10], 16)
            return {"pdu": f"03{2 * count:02x}" + "".join(f"01{place:02x}" for place in range(count))}
        return {"pdu": "9004", "refusal": "W212 a fault is latched"} if pdu.endswith("020001") else {"pdu": pdu[:10]}


@pytest.mark.parametrize(
    ("payload", "written", "pdus"),
    [
        (b'{"force_setpoint": 12.0, "control_word": 1}', True, ["100000000204" + "0001" + "04b0"]),
        (b'{"control_word": 1, "force_setpoint": 12.0}', True, ["100000000204" + "0001" + "04b0"]),
        (
            b'{"control_word@float_abcd": 1, "force_setpoint@float_abcd": 12}',
            True,
            ["1000c8000408" + "3f800000" + "41400000"],
        ),
        (  # what lies between them stays as it is
            b'{"force_setpoint": 12, "heartbeat": 7, "control_word": 1}',
            True,
            ["0300000005", "10000000050a" + "0001" + "04b0" + "0102" + "0103" + "0007"],
        ),
        (  # a proof of byte order goes before the enable that wants it, wherever the setpoint stands
            b'{"force_setpoint": 12, "byte_order_echo": 1234.5, "control_word": 1}',
            True,
            ["1001a0000204" + "449a5000", "100000000204" + "0001" + "04b0"],
        ),
        (b'{"control_word": 1}', False, ["100000000102" + "0001"]),
        (b'{"force_setpoint": 12, "no_such": 1}', False, []),
        (b'{"force_setpoint": 12, "force_setpoint@command": 30}', False, []),
    ],
)
def test_a_command_is_taken_as_a_whole_or_leaves_nothing_behind(payload: bytes, written: bool, pdus: list[str]) -> None:
    """Word by word a refused enable left its setpoint, and with it the owner: no robot could reset the fault (06)."""
    control = Control()
    commands = RegisterCommands(load_rig("demo").register_map, control, 1)  # type: ignore[arg-type]
    answer = asyncio.run(commands.carry_out(payload))
    assert (answer["ok"], control.asked) == (written, pdus)
