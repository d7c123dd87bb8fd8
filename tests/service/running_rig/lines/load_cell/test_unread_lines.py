"""What a cell says in place of readings is told once it is no accident, and for as long as it goes on."""

import pytest

from gateway.devices import DeviceProfile
from gateway.devices.messages import ForceSample, Garbage, Quality
from gateway.service.running_rig.lines import unread_lines
from gateway.service.running_rig.lines.unread_lines import UnreadLines
from tests.profile_files import load_device

IN_KN = Garbage(b"ST,GS,+0012.3kN\r\n")
READING = ForceSample(raw=1.0, force_n=1.0, quality=Quality.OK, time_s=1.0)


@pytest.fixture
def unread() -> UnreadLines:
    return UnreadLines(load_device("stream-st-gs"))


def test_one_line_may_be_what_the_opening_has_cut_and_two_are_told(unread: UnreadLines) -> None:
    unread.hear([IN_KN], 10.0)
    assert unread.words(10.0) == ""
    unread.hear([IN_KN], 10.1)
    assert "kN" in unread.words(10.1)


def test_a_reading_ends_it(unread: UnreadLines) -> None:
    unread.hear([IN_KN, IN_KN, READING, IN_KN], 10.0)
    assert unread.words(10.0) == ""


def test_what_has_ended_is_not_told_any_more(unread: UnreadLines) -> None:
    """A cell that has fallen silent since is silent."""
    unread.hear([IN_KN, IN_KN], 10.0)
    assert unread.words(10.9)
    assert unread.words(11.1) == ""


def test_behind_a_plug_nothing_of_before_is_told(unread: UnreadLines) -> None:
    unread.hear([IN_KN, IN_KN], 10.0)
    unread.forget()
    unread.hear([IN_KN], 10.0)
    assert unread.words(10.0) == ""


def test_a_line_is_explained_once_and_the_next_one_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each decision asks; to look for a frame in the noise of a Modbus line took a millisecond of every one."""
    explained: list[bytes] = []

    def explain(profile: DeviceProfile, line: bytes) -> str:
        explained.append(line)
        return f"it says {line!r}"

    monkeypatch.setattr(unread_lines, "explain_unread", explain)
    lines = UnreadLines(load_device("laumas-tlb"))
    lines.hear([Garbage(b"one"), Garbage(b"two")], 1.0)
    assert [lines.words(1.0 + 0.004 * k) for k in range(5)] == ["it says b'two'"] * 5
    assert explained == [b"two"]
    lines.hear([Garbage(b"three")], 1.1)
    assert lines.words(1.1) == "it says b'three'"
    lines.forget()
    assert lines.words(1.1) == ""
    assert explained == [b"two", b"three"]
