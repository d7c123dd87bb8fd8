"""A, with a number in fault_code: the first cause of a latched fault. The safe voltage is out until the reset."""

from enum import IntEnum
from typing import Self

from gateway.codes.explanation import NO_CODE, Explanation


class FaultCode(IntEnum):
    """The first cause of a latched fault: its number in the registers, and what `explain` says of it."""

    _value_: int
    explanation: Explanation

    def __new__(cls, number: int, explanation: Explanation = NO_CODE) -> Self:
        member = int.__new__(cls, number)
        member._value_ = number
        member.explanation = explanation
        return member

    @property
    def code(self) -> str:
        """`A310`; empty for NONE."""
        return self.explanation.code

    NONE = 0
    # the lease ran out
    MASTER_LOST = (
        1,
        Explanation(
            "A310",
            "master lost",
            "The owner's heartbeat did not change within the lease.",
            "The robot program stopped, its connection closed, it writes a constant heartbeat, or the writes that carry it are "
            "refused, of which nothing is taken.",
            "Let the master change the heartbeat register at least every lease, and mend what refusal_reason and the log say "
            "was refused; then reset with setpoint 0.",
        ),
    )
    SAMPLE_STALE = (
        2,
        Explanation(
            "A311",
            "no fresh force sample",
            "The last sample of the load cell is older than the bound.",
            "A loose cable, no power at the amplifier, another unit or format than its profile reads, a rate too low for "
            "sample_timeout_s; or we were late.",
            "Look at sample_age: where it grows, check the amplifier's power and cable; where it falls back, its output rate.",
        ),
    )
    SAMPLE_FROZEN = (
        3,
        Explanation(
            "A312",
            "force reading is frozen",
            "Sample after sample is the same, bit for bit: the force, or the noise of the cell, must have changed it.",
            "The amplifier is in hold or menu mode, or repeats its last value without a cell.",
            "Leave the amplifier's menu and release `hold`; press the cell by hand and watch `force-gateway monitor`.",
        ),
    )
    # saturation counts as over-force
    OVER_FORCE = (
        4,
        Explanation(
            "A313",
            "too much force",
            "The measured force passed over_force_n, or the cell is saturated, several samples long.",
            "A collision, a wrong calibration, or a broken cell wire (an open input saturates).",
            "Clear the tool; look at force_measured with the tool in the air before the reset.",
        ),
    )
    SIGN_INVERTED = (
        5,
        Explanation(
            "A302",
            "force has the wrong sign",
            "The voltage rose in contact and the measured force fell.",
            "The load cell's signal wires are exchanged, or it is mounted the other way round; only pushing, or only "
            "pulling: the valve has not moved.",
            "Exchange SIG+ and SIG-, or set `sign: -1` under load_cell in the rig file; look at the valve's "
            "coil and pilot air.",
        ),
    )
    GAIN_WRONG = (
        6,
        Explanation(
            "A303",
            "force has the wrong size",
            "The first rise in contact is less than 30 % or more than 300 % of what the model expects.",
            "Kilograms read as newtons (a factor of 9.81), another cell, or another cylinder than the calibrated one.",
            "Check unit and span of the amplifier against the rig file and the cell with a known weight, then calibrate.",
        ),
    )
    OUTPUT_SILENT = (
        7,
        Explanation(
            "A314",
            "output device is silent",
            "A voltage was written and not acknowledged in time.",
            "No power at the DAC or regulator, or a broken cable; or we were late (the line says so).",
            "Check its power and cable; `force-gateway explain E111`.",
        ),
    )
    OUTPUT_REFUSED = (
        8,
        Explanation(
            "A315",
            "output device refused",
            "The DAC or regulator answered that it will not do what was asked.",
            "A value outside the device's own range, or its watchdog has tripped and is latched.",
            "Compare voltage_max_v with the device's range; reset the device's own alarm.",
        ),
    )
    OUTPUT_ALTERED = (
        9,
        Explanation(
            "A316",
            "output differs from what was asked",
            "The acknowledged voltage is another than the one written.",
            "Noise on the line, a second talker, or a device set to another range.",
            "Check shield and ground, and that nothing else is connected to the device.",
        ),
    )
    # the port went away
    OUTPUT_LOST = (
        10,
        Explanation(
            "A317",
            "output's port lost",
            "The serial port of the output went away; its last voltage may still stand.",
            "The USB adapter was unplugged or reset itself.",
            "Plug it in again: the safe voltage is written first; then reset with setpoint 0.",
        ),
    )
    CELL_LOST = (
        11,
        Explanation(
            "A318",
            "load cell's port lost",
            "The serial port of the load cell went away.",
            "The USB adapter was unplugged or reset itself.",
            "Plug it in again: the gateway reopens it by itself; then reset with setpoint 0.",
        ),
    )
    LOOP_STALLED = (
        12,
        Explanation(
            "A319",
            "control loop stalled",
            "The loop came round later than the bound; commands that waited meanwhile were dropped.",
            "It was stopped, its container paused, or the whole machine suspended, or an internal error; where the kernel "
            "does not count waiting, an overloaded machine.",
            "The line says which, if the kernel counts it; look for other load (top). One that goes to sleep: "
            "`systemctl mask sleep.target`.",
        ),
    )
    NOT_FINITE = (
        13,
        Explanation(
            "A320",
            "a number was not finite",
            "A computation inside the gateway gave NaN or infinity, and the safe voltage was written instead.",
            "An internal error, or a calibration from outside its range.",
            "Go back to the previous calibration (force-gateway calibration rollback); report it with a recording.",
        ),
    )
    INTERNAL = (
        14,
        Explanation(
            "A499",
            "internal error",
            "The control law failed with an exception; the safe voltage was written.",
            "An internal error.",
            "Report it with force-gateway report and the traceback in the log; where it comes again, calibration rollback.",
        ),
    )
    MODEL_INVALID = (
        15,
        Explanation(
            "A321",
            "voltage-force model invalid",
            "The active calibration fails its checks.",
            "A calibration file that was edited by hand, or a damaged disk.",
            "Take another one: force-gateway calibration list, then calibration use N; of the rig's own, check RIG names file "
            "and line.",
        ),
    )
    # the loop was late because the machine did not let it run
    MACHINE_BUSY = (
        16,
        Explanation(
            "A403",
            "machine too busy",
            "The control loop, or a simulated rig's process, was later than a bound; most of that time it got no processor.",
            "Other programs take all cores: a build, more gateways; or a virtual machine's host, or a container's CPU quota, "
            "withholds them.",
            "End them, or `nice -n 10` them; else run --realtime, cores of its own for a virtual machine, or a longer stall_s.",
        ),
    )
    VALVE_SILENT = (
        17,
        Explanation(
            "A355",
            "the valve's device is silent",
            "The relay that switches push and pull did not answer the question within valve.timeout_s, or its port is away.",
            "No power, a cable, a wrong baud rate or address; a relay that refuses (the log says in which words).",
            "Check power, cable, address and channel of the relay, then reset with setpoint 0.",
        ),
    )
    VALVE_ALTERED = (
        18,
        Explanation(
            "A356",
            "the valve stands elsewhere",
            "The relay reads back another direction than it was told, longer than valve.timeout_s.",
            "Somebody else writes the relay, it was switched by hand, or it has lost power and come back.",
            "Take the other master off the relay; the reset tells it its direction again.",
        ),
    )
    WATCHDOG_TRIPPED = (
        20,
        Explanation(
            "A332",
            "the output device's own watchdog has tripped",
            "The device heard nothing from here for its watchdog's time; it stands at its own safe value and obeys no setting.",
            "The gateway or its machine stopped without an orderly end, or the wire to the device was cut.",
            "Find out what stopped, look at the tool, then reset: the reset clears the device's watchdog and arms it again.",
        ),
    )
    # the identity query of the device's profile got another answer
    WRONG_DEVICE = (
        21,
        Explanation(
            "A333",
            "another device than the rig names",
            "Asked what it is, the device said what its profile does not know, or nothing; only the safe voltage goes out.",
            "Two adapters are exchanged, or the rig file names another profile, or another address, than the device has.",
            "Compare what it says with `models` in its profile; force-gateway check RIG --probe asks every port. Then reset.",
        ),
    )
    WATCHDOG_NOT_ARMED = (
        22,
        Explanation(
            "A334",
            "the output device's watchdog cannot be armed",
            "Arming was refused, not answered, or read back otherwise; the device would hold its voltage without this machine.",
            "Firmware that counts another tick, a time that it does not take, or a module without this command.",
            "Set output.watchdog_s or watchdog_tick_s, then reset; or accept_no_device_watchdog: true, with an air dump valve.",
        ),
    )
