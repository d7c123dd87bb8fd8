"""What a restart of control keeps: all that was asked for, the addresses that others know, and who serves on them."""

import os
from pathlib import Path

import pytest

from gateway.processes import exit_codes, message_link
from gateway.processes.exit_cause import EndCause, Ending
from gateway.processes.state_lock import hold_state_lock
from gateway.processes.systemd.service_manager import ServiceManager
from gateway.service.heartbeat_memory import HeartbeatMemory
from gateway.service.supervisor import guardian
from gateway.service.supervisor.control_child import START_GRACE_S
from gateway.service.supervisor.run_options import RunOptions
from tests.service.supervisor.guarded import PTYS, READY, FakeChild, Scene, Script, port
from tests.service.supervisor.scripted_children import assert_comes_up, dies_after, lives, rig_lives, scene

__all__ = ["port", "scene"]
ALL_ASKED = RunOptions(
    rig="cell.yaml",
    simulate=True,
    rtu="/dev/ttyUSB7",
    json=True,
    record=True,
    realtime=True,
    web=("", 0),
    metrics=("127.0.0.1", 9000),
)


def test_a_control_process_that_is_started_again_is_asked_for_all_that_the_first_was(scene, port):
    one = scene(dies_after(8, port), dies_after(8, port), lives(port))
    one.guardian.options = ALL_ASKED
    one.guardian.share_memory()
    one.run(lambda: len(one.starter.started) == 3)
    first, *later = one.starter.arguments
    for asked in (first, *later):
        assert {name: asked[name] for name in ("rig", "simulate", "rtu", "record", "realtime", "web", "metrics")} == {
            name: getattr(ALL_ASKED, name)
            for name in ("rig", "simulate", "rtu", "record", "realtime", "web", "metrics")
        }
        assert (asked["state"], asked["ring"], asked["beat"]) == (
            str(one.guardian.state),
            one.guardian.ring,
            one.guardian.beat,
        )
    assert {name for again in later for name in again if again[name] != first[name]} == {"bind", "restarted"}


def with_page(path: Path, port):
    """A control process whose page listens, on a socket that is a file here; each start makes another one."""

    def script(child: FakeChild) -> None:
        dies_after(5, port, None)(child)
        descriptor = os.open(path, os.O_RDONLY)
        address = ["127.0.0.1", 8080]
        ready = READY | {"listening": {"web": address}, "optional": {"web": {"settings": {"port": 8080}}}}
        child.say(message_link.READY, ready, descriptor)
        os.close(descriptor)

    return script


def test_the_socket_of_the_page_outlives_control_and_the_page(scene, port, tmp_path):
    """Callers that wait in it are served by the next one."""
    (tmp_path / "socket").touch()
    one = scene(with_page(tmp_path / "socket", port), lives(port))
    one.guardian.share_memory()
    assert_comes_up(one)
    ((name, told),) = one.starter.optionals
    assert (name, told["ring"], told["settings"]) == ("web", one.guardian.ring, {"port": 8080})
    assert os.path.samestat(os.fstat(told["listen"]), (tmp_path / "socket").stat())
    one.run(lambda: len(one.starter.started) == 2)
    assert one.starter.arguments[1]["listening"] == {"web": ["127.0.0.1", 8080]}
    assert os.path.samestat(os.fstat(told["listen"]), (tmp_path / "socket").stat())


def test_a_listening_socket_that_is_kept_is_not_changed_for_another(scene, port, tmp_path):
    """The page listens on the first one."""
    (tmp_path / "socket").touch()
    one = scene(with_page(tmp_path / "socket", port))
    assert_comes_up(one)
    kept = dict(one.guardian.listeners)
    one.run(lambda: len(one.starter.started) == 2)
    assert_comes_up(one)
    assert one.guardian.listeners == kept
    assert len(one.starter.optionals) == 1, "the page has outlived it"


def test_a_page_that_dies_is_started_again_on_the_socket_that_it_had(scene, port, tmp_path):
    (tmp_path / "socket").touch()
    one = scene(with_page(tmp_path / "socket", port))
    assert_comes_up(one)
    one.guardian.control.heartbeat.stall_s = 1e3
    one.starter.optionals_started[0].dies(1)
    one.run(lambda: len(one.starter.optionals) == 2)
    assert one.starter.optionals[1] == one.starter.optionals[0]
    assert len(one.starter.started) == 1


