"""The control process: one lean asyncio loop with Modbus, both serial ports, the control step and the recorder.

scipy, pandas, matplotlib and jinja2 are never imported here (a full garbage collection costs 2.6 ms lean and 21-36 ms
with them; a test checks). It is started by the guardian, as a rule forked from a process that has imported everything,
feeds its heartbeat from the tick, and ends with the safe voltage on the wire when the guardian says stop or is gone.
"""

import asyncio
import contextlib
import errno
import gc
import json
import signal
import socket
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from gateway.ports import PortError
from gateway.processes import exit_codes
from gateway.processes.durable_file import make_path
from gateway.processes.event_file import EventFile
from gateway.processes.event_log import EventLog
from gateway.processes.exit_cause import Ending
from gateway.processes.scheduling import priority
from gateway.processes.scheduling.priority import use_realtime
from gateway.profiles import ProfileError, Rig, load_rig
from gateway.profiles.kept_rig import keep_rig, kept_rig
from gateway.recording.ring import SampleRing
from gateway.service import banner
from gateway.service.clean_shutdown_marker import CleanShutdownMarker
from gateway.service.guardian_line import GuardianLine
from gateway.service.heartbeat_memory import HeartbeatMemory
from gateway.service.optional_children import Listeners, optional_children
from gateway.service.running_rig.control_loop import Log
from gateway.service.running_rig.faces.faces import with_rtu_face
from gateway.service.running_rig.handover import Handover, left_of
from gateway.service.running_rig.recording.recorded_row import COLUMNS
from gateway.service.running_rig.running_rig import RunningRig
from gateway.service.running_rig.starting import StartError
from gateway.service.supervisor.fork_server import run_main

_GUARDIAN_GONE: Final = (
    "A412 the guardian is gone (killed, or out of memory): the safe voltage goes out at once, and the gateway ends"
)


def main(arguments: list[str]) -> int:
    """Run the control process; return its exit code. arguments: descriptor of the link, options as JSON."""
    link = socket.socket(fileno=int(arguments[0]))
    link.setblocking(False)
    options = json.loads(arguments[1])
    priority.set_nice(priority.LOOP_NICE)
    # A machine that shuts down, systemd, or `pkill` tells every process: the guardian answers, and asks us to ramp. SIGABRT is
    # systemd's where its watchdog has missed the guardian, whose end we then see. A handler, for what is ignored stays so in a
    # child.
    for number in (signal.SIGTERM, signal.SIGABRT):
        signal.signal(number, lambda *_: None)
    with contextlib.suppress(
        OSError
    ):  # what cleans up a disk takes it from a gateway that runs: then it is there again
        make_path(Path(options["state"]))
    with EventLog(source="control", file=EventFile(Path(options["state"]))) as log:
        try:
            rig = kept_rig(options["rig"], simulated=options["simulate"], memory=options["kept_rig"])
            if options["rtu"] is not None:
                rig = with_rtu_face(rig, options["rtu"])
            notes = use_realtime() if options["realtime"] else ()
            if changed := describe_change(rig, options):
                log("start", changed)
            with asyncio.Runner(loop_factory=_loop_factory()) as runner:
                return runner.run(run(rig, options, link, log, notes))
        except ProfileError as error:
            faults = "\n".join(str(fault) for fault in error.faults)
            return _report_start_failure(
                log, faults, exit_codes.CONFIGURATION, f"E151 the rig file has faults:\n{faults}"
            )
        except (StartError, PortError) as error:
            return _report_start_failure(log, str(error), error.exit_code, str(error))


def _report_start_failure(log: EventLog, sentence: str, exit_code: int, event: str) -> int:
    """Keep it in the event file and say why on stderr, as any verb does; return the exit code. A pipe that nobody reads any
    more must not take it away: the guardian starts again whoever ends without a reason."""
    log.note("start", event)
    with contextlib.suppress(OSError):
        print(sentence, file=sys.stderr)
    return exit_code


def prepare(options: dict[str, Any]) -> None:
    """Prepare what takes long the first time: imports, and the types that the rig's files are checked against."""
    _loop_factory()
    with contextlib.suppress(ProfileError):  # told by the process that runs
        keep_rig(options["rig"], simulated=options["simulate"])


