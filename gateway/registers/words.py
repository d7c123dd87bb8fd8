"""Numbers with names that masters rely on: frozen within a map version; profiles/registers repeats them and a test compares."""

from enum import IntEnum, IntFlag
from typing import Final


class State(IntEnum):
    """The control state. OFF: output disabled, safe voltage. READY: enabled, nothing to press with yet (setpoint 0,
    or waiting at the pre-contact force). RAMPING: on the way. HOLDING: at the setpoint. FAULT: latched. CALIBRATING: a
    calibration or an experiment drives the output, and commands are refused as busy."""

    OFF = 0
    READY = 1
    RAMPING = 2
    HOLDING = 3
    FAULT = 4
    CALIBRATING = 5


class Mode(IntEnum):
    FORCE = 0
    VOLTAGE = 1


class ControlBit(IntFlag):
    ENABLE = 1 << 0
    RESET_FAULT = 1 << 1  # acts whenever written as 1
    TARE = 1 << 2  # acts whenever written as 1
    TAKE_OWNERSHIP = 1 << 3
    VALVE_PULL = 1 << 4
    START_CALIBRATION = 1 << 5
    START_SELF_TEST = 1 << 6


class StatusBit(IntFlag):
    ENABLED = 1 << 0
    READY = 1 << 1  # an enable would be accepted (or has been): cell fresh, output acknowledged, no fault
    CONTACT = 1 << 2
    IN_BAND = 1 << 3
    FAULT = 1 << 4
    WARNING = 1 << 5
    LIMITED = 1 << 6
    TARGET_UNREACHABLE = 1 << 7


class LimitedBy(IntEnum):
    """What kept the voltage from being what the law asked for, strongest first when several act."""

    NONE = 0
    VOLTAGE_SLEW = 1
    VOLTAGE_RANGE = 2
    TRIM_RANGE = 3
    CALIBRATION_RANGE = 4
    FORCE_RANGE = 5
    SMALLEST_FORCE = 6


class FaultCode(IntEnum):
    """The first cause of a latched fault."""

    NONE = 0
    MASTER_LOST = 1  # A310: the lease ran out
    SAMPLE_STALE = 2
    SAMPLE_FROZEN = 3
    OVER_FORCE = 4  # saturation counts as over-force
    SIGN_INVERTED = 5  # A302
    GAIN_WRONG = 6  # A303
    OUTPUT_SILENT = 7
    OUTPUT_REFUSED = 8
    OUTPUT_ALTERED = 9
    OUTPUT_LOST = 10  # the port went away
    CELL_LOST = 11
    LOOP_STALLED = 12
    NOT_FINITE = 13
    INTERNAL = 14
    MODEL_INVALID = 15
    MACHINE_BUSY = 16  # A403: the loop was late because the machine did not let it run


class WarningBit(IntFlag):
    RESTARTED = 1 << 0
    TARGET_UNREACHABLE = 1 << 1  # A301
    TRIM_SATURATED = 1 << 2
    SERIAL_NOISE = 1 << 3
    SLOW_LOOP = 1 << 4
    NO_WATCHDOG = 1 << 5
    CLOCK_FALLBACK = 1 << 6
    MASTER_LOST = 1 << 7  # A310: the lease ran out, and the rig says hold or ramp
    MODEL_DIFFERS = 1 << 8  # A345: the residual watch finds that the rig's plant no longer explains what is measured


class RefusalReason(IntEnum):
    """Why the last write was refused; the sentence goes to the log."""

    NONE = 0
    ADDRESS = 1  # W202, W203
    READ_ONLY = 2
    HALF_VALUE = 3
    NOT_FINITE = 4
    OUT_OF_RANGE = 5  # W204
    WORDS_SWAPPED = 6  # W201
    TOO_SMALL = 7
    RESERVED = 8
    NOT_OWNER = 9
    ROLE = 10
    FAULT_LATCHED = 11
    NOT_READY = 12
    OUTPUT_FAULT = 13
    CELL_SILENT = 14
    RESET_NEEDS_ZERO = 15
    UNSUPPORTED_BIT = 16
    BYTE_ORDER_UNPROVEN = 17
    BUSY = 18
    QUANTITY = 19
    FUNCTION = 20
    COEFFICIENTS = 21
    HEARTBEAT_STALE = 22  # W302: a reset where there is a lease, without a new heartbeat
    NOTHING_TO_RESET = 23
    TARE_REFUSED = 24  # W303
    CALIBRATION_REFUSED = 25  # W305: the state or the plan forbids it
    CALIBRATING = 26  # W310: a calibration or an experiment has the output
    FITTING = 27  # W311: the last ladder is not fitted yet
    CALIBRATION_HELD = 28  # W313: bit 5 was kept at 1 beyond the end of the run that it began
    STOPPING = 29  # W315: the force is on its way to 0, and then the output is off
    EMPTY_SLOT = 30
    UNIT = 40


class CalibrationPhase(IntEnum):
    """How far the calibration that control_word bit 5 starts is."""

    IDLE = 0
    ZERO = 1  # rest force and noise
    CHECK = 2  # sign and scale against the model; settles the friction
    LADDER = 3
    MINOR_LOOPS = 4
    FITTING = 5  # the ladder is done, the output off; a process of its own fits
    STORED = 6  # calibration_stored is the number
    STOPPED = 7  # before its end: the data are kept
    REFUSED = 8  # the fit was refused: see the log
    EXPERIMENT = 9  # an experiment of this machine: no calibration comes of it
    RECORDED = 10  # the experiment is done and recorded


class CommitAction(IntEnum):
    """What the commit word of the staging block asks for."""

    NONE = 0
    COMMIT = 1
    DRY_RUN = 2  # all checks, nothing stored
    ROLLBACK = 3  # what was in use before, whatever is staged


class CommitStatus(IntEnum):
    """How far the last commit is."""

    IDLE = 0
    CHECKING = 1
    WRITING = 2
    COMMITTED = 3  # durable: after the directory's fsync
    FAILED = 4  # the active set stays


class CommitNotice(IntFlag):
    """What a master should know of the last commit, beside that it went through."""

    WITHOUT_STOPS = 1 << 0  # its set came in the form of version 1 of the map: the linear blend, no response
    KNOWN_SET = 1 << 1  # it was known here, and keeps number and name


NO_NOTICE: Final = CommitNotice(0)


class UploadReason(IntEnum):
    """Why a commit failed where no coefficient is to blame: failing_reason, beside gateway.bsfm.CoefficientReason (0..15)."""

    LENGTH = 20
    CRC = 21
    UNUSED_NOT_ZERO = 22
    TARGET_SLOT = 23
    FORCE_LIMITS = 24
    STORAGE = 25  # E431: the set is good, the disk took it not
    NOT_STORED = 26  # E432, E433: what slot or rollback name is damaged, or is not there
    DEFECT = 27  # A499: of ours
    STOPS_CUT = 28  # the read-back of a model with more slip stops than the registers carry
