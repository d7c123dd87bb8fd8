"""When a recording that the disk has ended is begun again: seldom, and never more seldom than once an hour."""

from gateway.service.running_rig.recording.recording_again import RecordingAgain


def pause_s(again: RecordingAgain, now_s: float = 0.0) -> float:
    again.ask("full")
    assert not again.is_due(now_s)
    return next(waited_s for waited_s in range(0, 10_000, 30) if again.is_due(now_s + waited_s))


def test_pauses_double_up_to_an_hour_and_stay_there() -> None:
    again = RecordingAgain()
    assert [pause_s(again) for _ in range(9)] == [30, 60, 120, 240, 480, 960, 1920, 3600, 3600]
    again.note_lasting(3599.0)
    assert pause_s(again) == 3600, "it did not go well for long"
    again.note_lasting(3601.0)
    assert pause_s(again) == 30
