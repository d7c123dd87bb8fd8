"""W: the gateway refused a request of a Modbus master. Nothing was changed; the last-refusal registers hold the reason.

A reason has a number in refusal_reason and an exception on the wire. COEFFICIENTS alone has an E: its cause is a calibration
file more often than a master's program.
"""

from enum import IntEnum
from typing import Final, NamedTuple, Self

from gateway.codes.explanation import NO_CODE, Explanation
from gateway.modbus import errors as modbus  # by its name: BUSY is a reason too


class RefusalReason(IntEnum):
    """Why the last write was refused: its number in the registers, the exception that answers it, what `explain` says."""

    _value_: int
    exception: int
    explanation: Explanation

    def __new__(cls, number: int, exception: int = 0, explanation: Explanation = NO_CODE) -> Self:
        member = int.__new__(cls, number)
        member._value_ = number
        member.exception = exception
        member.explanation = explanation
        return member

    @property
    def code(self) -> str:
        """`W204`; empty for NONE."""
        return self.explanation.code

    NONE = 0
    ADDRESS = (
        1,
        modbus.ILLEGAL_ADDRESS,
        Explanation(
            "W202",
            "no register at this address",
            "An address outside every block.",
            "A register's name was used as its address: 40001 is the NAME of address 0 (mbpoll -r 1).",
            "Subtract 40001 (or 30001); `force-gateway registers` lists both ways of counting.",
        ),
    )
    READ_ONLY = (
        2,
        modbus.ILLEGAL_ADDRESS,
        Explanation(
            "W205",
            "register is read only",
            "A write to a register that only the gateway writes.",
            "An address from the status block where one of the command block was meant.",
            "Commands are at 0..15 (int16), 200..231 and 300..331 (float).",
        ),
    )
    HALF_VALUE = (
        3,
        modbus.ILLEGAL_VALUE,
        Explanation(
            "W206",
            "half of a 32-bit value",
            "A write that covers one of the two words of a number.",
            "FC06 writes one register; a float has two.",
            "Write both words in one FC16, or use the int16 value in block 0.",
        ),
    )
    NOT_FINITE = (
        4,
        modbus.ILLEGAL_VALUE,
        Explanation(
            "W207",
            "not a finite number",
            "NaN or infinity.",
            "A division by zero, or an unset variable in the master's program.",
            "Look at the master's arithmetic; the last accepted setpoint still stands.",
        ),
    )
    OUT_OF_RANGE = (
        5,
        modbus.ILLEGAL_VALUE,
        Explanation(
            "W204",
            "value out of range",
            "A value beyond the register's or the rig's limits; it is refused, never clipped.",
            "The scale was forgotten (12.00 N is 1200 in block 0), or the rig's force_max_n, or what the calibration in use "
            "allows, is lower than you think.",
            "Stay within what is allowed; unit and scale: `force-gateway registers NAME`, the rig's limit: the gateway's log.",
        ),
    )
    WORDS_SWAPPED = (
        6,
        modbus.ILLEGAL_VALUE,
        Explanation(
            "W201",
            "the two words of a number are swapped",
            "A float that makes no sense as sent (12.0 N reads 2.34e-41 swapped) and does with its words exchanged.",
            "Your client sends the low word first (CDAB), as mbpoll does without -B, and many PLCs.",
            "Use the block float_cdab (300) instead of float_abcd (200), or let your client send the high word first.",
        ),
    )
    TOO_SMALL = (
        7,
        modbus.ILLEGAL_VALUE,
        Explanation(
            "W208",
            "too small to be meant",
            "A float between 0 and 0.001.",
            "Swapped words, or an integer sent where a float is expected.",
            "Compare the byte-order constants at 400.. with what your client reads: float 1234.5.",
        ),
    )
    RESERVED = (
        8,
        modbus.ILLEGAL_VALUE,
        Explanation(
            "W209",
            "reserved register",
            "Something other than 0 in a register that has no meaning yet.",
            "The whole block was written, with an array that is not zeroed.",
            "Write 0 there, or write fewer registers.",
        ),
    )
    NOT_OWNER = (
        9,
        modbus.BUSY,
        Explanation(
            "W210",
            "another master owns the setpoint",
            "A command from a master that is not the owner.",
            "Two masters, or a client that you used before and that still holds it (owner_ip tells).",
            "Disable there, or take over explicitly with control_word bit 3 (take ownership): 9 and a setpoint in one write "
            "go on pressing, 8 alone clears enable.",
        ),
    )
    # the exception as Modbus/TCP Security answers a role that may not
    ROLE = (
        10,
        modbus.ILLEGAL_FUNCTION,
        Explanation(
            "W211",
            "role too low",
            "A write to a block that this connection's role may not write.",
            "By TLS the certificate names the role, on a serial face its `role:`; plain TCP may command, and upload "
            "coefficients where the rig allows it.",
            "Connect with a certificate of the role that the line names; a serial face: raise its `role:`; coefficients by "
            "plain TCP: network.allow_plain_upload.",
        ),
    )
    FAULT_LATCHED = (
        11,
        modbus.DEVICE_FAILURE,
        Explanation(
            "W212",
            "a fault is latched",
            "Enable was asked for while a fault stands.",
            "Faults stay until they are reset; fault_code has the first cause.",
            "Read fault_code, fix its cause, write force_setpoint 0, then raise control_word bit 1.",
        ),
    )
    NOT_READY = (
        12,
        modbus.BUSY,
        Explanation(
            "W213",
            "not ready",
            "Enable was asked for before everything was.",
            "The gateway has just started or ends, its loop has just stood still, the cell reads over_force_n, a force stays "
            "at the safe voltage, or a stop is under way.",
            "Wait for bit 1 (ready) of status_word; where it stays 0, lift the tool, look at force_measured and the gateway's "
            "log.",
        ),
    )
    OUTPUT_FAULT = (
        13,
        modbus.DEVICE_FAILURE,
        Explanation(
            "W214",
            "the output device is faulty",
            "Enable was asked for while the DAC or regulator does not answer properly, or a reset while it does not answer.",
            "No power, a cable, or a device that refuses.",
            "Check its power, its cable and its baud; `force-gateway explain E111` for a silent line.",
        ),
    )
    CELL_SILENT = (
        14,
        modbus.TARGET_SILENT,
        Explanation(
            "W215",
            "the load cell is silent",
            "Enable was asked for without a fresh sample of the load cell.",
            "No power, a cable, an amplifier that has stopped streaming, or one that speaks otherwise (unit, decimals).",
            "Check its power, its cable and its stream mode; `force-gateway explain E111` for a silent line; the log quotes "
            "what it says where that is text.",
        ),
    )
    RESET_NEEDS_ZERO = (
        15,
        modbus.ILLEGAL_VALUE,
        Explanation(
            "W216",
            "fault reset needs setpoint 0",
            "Reset was asked for while a force is still commanded.",
            "The master repeats its old setpoint; the reset would let the tool jump.",
            "Write force_setpoint 0 first (or in the same request), with a fresh heartbeat where there is a lease.",
        ),
    )
    UNSUPPORTED_BIT = (
        16,
        modbus.ILLEGAL_VALUE,
        Explanation(
            "W217",
            "not supported by this rig",
            "A control bit that the rig does not support.",
            "The rig file has no `self_test:` for bit 6, no `valve:` for bit 4, or nobody has named the bit yet.",
            "Leave the bit 0, or give the rig what is behind it; `force-gateway registers` names the bits.",
        ),
    )
    BYTE_ORDER_UNPROVEN = (
        17,
        modbus.BUSY,
        Explanation(
            "W218",
            "byte order not proven",
            "Enable was asked for before the echo that this rig demands.",
            "The rig has require_byte_order_echo: true.",
            "Write the float 1234.5 to byte_order_echo once after connecting.",
        ),
    )
    BUSY = (
        18,
        modbus.BUSY,
        Explanation(
            "W219",
            "busy",
            "Staging during a commit; a commit or slot behind a pile of requests; once on a serial line: equal writes at once.",
            "A commit is done a little behind its answer; a master does not wait; or its adapter may hear itself.",
            "Wait until commit_status is committed or failed, and for each answer; on a serial line write once more.",
        ),
    )
    QUANTITY = (
        19,
        modbus.ILLEGAL_VALUE,
        Explanation(
            "W220",
            "wrong number of registers",
            "A count of 0, above Modbus' limit, or that differs from the bytes sent.",
            "At most 125 registers are read and 123 written in one request.",
            "Split the request; blocks may be read in parts.",
        ),
    )
    FUNCTION = (
        20,
        modbus.ILLEGAL_FUNCTION,
        Explanation(
            "W221",
            "function not served",
            "A Modbus function that the gateway does not have.",
            "Served: 1, 2, 3, 4, 5, 6, 8 (sub-function 0), 15, 16, 17, 22, 23 and 43/14.",
            "Read with FC03 (or 04), write with FC16 (or 06).",
        ),
    )
    COEFFICIENTS = (
        21,
        modbus.BUSY,
        Explanation(
            "E401",
            "coefficients refused",
            "An uploaded calibration failed a check; index and reason are in failing_index and failing_reason.",
            "Float words in the wrong order, a CRC over the wrong range, branches that cross or do not rise, or "
            "stops too stiff.",
            "Read failing_index and failing_reason; the active set is unchanged, so there is no hurry.",
        ),
    )
    # a reset, or what presses more behind a master that was lost or refused, where there is a lease, without a new heartbeat
    HEARTBEAT_STALE = (
        22,
        modbus.ILLEGAL_VALUE,
        Explanation(
            "W302",
            "reset, enable or more without a new heartbeat",
            "With a lease: the heartbeat of before is beside a reset, second takeover, enable behind a loss, a stop or a "
            "refusal, or more than is held then.",
            "The master writes the bit without its heartbeat, or its program stands still and its last frame is repeated.",
            "Write the bit and another heartbeat value in one request; with a reset force_setpoint 0, too.",
        ),
    )
    NOTHING_TO_RESET = (
        23,
        modbus.DEVICE_FAILURE,
        Explanation(
            "W312",
            "nothing to reset",
            "The reset bit was written while the output is enabled, so that no fault is latched.",
            "The master resets as a matter of routine, or holds the bit at 1. With the output off that is answered "
            "with ok.",
            "Write the bit once, when bit 4 (fault) of status_word is set.",
        ),
    )
    TARE_REFUSED = (
        24,
        modbus.DEVICE_FAILURE,
        Explanation(
            "W303",
            "tare refused",
            "The tare bit was written and the zero not taken; the log line says why.",
            "A voltage is out, the output is silent, the force moves or is leaving, a fault is latched, or samples miss.",
            "Set the force to 0, lift the tool into the air, let it rest for a second, and write the bit again.",
        ),
    )
    # the state or the plan forbids it
    CALIBRATION_REFUSED = (
        25,
        modbus.DEVICE_FAILURE,
        Explanation(
            "W305",
            "calibration refused",
            "A calibration was asked for (control_word bit 5, or calibrate) and not begun; the force stays.",
            "The output is enabled with a force, a setpoint is not 0, a fault is latched, or the rig allows no "
            "such ladder.",
            "Write control_word 0 and force_setpoint 0 (and reset a fault), wait for state off, ask again. Of a valve that "
            "rests pulling: beside `force-gateway hold 0`.",
        ),
    )
    # a calibration or an experiment has the output
    CALIBRATING = (
        26,
        modbus.BUSY,
        Explanation(
            "W310",
            "busy: a run has the output",
            "A command came while a calibration, an experiment or a self-test has the output (state calibrating).",
            "What bit 5 or 6 or somebody at the gateway's machine has begun is not done; calibration_time_left says how "
            "long.",
            "Wait for state off, or end the run: control_word 0 (clearing bit 5 or 6 alone takes the force to 0 along "
            "the ramp).",
        ),
    )
    # the last ladder is not fitted yet
    FITTING = (
        27,
        modbus.BUSY,
        Explanation(
            "W311",
            "busy: the last ladder is being fitted",
            "Bit 5 was written while the fit of the last ladder goes on.",
            "The fit takes seconds; forces may be commanded meanwhile, another ladder not.",
            "Wait until calibration_phase is stored or refused.",
        ),
    )
    # bit 5 or 6 was kept at 1 beyond the end of the run that it began
    CALIBRATION_HELD = (
        28,
        modbus.DEVICE_FAILURE,
        Explanation(
            "W313",
            "bit 0, 5 or 6 was held at 1",
            "A run has ended, another master has reset a fault, or the gateway was started again, and who writes control_word "
            "in cycles still holds the bit.",
            "Another run would begin by itself, and the next after it; or a force, by a reset alone.",
            "Write control_word with the bit as 0 once; the next 1 counts.",
        ),
    )
    # the force is on its way to 0, and then the output is off
    STOPPING = (
        29,
        modbus.BUSY,
        Explanation(
            "W315",
            "busy: the force goes to 0",
            "A command came while the force is on its way to 0, after which the output is off.",
            "The gateway is being stopped, or the lease ended and the rig says ramp.",
            "Wait for state off, then enable again.",
        ),
    )
    EMPTY_SLOT = (
        30,
        modbus.ILLEGAL_VALUE,
        Explanation(
            "W331",
            "slot is empty",
            "slot_select named a slot that no commit has filled. The active set stays.",
            "Slots count from 0, and are filled by commits with that target_slot, on this gateway's state directory.",
            "force-gateway calibration list shows which slots are filled; upload the set with --slot.",
        ),
    )
    # the state or the rig forbids it
    SELF_TEST_REFUSED = (
        31,
        modbus.DEVICE_FAILURE,
        Explanation(
            "W306",
            "self-test refused",
            "A self-test was asked for (control_word bit 6, or self-test) and not begun; the force stays.",
            "The output is enabled with a force, a setpoint is not 0, a fault is latched, or a calibration was asked for "
            "in the same write.",
            "Write control_word 0 and force_setpoint 0 (and reset a fault), wait for state off, ask again. Of a valve that "
            "rests pulling: beside `force-gateway hold 0`.",
        ),
    )
    # bit 4, or a run, where the valve cannot follow now
    VALVE_REFUSED = (
        32,
        modbus.DEVICE_FAILURE,
        Explanation(
            "W307",
            "the valve cannot follow",
            "Bit 4 was written while a fault is latched, or a calibration or self-test asked for while the valve pulls.",
            "The master repeats its command, or the rig's valve.safe is pull.",
            "Reset the fault first; calibrate and self-test pushing: bit 4 0, enable, wait for bit 8 of status_word to fall.",
        ),
    )
    VALVE_UNKNOWN = (
        33,
        modbus.TARGET_SILENT,
        Explanation(
            "W308",
            "nobody knows where the valve stands",
            "Enable was asked for before the valve's relay has read its direction back, while it is silent, or stands "
            "elsewhere than told.",
            "No power, a cable, a wrong baud rate or address of the relay; or it was switched by hand, or does not move.",
            "Check the relay's power, cable and address, and that the valve follows it.",
        ),
    )
    PULL_RANGE = (
        34,
        modbus.ILLEGAL_VALUE,
        Explanation(
            "W309",
            "more than pulling can do",
            "force_setpoint with bit 4 is larger than the model of pulling reaches.",
            "The rod takes a part of the piston's area: the same pressure pulls less than it pushes.",
            "Command at most the force that the line names.",
        ),
    )
    UNIT = (
        40,
        modbus.TARGET_SILENT,
        Explanation(
            "W222",
            "unit id not served",
            "A request for another unit id than those of the gateway.",
            "The client asks for a device number of a serial line; Modbus TCP usually means 1 or 255.",
            "Use unit id 1 (mbpoll -a 1), or list yours under network.units in the rig file.",
        ),
    )


