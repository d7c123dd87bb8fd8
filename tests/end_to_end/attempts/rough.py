"""What may cost the force, but nothing else: processes that die or stand still, a rig that fails, masters that write anything,
runs that are begun and cut, files of the state directory that go or are overwritten."""

import contextlib
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from typing import Final

from tests.end_to_end.attempts.attempted_gateway import DEFECTS, Attempted, ask_http, client, wake, write

_SPARED_S: Final = 25.0
"""Between two deaths of one process: five restarts within a minute end the gateway, and as many of its rig leave that off."""
_DEADLY: Final = (signal.SIGKILL, signal.SIGSEGV, signal.SIGABRT, signal.SIGUSR1, signal.SIGALRM)
_SETTINGS: Final = (
    "cell.silent=true", "output.refuse=true", "air.off=true", "cell.noise=0.5", "creep=on", "leak=0.1", "output.unplug=true",
    "cell.unplug=true", "nonsense=1", "cell.noise=-3",
)  # fmt: skip
_WORDS: Final = (0, 1, 2, 4, 8, 32, 64, 65535)
_LOST: Final = ("recordings", "calibrations", "plants", "events.jsonl")
_ODD: Final = ("recordings/0009.fgr", "recordings/x", "events.jsonl", "calibrations/0003.yaml", "recordings/0010.fgr/x")
_COMMANDS: Final = ("stop", "enable", "setpoint", "take-ownership", "reset", "tare", "record")


def kill(scene: Attempted) -> None:
    """Control, or the simulated rig, by a signal that no program survives."""
    part = scene.draw.choice(("control_process", "simulated_rig"))
    if time.monotonic() - scene.last_kill_s.get(part, -_SPARED_S) < _SPARED_S:
        return
    scene.last_kill_s[part] = time.monotonic()
    for pid in scene.pids(part):
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, scene.draw.choice(_DEADLY))


def freeze(scene: Attempted) -> None:
    """A process that stands still for a while; control is then replaced, which is a death of it."""
    part, longest_s = scene.draw.choice((("control_process", 1.0), ("simulated_rig", 1.0), ("gateway run", 0.2)))
    stands_s = scene.draw.uniform(0.02, longest_s)
    if part == "control_process":
        if time.monotonic() - scene.last_kill_s.get(part, -_SPARED_S) < _SPARED_S:
            return
        scene.last_kill_s[part] = time.monotonic()
    for pid in scene.pids(part):
        os.kill(pid, signal.SIGSTOP)
    scene.is_over.wait(stands_s)
    wake(scene)


def fail_rig(scene: Attempted) -> None:
    """A fault or an effect of the simulated rig, or a name or number that there is not."""
    scene.verb("sim", "set", scene.draw.choice(_SETTINGS), "--state", str(scene.gateway.state))


def write_anything(scene: Attempted) -> None:
    """A master that knows the map, but not what it does."""
    draw, master = scene.draw, client(scene.port)
    for _ in range(draw.randint(1, 60)):
        words = [draw.choice((*_WORDS, draw.randint(0, 6000))) for _ in range(draw.randint(1, 12))]
        write(master, draw.choice((0, 0, 0, 1, 4, 200, 300, 1000)), words)
        scene.is_over.wait(draw.choice((0.0, 0.0, 0.02)))
    master.close()


def command_by_page(scene: Attempted) -> None:
    """A command as the page sends it."""
    body = json.dumps({"force_n": scene.draw.choice((5, 12, 30)), "on": True})
    ask_http(scene, "POST", "/api/v1/command/" + scene.draw.choice(_COMMANDS), body)


def cut_run(scene: Attempted) -> None:
    """A self-test or a calibration that is begun, and whose command is ended or killed."""
    master = client(scene.port)
    write(master, 0, [0] * 4)
    master.close()
    words = scene.draw.choice((
        ("self-test", "--gateway", f"127.0.0.1:{scene.port}"),
        ("calibrate", "--quick", "--yes", "--state", str(scene.gateway.state)),
    ))  # fmt: skip
    command = [sys.executable, "-m", "gateway", *words]
    run = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL, text=True
    )
    with contextlib.suppress(subprocess.TimeoutExpired):
        run.wait(scene.draw.uniform(1.0, 8.0))
    run.send_signal(scene.draw.choice((signal.SIGINT, signal.SIGTERM, signal.SIGKILL)))
    text = run.communicate(timeout=60.0)[0]
    scene.say(f"{words[0]} cut: {text[-100:]!r}")
    if any(word in text for word in DEFECTS):
        scene.faults.append(f"{words}: {text[-1500:]}")


def disturb_files(scene: Attempted) -> None:
    """Somebody removes what is kept, or writes over it. The record of writes is left alone: it must hold in the end."""
    draw = scene.draw
    path = scene.gateway.state / draw.choice((*_LOST, *_ODD))
    scene.say(f"files: {path.name}")
    with contextlib.suppress(OSError):
        if path.name in _LOST and draw.random() < 0.5:
            shutil.rmtree(path) if path.is_dir() else path.unlink()
        else:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(draw.randbytes(draw.randint(0, 5000)))


def heal(scene: Attempted) -> None:
    """Let go on what stands still, and clear what is set on the rig, as soon as it answers."""
    wake(scene)
    for _ in range(20):
        scene.verb("sim", "clear", "--state", str(scene.gateway.state))
        if scene.said[-1].endswith(": 0"):
            return
        scene.is_over.wait(0.5)
    scene.faults.append("the simulated rig does not answer")


ACTS: Final[tuple[Callable[[Attempted], None], ...]] = (
    kill, freeze, fail_rig, fail_rig, write_anything, write_anything, command_by_page, command_by_page, cut_run, disturb_files,
)  # fmt: skip
