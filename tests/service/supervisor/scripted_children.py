"""Control processes and rigs that live and die by a script, for the guardian in virtual time."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from gateway.processes import message_link
from tests.service.supervisor.guarded import (
    PTYS,
    READY,
    SAFE_FRAME,
    FakeChild,
    FakeStarter,
    Port,
    Scene,
    Script,
)

Step = Callable[[FakeChild], None]


def start_of(port: Port) -> list[Step]:
    """Every word of a control process from its birth to the first heartbeats, one step each."""
    handed = {"safe_frame": SAFE_FRAME.hex(), "safe_reply": "", "reply_end": ""}
    return [
        lambda child: child.say(message_link.BORN, {"pid": 1}),
        lambda child: child.say(message_link.NEED_RIG, {"rig": "demo"}),
        lambda child: child.say(message_link.LINE, handed, port.writer),
        lambda child: child.say(message_link.HEARTBEAT),
        lambda child: child.say(message_link.LINE, handed, port.writer),
        lambda child: child.say(message_link.READY, READY),
        lambda child: child.say(message_link.HEARTBEAT),
        lambda child: child.say(message_link.HEARTBEAT),
    ]


def lives(port: Port) -> Script:
    return dies_after(len(start_of(port)), port, None)


def dies_after(steps: int, port: Port, code: int | None = -9) -> Script:
    """Plays so many steps, then dies with this code (None: it only falls silent)."""

    def script(child: FakeChild) -> None:
        for step in start_of(port)[:steps]:
            step(child)
        if code is not None:
            child.dies(code)

    return script


def rig_lives(child: FakeChild) -> None:
    child.say(message_link.BORN, {"pid": 2})
    child.say(message_link.PTYS, {"ptys": PTYS})


def open_descriptors() -> int:
    return len(list(Path("/proc/self/fd").iterdir()))


@pytest.fixture
def scene(tmp_path: Path) -> Iterator[Callable[..., Scene]]:
    scenes: list[Scene] = []

    def make(*controls: Script, rigs: tuple[Script, ...] = (rig_lives,)) -> Scene:
        scenes.append(Scene(tmp_path, FakeStarter(list(controls), list(rigs))))
        return scenes[-1]

    before = open_descriptors()
    yield make
    for one in scenes:
        one.close()
    assert open_descriptors() <= before, "the guardian keeps descriptors of children that are gone"


def assert_comes_up(one: Scene) -> None:
    assert one.run(lambda: one.guardian.control.heartbeat.is_up) is None, one.said
