"""The guardian's part in the simulated rig: never two, control learns where it is, and in the end it is given up."""

import errno
from collections.abc import Iterator
from math import inf

import pytest

from gateway.processes import message_link
from gateway.service.supervisor.event_wait import wait_readable
from gateway.service.supervisor.simulated_rig_child import PAUSES_S, RigSupervisor
from tests.service.supervisor.guarded import PTYS, FakeChild
from tests.service.supervisor.scripted_children import open_descriptors

LONGEST_START_S = 20.0
NOW_S = 1e6  # the machine has run for days


class Rigs:
    """What was started, and what was said: to control, and to people."""

    def __init__(self) -> None:
        self.started: list[FakeChild] = []
        self.prepared: list[bool] = []
        self.told: list[dict] = []
        self.said: list[str] = []
        self.error: OSError | None = None
        self.one = RigSupervisor(self._spawn, self.told.append, self.said.append)

    def _spawn(self, prepared: bool) -> FakeChild:
        self.prepared.append(prepared)
        if self.error:
            raise self.error
        self.started.append(FakeChild(2000 + len(self.started)))
        return self.started[-1]

    def comes_up(self, now_s: float = NOW_S, **more: object) -> None:
        self.started[-1].say(message_link.BORN, {"pid": 1})
        self.started[-1].say(message_link.PTYS, {"ptys": PTYS, **more})
        self.hears(now_s)
        self.hears(now_s)

    def hears(self, now_s: float = NOW_S) -> None:
        self.one.poll_child(wait_readable(self.one.sources, 0.0), now_s)

    def dies(self, now_s: float, code: int = -9) -> None:
        self.started[-1].dies(code)
        self.hears(now_s)


@pytest.fixture
def rigs() -> Iterator[Rigs]:
    before = open_descriptors()
    rigs = Rigs()
    yield rigs
    rigs.one.end()
    assert rigs.started == [] or rigs.started[-1].exit_code is not None
    for child in rigs.started:
        child.theirs.close()
        child.dies(0)
    assert open_descriptors() == before


def test_whoever_asks_learns_the_ports_and_there_is_one_rig(rigs: Rigs) -> None:
    """A control process that is started again finds the force as it was."""
    rigs.one.ask(NOW_S)
    rigs.one.ask(NOW_S)
    assert rigs.told == []
    rigs.comes_up(pid=77)
    rigs.one.ask(NOW_S + 1.0)
    assert rigs.told == [{"ptys": PTYS, "pid": 77}] * 2
    assert len(rigs.started) == 1
    assert rigs.one.due_s == inf
    rigs.one.poll_child(set(), NOW_S + 1000.0)
    assert rigs.started[0].exit_code is None, "it lives, and is not overdue"


def test_a_rig_without_ports_in_time_is_killed_and_started_again(rigs: Rigs) -> None:
    rigs.one.ask(NOW_S)
    rigs.started[0].attach(0)
    rigs.one.poll_child(set(), NOW_S + LONGEST_START_S - 0.01)
    assert rigs.started[0].exit_code is None
    rigs.one.poll_child(set(), NOW_S + LONGEST_START_S)
    assert rigs.started[0].exit_code == -9
    assert "no ports within 20 s" in rigs.said[0]
    rigs.one.poll_child(set(), NOW_S + LONGEST_START_S + PAUSES_S[0])
    assert len(rigs.started) == 2
    assert rigs.prepared == [True, False], "the next one reads its files itself"


def test_while_it_is_away_nobody_is_sent_to_where_it_was(rigs: Rigs) -> None:
    rigs.one.ask(NOW_S)
    rigs.comes_up()
    rigs.told.clear()
    rigs.dies(NOW_S + 100.0)
    rigs.one.ask(NOW_S + 100.0)
    assert len(rigs.started) == 1, "not before its pause is over"
    rigs.one.poll_child(set(), NOW_S + 100.0 + PAUSES_S[0])
    rigs.one.ask(NOW_S + 101.0)
    assert (rigs.told, len(rigs.started)) == ([], 2)
    rigs.comes_up(NOW_S + 101.0)
    assert rigs.told == [{"ptys": PTYS}]
    assert rigs.prepared == [True, True], "the first one has worked"