class SpecialRefusal(NamedTuple):
    """A case of a reason that people are told about under a code of its own."""

    reason: RefusalReason
    explanation: Explanation


OFF_BY_ONE: Final = SpecialRefusal(
    RefusalReason.ADDRESS,
    Explanation(
        "W203",
        "off by one",
        "A request that fits exactly if its address is moved by one.",
        "Your client counts from 1 where Modbus counts from 0, or the other way round.",
        "mbpoll: -0 counts from 0; otherwise add or subtract 1, and check with map_version in block 400.",
    ),
)
NOT_A_COIL_VALUE: Final = SpecialRefusal(
    RefusalReason.OUT_OF_RANGE,
    Explanation(
        "W223",
        "value that Modbus does not allow",
        "FC05 wrote something else than 0x0000 or 0xFF00, or FC43/14 asked for another code than 1 to 4.",
        "The client writes 1 where FC05 wants 0xFF00.",
        "Write the coil with your client's function for coils, or the whole control_word with FC06.",
    ),
)
NO_SUCH_OBJECT: Final = SpecialRefusal(
    RefusalReason.ADDRESS,
    Explanation(
        "W224",
        "no such identification object",
        "FC43/14 asked for one object that the gateway does not have.",
        "A browser that walks all numbers; there are 0, 1, 2, 4, 5 and 6.",
        "Nothing: ask for a category (code 1 or 2) instead of one object.",
    ),
)
SPECIAL_REFUSALS: Final = (OFF_BY_ONE, NOT_A_COIL_VALUE, NO_SUCH_OBJECT)
