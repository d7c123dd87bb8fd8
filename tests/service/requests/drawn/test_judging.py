"""Each law of who judges requests is broken by one record at least, and complained of; what is right breaks none."""

from collections.abc import Callable
from struct import pack
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.modbus import Peer
from gateway.registers.words import State
from tests.service.requests.drawn.judging import Executed, Judge
from tests.service.requests.drawn.looks import Look
from tests.service.requests.drawn.outsiders.browsers import Browsers
from tests.service.requests.drawn.reference import OK, Verdict
from tests.service.requests.drawn.scene import Scene

HOST, OTHER = "10.0.0.5", "10.0.0.9"
PEER = Peer(HOST, 4000)
ASKED = 1.0, str(PEER), None, b"\x03\x00\x64\x00\x01"
READ = bytes(2)
STAGED = b"\x10\x04\x4c\x00\x01\x02\x12\x34"
PLACE = 0x044C


def look(owner: str | None = None, writers: dict[str, Any] | None = None, words: dict[int, int] | None = None) -> Look:
    """Registers that are all 0 but for these."""
    data = bytearray(2 * 1200)
    for place, word in (words or {}).items():
        data[2 * place : 2 * place + 2] = pack(">H", word)
    return Look(bytes(data), owner, writers or {}, 0.0, "")


class Told(Judge):
    """Of a world that is only what is told of it."""

    def __init__(self, first: Judge | None = None, *, waiting: int = 0, force_n: float = 0.0, role: int = 1) -> None:
        super().__init__(first)
        told = {"force": dict.fromkeys(("accepted_n", "applied_n", "requested_n", "voltage_v", "trim_v"), force_n)}
        stage = SimpleNamespace(ask=lambda _: told | {"owner": None}, said=[], state="")
        connection = SimpleNamespace(_framer=bytes(waiting), _transport=SimpleNamespace(_waiting=b""), peer=PEER)
        self._world: Any = SimpleNamespace(
            clock=SimpleNamespace(now_s=1.0), stage=stage, errors=[], connections=[connection], plain_role=role,
            wired=SimpleNamespace(word=lambda _: 0),
        )  # fmt: skip
        self._bank: Any = SimpleNamespace(read_registers=lambda *_: READ)
        self._writes: Any = SimpleNamespace(close=lambda: None)

    def asked_often(self) -> "Told":
        for _ in range(60):
            self._note_asked(PEER, ASKED[3])
        return self

    def shown(self, name: str, *given: Any) -> "Told":
        """One law asked of this record."""
        getattr(self, name)(*given)
        return self

    def accepted(self, after: Look, verdict: Verdict) -> "Told":
        return self.shown("_judge_accepted", PEER, verdict, (look(), after), "so")


def again(executed: list[Executed], *, is_asked: bool = True) -> Told:
    """A second play, behind one in which that was executed."""
    first = Told()
    first.executed = executed
    return Told(first).shown("_was", ASKED) if is_asked else Told(first).shown("end")


def audited(**line: Any) -> Told:
    told = Told()
    told.audit.lines.append({"what": "enable", "peer": str(PEER), "result": "accepted"} | line)
    return told.shown("end")


def unaudited() -> Told:
    told = Told()
    told.audit.note_refused(PEER)
    return told.shown("end")


ANOTHER = Executed((2.0, *ASKED[1:]), b"", False)
WRITTEN = Verdict(OK, [0.0] * 16, 0, is_write=True)
LAWS: list[tuple[str, Callable[[], Told]]] = [
    ("requests more than it may ask", lambda: Told().asked_often()),
    ("the plays are not the same", lambda: again([ANOTHER])),
    ("0 are executed, and were 1", lambda: again([ANOTHER], is_asked=False)),
    ("the registers tell reason 0", lambda: Told().shown("_judge_reason", ASKED[3], "so")),
    ("are told to be another's", lambda: Told().accepted(look(writers={"mode": (Peer(OTHER, 1),)}), WRITTEN)),
    ("a monitor writes", lambda: Told(role=0).accepted(look(), WRITTEN)),
    ("by the rules", lambda: Told().accepted(look(words={200: 0x4120}), WRITTEN)),
    ("is not staged", lambda: Told().shown("_judge_places", STAGED, (look(), look()), "so")),
    ("changes [1101], too", lambda: Told().shown(
        "_judge_places", STAGED, (look(), look(words={PLACE: 0x1234, 1101: 1})), "so")),
    ("reads another state", lambda: Told().shown("_judge_read", ASKED[3], b"\x03\x02\x00\x01", look(), "so")),
    ("the state in words tells", lambda: Told(force_n=1.0).shown("_judge_live", look())),
    ("owner_ip is 0", lambda: Told().shown("_judge_owner", look(owner=HOST))),
    ("owner_ip is a000005, and 0.0.0.0", lambda: Told().shown("_judge_owner", look(words={116: 0x0A00, 117: 5}))),
    ("bytes are held", lambda: Told(waiting=99999).shown("judge_bounds")),
    ("'enable') is told 1 times, and was 0", audited),
    ("'refused') is told 0 times, and was 1", unaudited),
]  # fmt: skip


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law[0])
def test_each_law_of_requests_can_be_broken(law: tuple[str, Callable[[], Told]]) -> None:
    words, play = law
    broken = play().broken
    assert any(words in sentence for sentence in broken), broken


def test_what_is_right_breaks_no_law() -> None:
    told = Told().accepted(look(), WRITTEN).shown("_judge_owner", look(HOST, words={116: 0x0A00, 117: 5}))
    told.shown("_judge_live", look()).shown("judge_bounds").shown(
        "_judge_read", ASKED[3], b"\x03\x02" + READ, look(), ""
    )
    told.shown("_judge_places", STAGED, (look(), look(words={PLACE: 0x1234})), "").shown("_was", ASKED).shown("end")
    assert told.broken == audited(what="stop").broken == []


@pytest.mark.parametrize(("statuses", "is_seen"), [([200], False), ([], True), ([503], True), ([200, 200], True)])
def test_a_stop_by_http_is_answered_once_and_well(statuses: list[int], is_seen: bool) -> None:
    browser = SimpleNamespace(asked=0, statuses=[])
    shown: Any = SimpleNamespace(
        broken=[], _there=[browser], _come=lambda: browser, _leave=lambda _: None, _turn=lambda: None,
        _send=lambda one, data: one.statuses.extend(statuses if b"command/stop" in data else []),
    )  # fmt: skip
    Browsers.stop(shown)
    assert [sentence.startswith("a Stop by HTTP is answered") for sentence in shown.broken] == [True] * is_seen


@pytest.mark.parametrize(
    ("state", "word", "volts", "is_seen"),
    [
        (State.OFF, 0, 0.0, False),
        (State.CALIBRATING, 0, 1.0, False),  # on its way to 0
        (State.OFF, 1, 0.0, True),
        (State.OFF, 0, 0.5, True),
        (State.RAMPING, 0, 0.0, True),
        (State.HOLDING, 0, 0.0, True),
    ],
)
def test_a_stop_that_does_not_stop_is_seen(state: State, word: int, volts: float, is_seen: bool) -> None:
    words = {"state": int(state), "control_word": word}
    loop = SimpleNamespace(decision=SimpleNamespace(voltage_v=volts))
    shown: Any = SimpleNamespace(world=SimpleNamespace(wired=SimpleNamespace(word=words.get, loop=loop)), judge=Told())
    Scene._judge_stopped(shown, "http")
    assert [sentence.startswith("http has stopped") for sentence in shown.judge.broken] == [True] * is_seen
