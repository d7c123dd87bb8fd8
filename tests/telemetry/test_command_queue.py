"""Commands that wait for control: a stop never behind others, none from before a standstill, and few at a time."""

import asyncio
from collections.abc import Awaitable, Callable

import pytest

from gateway.live.standstill import Standstill
from gateway.telemetry.mqtt.command_queue import ROOM, CommandQueue
from gateway.telemetry.mqtt.register_commands import is_stop
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
