"""A: the rig behaves otherwise than it should. Faults latch and put the safe voltage out; warnings do not."""

from typing import Final

from gateway.cli.codes.entry import Entry
from gateway.registers.words import FaultCode, WarningBit

FAULTS: Final = (
    Entry(
        "A302",
        "force has the wrong sign",
        "The voltage rose in contact and the measured force fell.",
        "The load cell's signal wires are exchanged, or it is mounted the other way round.",
        "Exchange SIG+ and SIG-, or set `sign: -1` under load_cell in the rig file.",
        "SIGN_INVERTED",
    ),
    Entry(
        "A303",
        "force has the wrong size",
        "The first rise in contact is less than 30 % or more than 300 % of what the model expects.",
        "Kilograms read as newtons (a factor of 9.81), another cell, or another cylinder than the calibrated one.",
        "Check the unit on the amplifier's display against the rig file; else calibrate this rig.",
        "GAIN_WRONG",
    ),
    Entry(
        "A310",
        "master lost",
        "The owner's heartbeat did not change within the lease.",
        "The robot program stopped, its connection closed, or it writes a constant heartbeat.",
        "Let the master change the heartbeat register at least every lease; then reset with setpoint 0.",
        "MASTER_LOST",
    ),
    Entry(
        "A311",
        "no fresh force sample",
        "The last sample of the load cell is older than the bound.",
        "A loose cable, a power cut at the amplifier, or a rate too low for sample_timeout_s.",
        "Look at sample_age; check the amplifier's power and its output rate.",
        "SAMPLE_STALE",
    ),
    Entry(
        "A312",
        "force reading is frozen",
        "Sample after sample is the same, bit for bit: the force, or the noise of the cell, must have changed it.",
        "The amplifier is in hold or menu mode, or repeats its last value without a cell.",
        "Leave the amplifier's menu and release `hold`; press the cell by hand and watch `force-gateway monitor`.",
        "SAMPLE_FROZEN",
    ),
    Entry(
        "A313",
        "too much force",
        "The measured force passed over_force_n, or the cell is saturated, several samples long.",
        "A collision, a wrong calibration, or a broken cell wire (an open input saturates).",
        "Clear the tool; look at force_measured with the tool in the air before the reset.",
        "OVER_FORCE",
    ),
    Entry(
        "A318",
        "load cell's port lost",
        "The serial port of the load cell went away.",
        "The USB adapter was unplugged or reset itself.",
        "Plug it in again: the gateway reopens it by itself; then reset with setpoint 0.",
        "CELL_LOST",
    ),
    Entry(
        "A314",
        "output device is silent",
        "A voltage was written and not acknowledged in time.",
        "No power at the DAC or regulator, or a broken cable.",
        "Check its power and cable; `force-gateway explain E111`.",
        "OUTPUT_SILENT",
    ),
    Entry(
        "A315",
        "output device refused",
        "The DAC or regulator answered that it will not do what was asked.",
        "A value outside the device's own range, or its watchdog has tripped and is latched.",
        "Compare voltage_max_v with the device's range; reset the device's own alarm.",
        "OUTPUT_REFUSED",
    ),
    Entry(
        "A316",
        "output differs from what was asked",
        "The acknowledged voltage is another than the one written.",
        "Noise on the line, a second talker, or a device set to another range.",
        "Check shield and ground, and that nothing else is connected to the device.",
        "OUTPUT_ALTERED",
    ),
    Entry(
        "A317",
        "output's port lost",
        "The serial port of the output went away; its last voltage may still stand.",
        "The USB adapter was unplugged or reset itself.",
        "Plug it in again: the safe voltage is written first; then reset with setpoint 0.",
        "OUTPUT_LOST",
    ),
    Entry(
        "A319",
        "control loop stalled",
        "The loop came round later than the bound; commands that waited meanwhile were dropped.",
        "The machine is overloaded, suspended, or swapping.",
        "Look for other load (top); `run --realtime` gives the loop priority.",
        "LOOP_STALLED",
    ),
    Entry(
        "A320",
        "a number was not finite",
        "A computation inside the gateway gave NaN or infinity, and the safe voltage was written instead.",
        "A defect of ours, or a calibration from outside its range.",
        "Report it with a recording; go back to the previous calibration.",
        "NOT_FINITE",
    ),
    Entry(
        "A321",
        "voltage-force model invalid",
        "The active calibration fails its checks.",
        "A calibration file that was edited by hand, or a damaged disk.",
        "force-gateway check RIG names file and line.",
        "MODEL_INVALID",
    ),
    Entry(
        "A499",
        "a defect of force-gateway",
        "The control law failed with an exception; the safe voltage was written.",
        "A defect of ours.",
        "Report it with the traceback in the gateway's log.",
        "INTERNAL",
    ),
)