def test_a_control_process_that_is_started_again_finds_the_rig_that_there_was(scene, port):
    """A real one does not go away with it: there is one, under force or not, and it is where it was."""
    one = scene(dies_after(8, port), lives(port))
    one.run(lambda: len(one.starter.started) == 2)
    assert_comes_up(one)
    heard: list[message_link.Message] = []
    one.run(lambda: bool(heard.extend(one.child.hears()) or heard))
    assert heard == [message_link.Message(message_link.RIG, {"ptys": PTYS})]
    assert len(one.starter.rigs_started) == 1


def test_at_the_end_every_child_is_ended(scene, port, tmp_path):
    (tmp_path / "socket").touch()
    one = scene(with_page(tmp_path / "socket", port))
    assert_comes_up(one)
    one.run(lambda: one.guardian.others.pids["rig"] is not None)
    one.guardian._close()
    one.guardian.listeners.clear()  # closed
    children = (*one.starter.started, *one.starter.rigs_started, *one.starter.optionals_started)
    assert len(children) == 3
    assert all(child.exit_code is not None for child in children)
    assert one.starter.calls[-1] == "end"


def test_a_rig_that_came_to_nothing_reads_its_files_anew(scene, port):
    def stillborn(child: FakeChild) -> None:
        child.dies(1)

    one = scene(lives(port), rigs=(stillborn, rig_lives))
    one.run(lambda: len(one.starter.rigs_started) == 2)
    assert [call for call in one.starter.calls if call.startswith("rig")] == ["rig prepared=True", "rig prepared=False"]


def test_a_guardian_that_cannot_look_into_memory_asks_for_messages(scene, port, monkeypatch):
    def no_memory(descriptor: int) -> HeartbeatMemory:
        raise OSError("no memory to be had")

    monkeypatch.setattr(guardian, "HeartbeatMemory", no_memory)
    one = scene(lives(port))
    one.guardian.share_memory()
    assert_comes_up(one)
    assert one.starter.arguments[0]["beat"] is None


def watched_by(one: Scene) -> list[str]:
    """What is told to the service manager from now on, one line each."""
    told: list[str] = []
    one.guardian.manager = manager = ServiceManager(watchdog_s=30.0)
    manager._say = lambda words: told.append(" ".join(words))  # type: ignore[method-assign,assignment]
    return told


def test_the_service_manager_hears_of_a_restart_and_of_a_stop(scene, port):
    one = scene(dies_after(8, port), lives(port))
    told = watched_by(one)
    one.run(lambda: len(one.starter.started) == 2)
    assert_comes_up(one)
    one.signals.send()
    one.run(lambda: one.guardian.stops == 1)
    assert [line for line in told if line != "WATCHDOG"] == [
        "READY STATUS WATCHDOG_USEC",
        "STATUS WATCHDOG WATCHDOG_USEC",
        "READY STATUS WATCHDOG_USEC",
        "STOPPING STATUS",
    ]


def test_the_service_manager_gives_a_restart_the_time_of_two_starts(scene, port, monkeypatch):
    """One that comes to nothing, and the next: ended sooner, nobody would be there for the output's safe voltage."""
    one, given_s = scene(dies_after(8, port), lives(port)), list[float]()
    monkeypatch.setattr(one.guardian.manager, "starting", lambda status, within_s: given_s.append(within_s))
    one.run(lambda: len(one.starter.started) == 2)
    assert given_s == [pytest.approx(2.0 * START_GRACE_S)]


def test_a_guardian_that_lives_is_no_sign_of_life_of_a_loop(scene, port):
    """Its child waits for a disk for as long as it likes: systemd is to see that."""
    one = scene(lives(port))
    assert_comes_up(one)
    one.guardian.control.heartbeat.stall_s = 1e3
    told = watched_by(one)
    one.run(lambda: one.now_s > 400.0)
    assert len(told) <= 1


@pytest.mark.parametrize("is_born", [False, True])
def test_what_does_not_come_up_is_waited_for_as_long_as_it_may_take(scene, port, is_born):
    """Until its birth as long as a fork takes, 1 s here: then the prepared process is to blame and counts no more."""
    one = scene(dies_after(int(is_born), port, None), lives(port))
    assert one.run(lambda: len(one.starter.started) == 2) is None
    assert one.now_s == pytest.approx(130.0 if is_born else 101.0)
    assert ("drop does not answer" in one.starter.calls) is not is_born
    assert one.starter.calls.count("attach") == is_born
    assert (one.starter.arguments[1]["restarted"] is not None) is is_born


def test_a_stillborn_child_is_no_reason_to_trust_who_forked_it(scene, port):
    one = scene(dies_after(0, port), lives(port))
    one.run(lambda: len(one.starter.started) == 2)
    assert "not attach" in one.starter.calls
    assert Ending.from_json(one.starter.arguments[1]["restarted"]).cause is EndCause.NOT_STARTED


