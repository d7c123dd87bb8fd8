"""A or W, with a bit in warning_word: what deserves a look while work goes on."""

from enum import IntFlag
from typing import Self

from gateway.codes.explanation import NO_CODE, Explanation
from gateway.codes.faults import FaultCode


class WarningBit(IntFlag):
    """What deserves a look while work goes on: its bit in the registers, and what `explain` says of it."""

    _value_: int
    explanation: Explanation

    def __new__(cls, bit: int, explanation: Explanation = NO_CODE) -> Self:
        member = int.__new__(cls, bit)
        member._value_ = bit
        member.explanation = explanation
        return member

    def __invert__(self) -> Self:
        """Return all other bits. Python 3.11.2, Debian 12's, forgets those above, of members that have more than a value."""
        return type(self)(sum(type(self)) ^ self)

    @property
    def code(self) -> str:
        """`A301`, of a single bit."""
        return self.explanation.code

    RESTARTED = (
        1 << 0,
        Explanation(
            "A401",
            "control process restarted",
            "The control process died or stalled; the guardian wrote the safe voltage and started it again, in OFF.",
            "Out of memory, a kill by hand, a busy machine (A403) or an internal error; the line says which, in "
            "numbers.",
            "Read the line, and `explain` the code that it ends with; enable again when you know why.",
        ),
    )
    TARGET_UNREACHABLE = (
        1 << 1,
        Explanation(
            "A301",
            "target unreachable",
            "The force stays off its target, mostly with voltage out and much less force than the model expects (2.31 V, "
            "0.1 N instead of 17.9 N).",
            "No air, a closed valve, no contact; an output whose supply dipped; a tenth is kgf read as N; a wrong span of the "
            "cell; too much is friction or weight.",
            "Open the air supply and look at its gauge; bring the tool into contact; compare units; try a known weight; "
            "disable and enable: the voltage is said anew.",
            is_warning=True,
        ),
    )
    TRIM_SATURATED = (
        1 << 2,
        Explanation(
            "A340",
            "trim at its limit",
            "The slow correction by the load cell has used up its range.",
            "The calibration no longer fits: another supply pressure, tool or temperature; or the load cell's span is wrong.",
            "Tare in the air, compare model_residual and the cell with a known weight, then calibrate again.",
            is_warning=True,
        ),
    )
    SERIAL_NOISE = (
        1 << 3,
        Explanation(
            "A341",
            "noise on a serial line",
            "Bytes that form no message keep arriving, over 1 % of the messages of 10 s; they are dropped and counted.",
            "A motor cable beside the serial one, a missing ground, or a marginal baud rate.",
            "Separate the cables and connect the shield at one end.",
            is_warning=True,
        ),
    )
    SLOW_LOOP = (
        1 << 4,
        Explanation(
            "A342",
            "loop is slow",
            "Over 1 % of the control loop's ticks of 10 s are missed, or more than half a period late.",
            "Other programs on this machine, or a CPU that sleeps deeply; the sentence says where the time went.",
            "Compare missed_ticks over a minute; `run --realtime` gives the loop priority.",
            is_warning=True,
        ),
    )
    NO_WATCHDOG = (
        1 << 5,
        Explanation(
            "A343",
            "output device has no watchdog",
            "If this machine loses power, the device holds its last voltage; the rig file accepts that.",
            "The device (an SMC ITV, for one) has none.",
            "Put an air dump valve on the E-stop circuit: separate hardware, always.",
            is_warning=True,
        ),
    )
    CLOCK_FALLBACK = (
        1 << 6,
        Explanation(
            "A344",
            "coarse clock",
            "The kernel's timer descriptor is missing here, and ticks come from the event loop, rounded to 1 ms.",
            "Not Linux, or a sandbox without timerfd.",
            "Nothing at 100 Hz; for 250 Hz run it on Linux.",
            is_warning=True,
        ),
    )
    # the lease ran out, and the rig says hold or ramp
    MASTER_LOST = 1 << 7, FaultCode.MASTER_LOST.explanation
    # the residual watch finds that the rig's plant no longer explains what is measured
    MODEL_DIFFERS = (
        1 << 8,
        Explanation(
            "A345",
            "model differs from the measurements",
            "Two windows in a row, the force was off the rig's plant by more than a quarter of the band; "
            "residual_cause says why.",
            "As the name says: worn seals (coulomb-friction), another hose (transport-delay), a cell that warms up "
            "(linear-drift).",
            "force-gateway record on, a minute of work, then force-gateway diagnose NUMBER: how sure, and by how much.",
            is_warning=True,
        ),
    )
    # the residual watch finds the error of the commanded force larger than before the plant in use was taken
    COMPENSATION_WORSE = (
        1 << 9,
        Explanation(
            "A347",
            "the plant in use makes the force worse",
            "Two looks in a row, the commanded force was further off than in the run before the plant came into use.",
            "What the plant describes is not what is wrong, or the machine has changed since it was diagnosed.",
            "force-gateway plant rollback; then record, and diagnose anew.",
            is_warning=True,
        ),
    )
    # single readings keep leaving the band, so that the force is neither held nor missed
    FORCE_UNSTEADY = (
        1 << 10,
        Explanation(
            "W361",
            "noise as large as the band",
            "The mean force is in the band, single readings keep leaving it before in_band_time is over: in_band and the state "
            "holding come and go, or never come.",
            "A cell far larger than the forces, a motor cable beside its own, a tool that shakes, a hunting regulator.",
            "Write a wider in_band_tolerance, or set in_band_tolerance_n in the rig; a filter on the amplifier adds dead time.",
        ),
    )
    # the cell was not heard for a while, or a crash has forgotten its tare: until the next one
    ZERO_DOUBTED = (
        1 << 11,
        Explanation(
            "W253",
            "the load cell's zero is in doubt",
            "The tare in use is of before half a second or more without a usable reading, or a crash of control has forgotten "
            "it (W250): forces may be off by it.",
            "The amplifier was without power and zeroes itself when it starts; the cell was unplugged, replaced or overloaded.",
            "Look at the force with nothing pressed: where it is not 0, tare again before you press. A tare ends the warning.",
        ),
    )