WARNINGS: Final = (
    Entry(
        "A301",
        "target unreachable",
        "Voltage is out and much less force is measured than the model expects (2.31 V, 0.1 N instead of 17.9 N).",
        "No air, a closed valve, or no contact; a tenth of the expected force is kgf read as N. The sentence tells more.",
        "Open the air supply and look at its gauge; then bring the tool into contact; then compare the units.",
        "TARGET_UNREACHABLE",
    ),
    Entry(
        "A340",
        "trim at its limit",
        "The slow correction by the load cell has used up its range.",
        "The calibration no longer fits: another supply pressure, tool or temperature.",
        "Tare in the air, compare model_residual, then calibrate again.",
        "TRIM_SATURATED",
    ),
    Entry(
        "A341",
        "noise on a serial line",
        "Bytes that form no message keep arriving; they are dropped and counted.",
        "A motor cable beside the serial one, a missing ground, or a marginal baud rate.",
        "Separate the cables and connect the shield at one end.",
        "SERIAL_NOISE",
    ),
    Entry(
        "A342",
        "loop is slow",
        "Ticks of the control loop are missed.",
        "Other programs on this machine, or a CPU that sleeps deeply.",
        "Compare missed_ticks over a minute; `run --realtime` gives the loop priority.",
        "SLOW_LOOP",
    ),
    Entry(
        "A343",
        "output device has no watchdog",
        "If this machine loses power, the device holds its last voltage; the rig file accepts that.",
        "The device (an SMC ITV, for one) has none.",
        "Put an air dump valve on the E-stop circuit: separate hardware, always.",
        "NO_WATCHDOG",
    ),
    Entry(
        "A344",
        "coarse clock",
        "The kernel's timer descriptor is missing here, and ticks come from the event loop, rounded to 1 ms.",
        "Not Linux, or a sandbox without timerfd.",
        "Nothing at 100 Hz; for 250 Hz run it on Linux.",
        "CLOCK_FALLBACK",
    ),
    Entry(
        "A345",
        "model differs from the measurements",
        "Two windows in a row, the force was off the rig's plant by more than a quarter of the band; residual_cause says why.",
        "As the name says: worn seals (coulomb-friction), another hose (transport-delay), a cell that warms up (linear-drift).",
        "force-gateway record on, a minute of work, then force-gateway diagnose NUMBER: how sure, and by how much.",
        "MODEL_DIFFERS",
    ),
    Entry(
        "A401",
        "control process restarted",
        "The control process died or stalled; the guardian wrote the safe voltage and started it again, in OFF.",
        "Out of memory, a kill by hand, or a defect; the first cause is in the log line.",
        "Read the log line above the restart; enable again when you know why.",
        "RESTARTED",
    ),
)

OTHERS: Final = (
    Entry(
        "A402",
        "restarted too often",
        "Five restarts within 60 s; the safe voltage is held and the gateway has stopped.",
        "What killed the control process is still there.",
        "Read the first A401 line, not the last; then start again.",
    ),
    Entry(
        "A330",
        "calibration stopped",
        "A calibration run ended before its last stair; the force went to 0 and the data are kept.",
        "Nobody followed the run any more (a closed terminal), or the recording could not be written.",
        "force-gateway calibrate --resume goes on with the groups that are missing; df -h shows a full disk.",
    ),
    Entry(
        "A350",
        "a run reached the rig's largest force",
        "A calibration or an experiment measured nearly force_max_n: a ladder leaves out the stairs above, an experiment ends.",
        "This plant makes more force for a voltage than the calibration in use expects.",
        "Nothing: the new calibration ends there. Raise force_max_n in the rig file only if tool and workpiece take more.",
    ),
    Entry(
        "A346",
        "residual watch ended",
        "The process that compares measurements with the rig's plant died; the fourth time it stays off. Control goes on.",
        "The machine ran out of memory (the watch is the first to go), somebody ended it, or a defect of ours.",
        "Look at the lines above it in the log; `residual_watch: {enabled: false}` in the rig file switches it off.",
    ),
    Entry(
        "A331",
        "fit ended without a result",
        "The ladder was run and recorded, but the process that fits it ended without saying anything.",
        "It was killed, or the machine ran out of memory.",
        "force-gateway fit RECORDING --store does the same in the foreground.",
    ),
)

FAULT_CODES: Final = {FaultCode[entry.name]: entry.code for entry in FAULTS}
"""The code of every fault but NONE."""

WARNING_CODES: Final = {WarningBit[entry.name]: entry.code for entry in WARNINGS} | {WarningBit.MASTER_LOST: "A310"}
"""The code of every warning bit."""