@pytest.mark.parametrize(
    "nonsense", [b"y[1]", b'b{"pid": 1e999}', b'y{"ptys": 3}', b"y" + b'{"a":' * 2000 + b"}" * 2000]
)
def test_a_rig_that_talks_nonsense_is_killed(rigs: Rigs, nonsense: bytes) -> None:
    rigs.one.ask(NOW_S)
    rigs.started[0].theirs.send(nonsense)
    rigs.hears()
    assert rigs.started[0].exit_code == -9
    assert "made no sense" in rigs.said[0]
    assert rigs.one.due_s == NOW_S + PAUSES_S[0]


@pytest.mark.parametrize("is_born", [True, False])
def test_the_end_of_its_line_is_a_death_where_there_was_no_birth(rigs: Rigs, is_born: bool) -> None:
    """Of a born one the exit code follows; until then its line is nothing to wait for."""
    rigs.one.ask(NOW_S)
    if is_born:
        rigs.comes_up()
    rigs.started[0].theirs.close()
    rigs.hears()
    assert (rigs.said == []) is is_born
    if is_born:
        assert rigs.one.sources == [rigs.started[0].died]
        rigs.dies(NOW_S)
    assert len(rigs.said) == 1
    rigs.one.poll_child(set(), NOW_S + PAUSES_S[0])
    assert rigs.one.sources[0] == rigs.started[1].link.fileno(), "the next one is heard"


def fails(rigs: Rigs, now_s: float) -> float:
    """It dies and is started again as often as that is done; the time when it has been given up."""
    for pause_s in (*PAUSES_S, None):
        rigs.dies(now_s)
        now_s += pause_s or 0.0
        rigs.one.poll_child(set(), now_s)
    return now_s


def test_a_rig_that_keeps_dying_is_given_up_and_who_asks_is_told(rigs: Rigs) -> None:
    rigs.one.ask(NOW_S)
    now_s = fails(rigs, NOW_S)
    assert rigs.said[-1].startswith("A409 the simulated rig ended 4 times")
    assert rigs.said[-1].endswith("it stays off; end the gateway and start it again"), "no reset brings it back"
    rigs.one.ask(now_s + 1.0)
    assert rigs.told == [{"failed": True}] * 2
    assert (len(rigs.started), rigs.one.due_s) == (4, inf)


def test_a_long_life_forgives_earlier_deaths(rigs: Rigs) -> None:
    rigs.one.ask(NOW_S)
    for hour in range(1, 9):
        rigs.comes_up()
        rigs.dies(NOW_S + 3600.0 * hour)
        rigs.one.poll_child(set(), NOW_S + 3600.0 * hour + PAUSES_S[0])
    assert len(rigs.started) == 9


def test_a_start_that_fails_is_a_death_and_no_exception(rigs: Rigs) -> None:
    rigs.error = BlockingIOError(errno.EAGAIN, "Resource temporarily unavailable")
    rigs.one.ask(NOW_S)
    assert rigs.one.due_s == NOW_S + PAUSES_S[0]
    assert "Resource temporarily unavailable" in rigs.said[0]


def test_a_forked_rig_begins_once_it_is_told_that_it_is_followed(rigs: Rigs, monkeypatch) -> None:
    adopted: list[int] = []
    monkeypatch.setattr(FakeChild, "adopt", lambda child, pid: adopted.append(pid))
    rigs.one.ask(NOW_S)
    assert rigs.one.pid is None
    rigs.started[0].say(message_link.BORN, {"pid": 4711})
    rigs.hears()
    assert adopted == [4711]