def describe_change(rig: Rig, options: dict[str, Any]) -> str:
    """Return W247 for a process that is started again when the rig's files are others by now; rig: what it uses."""
    if options["restarted"] is None:
        return ""
    try:
        if load_rig(options["rig"], simulated=options["simulate"]).fingerprint == rig.fingerprint:
            return ""
        now, later = "have changed", "a new start takes them"
    except ProfileError as error:
        now, later = f"have faults now ({error.faults[0]})", "a new start would be refused"
    return f"W247 the files of rig {rig.name} {now}: it goes on as it was started, {later}"


def sample_ring(descriptor: int | None, log: Log) -> SampleRing | None:
    """Return the ring in the guardian's memory; None without one, which is said: nothing but the processes beside control
    needs it."""
    why = "the kernel has none to share"
    if descriptor is not None:
        try:
            return SampleRing(descriptor, COLUMNS)
        except OSError as error:
            limit = "; a limit on files (ulimit -f) counts for it" if error.errno == errno.EFBIG else ""
            why = f"{error.strerror or error}{limit}"
    log(
        "ring",
        f"A353 no memory for the newest samples: {why}. Neither residual watch nor trend of the page; control goes on",
    )
    return None


def heartbeat_memory(descriptor: int | None) -> HeartbeatMemory | None:
    """Return the memory that the guardian looks into; None without one: then each beat is a message."""
    with contextlib.suppress(OSError):
        return None if descriptor is None else HeartbeatMemory(descriptor)
    return None


def _loop_factory() -> Any:
    """uvloop where it is installed (the `fast` extra), else the standard loop."""
    with contextlib.suppress(ImportError):
        import uvloop

        return uvloop.new_event_loop
    return None


async def run(rig: Rig, options: dict[str, Any], link: socket.socket, log: EventLog, notes: tuple[str, ...]) -> int:
    """Run the rig from the first open port to the final safe-voltage write; return the exit code."""
    async with contextlib.AsyncExitStack() as ending:  # the last one first
        guardian = GuardianLine(link, heartbeat_memory(options["beat"]))
        ending.callback(guardian.close)
        ports = await guardian.simulated_ports(options["rig"]) if rig.simulated else rig.ports()
        if ports is None:
            return exit_codes.DEVICE
        listeners = Listeners(options["listening"])
        notes += listeners.open(rig, {name: options[name] for name in ("web", "metrics")})
        running = RunningRig(rig, ports, Path(options["state"]), guardian, log)
        ending.push_async_callback(running.close)
        ending.callback(listeners.close)
        running.ring = sample_ring(options["ring"], log)
        guardian.on_ports = running.move_ports
        kept = options["kept"] or left_of(CleanShutdownMarker(Path(options["state"])).left)
        handover, restarted = Handover(kept, record=options["record"]), Ending.from_json(options["restarted"])
        ready = await running.start(options["bind"], handover, restarted=restarted)
        ready = replace(ready, notes=ready.notes + notes, http=listeners.addresses)
        gc.collect()
        gc.freeze()
        announcement = {
            "banner": banner.format_banner(ready),
            "info": banner.ready_fields(ready),
            "optional": optional_children(rig, running.ring, listeners.addresses),
            "listening": {name: listeners.addresses[name] for name in listeners.sockets},
        }
        descriptors = (listener.fileno() for listener in listeners.sockets.values())
        guardian.ready(announcement, rig.control.supervision.stall_s, *descriptors)
        running.loop.is_watched = True
        await _wait_first(guardian.told_to_stop, running.failed)
        if running.failed.is_set():
            return exit_codes.FAILED
        await running.ramp_down()
        if guardian.is_gone:
            log("guardian", _GUARDIAN_GONE)
    return exit_codes.OK


async def _wait_first(*events: asyncio.Event) -> None:
    waiting = [asyncio.ensure_future(event.wait()) for event in events]
    await asyncio.wait(waiting, return_when=asyncio.FIRST_COMPLETED)
    for task in waiting:
        task.cancel()
    await asyncio.gather(*waiting, return_exceptions=True)


if __name__ == "__main__":
    run_main(main)
