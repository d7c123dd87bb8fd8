"""A, without a number in the registers: what the guardian, its processes and a calibration run say in the log."""

from typing import Final

from gateway.codes.explanation import Explanation

ALARMS: Final = (
    Explanation(
        "A402",
        "restarted too often",
        "Five restarts within 60 s: the gateway has stopped; the line says whether the safe voltage was acknowledged.",
        "What ended the control process is still there; the line counts the causes.",
        "Read the first A401 line, not the last; machine-busy in the count means A403. Then start again.",
    ),
    Explanation(
        "A404",
        "control loop stalled",
        "The control loop was later than the rig's stall_s although the machine let it run: it calculated, or slept.",
        "An internal error, a disk or driver that held it (the line says `in the kernel`), or a machine that stood still (a "
        "virtual one on a busy host).",
        "Where the line doubts the machine, give it processors of its own. Else report it with the line, and look at the "
        "kernel's log (dmesg).",
    ),
    Explanation(
        "A405",
        "control process stopped",
        "The control process was stopped by a signal or a debugger, and so was replaced.",
        "kill -STOP, Ctrl-Z in a debugger, or a suspended container.",
        "Let it run; to look into a live loop use force-gateway monitor.",
    ),
    Explanation(
        "A406",
        "control process did not start",
        "The machine had no process for it, or it ended or hung before it was ready.",
        "Out of processes or memory (ulimit -u, a container's limit), or a machine that takes more than 30 s for a "
        "start.",
        "free -h and ulimit -u show which; the guardian tries again, each time later.",
    ),
    Explanation(
        "A407",
        "prepared process ended",
        "The process from which control processes are forked in milliseconds is gone. Control goes on; a restart "
        "takes longer.",
        "Somebody ended it, or the machine ran out of memory.",
        "Nothing, if another one was started; else look for what ends processes here (dmesg shows the "
        "out-of-memory killer).",
    ),
    Explanation(
        "A408",
        "simulated rig restarted",
        "The process that simulates regulator, tool and load cell ended; another was started, without pressure, on "
        "other ptys.",
        "Somebody ended it, or an internal error.",
        "Reset the fault (the lines were cut) and enable again.",
    ),
    Explanation(
        "A409",
        "simulated rig stays off",
        "The simulated rig ended four times in a row.",
        "No pseudo terminal to be had, too little memory, or an internal error.",
        "Read the lines above it; ls /dev/pts and free -h show what is short. Then end the gateway and start it again.",
    ),
    Explanation(
        "A410",
        "killed control process does not go",
        "It was killed and is still there after 2 s. The safe voltage is held; no other is started beside it.",
        "The kernel holds it in a call that cannot be interrupted: a disk or network drive that does not answer, or a driver.",
        "dmesg names the disk or driver; unplug the adapter, or restart the machine. It goes on by itself once that ends.",
    ),
    Explanation(
        "A411",
        "too few files may be open",
        "The limit on files, ports and connections that a process may have open is below what the gateway needs.",
        "A small `ulimit -n` in the shell that starts it, LimitNOFILE= of a unit, or a container's limit.",
        "Start it again behind `ulimit -n 4096`, as a service with LimitNOFILE=4096; until then ports, masters or restarts may "
        "fail for want of one.",
        is_warning=True,
    ),
    Explanation(
        "A412",
        "guardian gone",
        "The process that starts and watches all others was ended. Control sends the safe voltage at once; the gateway ends.",
        "kill -9 by hand, the out-of-memory killer (dmesg shows it), or systemd's watchdog.",
        "Look for what ended it, then start again; as a service (force-gateway service install) systemd does that by itself.",
    ),
    Explanation(
        "A330",
        "calibration stopped",
        "A calibration run ended before its last stair; the force went to 0 and the data are kept.",
        "Nobody followed the run any more (a closed terminal), or the recording could not be written.",
        "force-gateway calibrate --resume goes on with the groups that are missing; df -h shows a full disk.",
        is_warning=True,
    ),
    Explanation(
        "A350",
        "a run reached the rig's largest force",
        "A calibration or an experiment measured nearly force_max_n: a ladder leaves out the stairs above, an "
        "experiment ends.",
        "This plant makes more force for a voltage than the calibration in use expects.",
        "Nothing: the new calibration ends there. Raise force_max_n in the rig file only if tool and workpiece "
        "take more.",
    ),
    Explanation(
        "A351",
        "audit not stored",
        "The record of writes could not be put on the disk. It is kept in memory, 2 000 records at most; control goes on.",
        "A full or read-only disk; what is lost beyond that is counted in the audit itself once the disk takes it again.",
        "df -h of the state directory; free some space. force-gateway audit verify afterwards.",
        is_warning=True,
    ),
    Explanation(
        "A352",
        "audit was altered",
        "The gateway found the end of its record of writes removed or changed, at its start or later. It goes on behind it.",
        "Somebody edited or deleted lines, restored an older copy of part of the directory, or the disk lost what it had kept.",
        "force-gateway audit verify names the first place; compare with a backup, and find out who may write there.",
        is_warning=True,
    ),
    Explanation(
        "A353",
        "no memory for the newest samples",
        "Control shares the last minutes with the residual watch and the page, and got no memory for it. Control goes on.",
        "A small limit on the size of files (ulimit -f), which counts for such memory too, a container's limit, or no memory.",
        "Start it again with ulimit -f unlimited (8 MB are enough), or with more memory.",
        is_warning=True,
    ),
    Explanation(
        "A354",
        "self-test item failed",
        "An item of a self-test is so far off that this machine should not press; the line has the numbers and the bounds.",
        "noise, resolution, zero, cell_line: cell, amplifier or cable. sign, scale: wiring, unit or span. response, "
        "leak: air. output_line: the regulator's cable.",
        "Fix what the line names, then run the self-test again. Control itself refuses nothing because of it.",
    ),
    Explanation(
        "A346",
        "residual watch, page or telemetry ended",
        "A process that control can do without died (the line says which); the fourth time it stays off, and its port refuses "
        "callers. Control goes on.",
        "The machine ran out of memory (these are the first to go), somebody ended it, or an internal error.",
        "Look at the lines above it in the log; its section of the rig file (`residual_watch: {enabled: false}`) switches it "
        "off.",
        is_warning=True,
    ),
    Explanation(
        "A331",
        "fit ended without a result",
        "The ladder was run and recorded, but the process that fits it ended without saying anything.",
        "It was killed, the machine ran out of memory, or it hung, on a disk say, for half an hour.",
        "force-gateway fit RECORDING --store does the same in the foreground.",
    ),
)
