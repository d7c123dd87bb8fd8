"""Numbers with names that masters rely on: frozen within a map version. Faults, warnings and refusals are in gateway.codes."""

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
    """Values of register mode: what a setpoint means."""

    FORCE = 0
    VOLTAGE = 1


class ControlBit(IntFlag):
    """Bits of register control_word, which a master writes."""

    ENABLE = 1 << 0
    RESET_FAULT = 1 << 1  # acts whenever written as 1
    TARE = 1 << 2  # acts whenever written as 1
    TAKE_OWNERSHIP = 1 << 3
    VALVE_PULL = 1 << 4
    START_CALIBRATION = 1 << 5
    START_SELF_TEST = 1 << 6


RUN_BITS: Final = int(ControlBit.START_CALIBRATION | ControlBit.START_SELF_TEST)
"""Bits that begin a run on their rise and end it on their fall."""


class StatusBit(IntFlag):
    """Bits of register status_word, which a master reads."""

    ENABLED = 1 << 0
    READY = 1 << 1  # an enable would be accepted (or has been): cell fresh, output acknowledged, no fault
    CONTACT = 1 << 2
    IN_BAND = 1 << 3
    FAULT = 1 << 4
    WARNING = 1 << 5
    LIMITED = 1 << 6
    TARGET_UNREACHABLE = 1 << 7
    PULLING = 1 << 8  # the valve's readback says pull, and control calculates with it
    SWITCHING = 1 << 9  # the valve is on its way: the force is 0 until its readback


class WatchdogBit(IntFlag):
    """Bits of register watchdogs: the two levels below control. The first is the guardian, the second the output device's
    own watchdog, for when this machine itself is gone."""

    GUARDIAN_WATCHES = 1 << 0  # it has the output's line, and writes the safe voltage when control stalls or dies
    DEVICE_ARMED = 1 << 1  # the device's watchdog runs: armed by the gateway, and read back
    DEVICE_TRIPPED = 1 << 2  # latched: reset_fault clears it
    DEVICE_HAS_NONE = 1 << 3  # the rig file accepts that


class LimitedBy(IntEnum):
    """Limit that kept the voltage from what the law asked for, strongest first when several act."""

    NONE = 0
    VOLTAGE_SLEW = 1
    VOLTAGE_RANGE = 2
    TRIM_RANGE = 3
    CALIBRATION_RANGE = 4
    FORCE_RANGE = 5
    SMALLEST_FORCE = 6


class CalibrationPhase(IntEnum):
    """Progress of the calibration that control_word bit 5 starts."""

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
    SELF_TEST = 11  # the self-test that control_word bit 6 starts
    TESTED = 12  # the self-test is done: self_test_result


class SelfTestVerdict(IntEnum):
    """Verdict on one item of a self-test."""

    NOT_TESTED = 0
    PASSED = 1
    WARNED = 2
    FAILED = 3


class SelfTestResult(IntEnum):
    """Result of the last self-test since the start, or that one runs; the worst verdict of its items."""

    NONE = 0
    PASSED = 1
    WARNED = 2  # or an item could not be tested for which the rig states a force
    FAILED = 3
    RUNNING = 4
    STOPPED = 5  # before its end, by a master


class CommitAction(IntEnum):
    """Request that the commit word of the staging block makes."""

    NONE = 0
    COMMIT = 1
    DRY_RUN = 2  # all checks, nothing stored
    ROLLBACK = 3  # what was in use before, whatever is staged


class CommitStatus(IntEnum):
    """Progress of the last commit."""

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
    DEFECT = 27  # A499: an internal error
    STOPS_CUT = 28  # the read-back of a model with more slip stops than the registers carry