@pytest.mark.parametrize(("closes_at_s", "over_at_s"), [(0.0, 105.0), (28.0, 130.0)])
def test_who_has_closed_its_line_before_it_was_ready_has_five_seconds_to_end(scene, port, closes_at_s, over_at_s):
    """And never more than if it had said nothing."""
    one = scene(dies_after(5, port, None), lives(port))
    one.run(lambda: one.guardian.control.safe_line is not None)
    one.now_s += closes_at_s
    one.child.theirs.close()
    one.run(lambda: len(one.starter.started) == 2)
    assert one.now_s == pytest.approx(over_at_s)


def test_what_beats_in_memory_before_it_is_ready_is_not_held_to_the_bound_of_a_stall(scene, port):
    one = scene(dies_after(5, port, None))
    one.guardian.share_memory()
    memory = HeartbeatMemory(one.guardian.beat)
    one.run(lambda: one.guardian.control.safe_line is not None)
    memory.beat(one.now_s)
    one.guardian._on_deadline()
    assert not one.guardian.control.heartbeat.is_up
    memory.close()


def test_the_last_beat_of_a_dead_process_does_not_make_its_successor_silent(scene, port):
    """It comes up later than a stall may last, and its own loop has not beaten yet."""
    one = scene(lives(port), dies_after(5, port, None))
    one.guardian.share_memory()
    memory = HeartbeatMemory(one.guardian.beat)
    assert_comes_up(one)
    memory.beat(one.now_s + 0.01)
    one.run(lambda: len(one.starter.started) == 2)
    one.now_s += 3.0
    one.child.say(message_link.READY, READY)
    ready_s = one.now_s
    one.run(lambda: len(one.starter.started) == 3)
    assert one.now_s == pytest.approx(ready_s + 0.1)
    memory.close()


def test_a_beat_that_came_behind_the_last_look_is_none_of_its_successor(scene, port):
    """The loop may have beaten once more before it was killed: taken for the next one's, that one is silent as it comes up."""
    one = scene(lives(port), dies_after(5, port, None))
    one.guardian.share_memory()
    memory, control = HeartbeatMemory(one.guardian.beat), one.guardian.control
    assert_comes_up(one)
    write_safe_voltage = control.write_safe_voltage

    def beats_once_more():
        memory.beat(one.now_s)
        return write_safe_voltage()

    control.write_safe_voltage = beats_once_more
    one.run(lambda: len(one.starter.started) == 2)
    control.write_safe_voltage = write_safe_voltage
    one.now_s += 3.0
    one.child.say(message_link.READY, READY)
    ready_s = one.now_s
    one.run(lambda: len(one.starter.started) == 3)
    assert one.now_s == pytest.approx(ready_s + 0.1)
    memory.close()


def test_orphans_are_reaped_and_children_that_somebody_asks_for_are_not(scene, port, monkeypatch, tmp_path):
    spared: list[set[int]] = []
    monkeypatch.setattr(guardian, "reap_orphans", spared.append)
    one = scene(with_page(tmp_path / "socket", port))
    (tmp_path / "socket").touch()
    one.starter.server_pid = 4000
    one.run(lambda: one.guardian.announced)
    one.run(lambda: one.guardian.others.pids["rig"] is not None)
    others = one.guardian.others.pids
    one.run(lambda: len(one.starter.started) == 2)
    assert spared == [{os.getpid(), others["rig"], others["web"], 4000}]


def test_a_second_gateway_on_the_same_state_starts_nothing(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(guardian.Guardian, "watch", lambda self: pytest.fail("it begins to watch"))
    with hold_state_lock(tmp_path) as is_ours:
        assert is_ours
        assert guardian.run(RunOptions(state=tmp_path)) == exit_codes.DEVICE


def test_what_control_has_kept_is_told_to_the_next_one_in_its_newest_form(scene, port):
    def keeps(*facts: dict[str, object]) -> Script:
        def script(child: FakeChild) -> None:
            dies_after(6, port, None)(child)
            for fact in facts:
                child.say(message_link.KEEP, fact)
            child.dies(-9)

        return script

    one = scene(keeps({"calibration": 2, "recording": None}, {"calibration": 3}), keeps(), lives(port))
    one.run(lambda: len(one.starter.started) == 3)
    assert [asked["kept"] for asked in one.starter.arguments] == [{}, *2 * [{"calibration": 3, "recording": None}]]
