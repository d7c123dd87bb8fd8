"""A line that stands still: what it has not sent of a question that nobody waits for any more goes out before no newer one."""

from tests.service.running_rig.lines.output.played_output import REPLY_TIMEOUT_S, Wire, wire

__all__ = ["wire"]


def test_older_voltages_do_not_go_out_before_the_safe_one(wire: Wire) -> None:
    """Three of them were kept, and sent before the safe one when the line went on."""
    wire.settle(400)
    unsent = wire.written
    unsent.clear()
    wire.exchange.drop_unsent = unsent.clear
    for counts in (420, 440, 460, 0):
        wire.set_voltage(counts)
        wire.tick(REPLY_TIMEOUT_S + 0.01)
        assert len(unsent) == 1
    assert wire.last == "SET 0"


def test_a_fall_that_does_not_wait_cuts_no_question_that_is_on_the_wire(wire: Wire) -> None:
    dropped: list[str] = []
    wire.exchange.drop_unsent = lambda: dropped.append(wire.last)
    wire.settle(400)
    wire.set_voltage(420)
    wire.set_voltage(440)
    wire.tick(REPLY_TIMEOUT_S + 0.01)
    assert (dropped, wire.last) == (["SET 420"], "SET 440")
    wire.answer("420", after_s=0.001)
    wire.set_voltage(0, after_s=0.001)
    assert (dropped, wire.last) == (["SET 420"], "SET 0")


def test_a_question_whose_answer_was_garbled_is_not_cut_on_the_wire(wire: Wire) -> None:
    """The line goes on: behind half a question the device does not hear the next one, which may be the safe voltage."""
    dropped: list[str] = []
    wire.exchange.drop_unsent = lambda: dropped.append(wire.last)
    wire.settle(400)
    wire.set_voltage(420)
    wire.answer("#", after_s=0.001)
    wire.tick(0.03)
    assert wire.written[-2:] == [b"SET 420\r\n"] * 2 and not dropped
    wire.tick(REPLY_TIMEOUT_S + 0.01)
    assert dropped
