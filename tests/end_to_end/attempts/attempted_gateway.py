"""A real gateway that is attempted upon from outside: who holds a force on it, who looks on, and its processes by name.

The one who looks on has a connection of its own and judges by the registers alone, each 30 ms.
"""

import contextlib
import http.client
import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import Any

from pymodbus.client import ModbusTcpClient
from pymodbus.exceptions import ModbusException

from tests.end_to_end.conftest import RunningGateway, start, stop

FORCE = 1200  # 12 N, in counts
ENABLE, RESET, TAKE_OWNERSHIP = 1, 2, 8
ENABLED, IN_BAND = 1, 8  # bits of status_word
_COMMANDS, _STATUS = 16, 24  # registers of both blocks that are asked of here
_LOOK_S, _BEAT_S = 0.03, 0.05
_VERB_S = 120.0
_RIG = Path("profiles/rigs/demo.yaml")
DEFECTS = ("Traceback", "never retrieved", "never awaited")
"""What no log and no verb may say, whatever is done."""


@dataclass(frozen=True, slots=True)
class Look:
    """at_s: when it was asked; took_s: until the answer; words: the status block."""

    at_s: float
    took_s: float
    words: tuple[int, ...]

    def holds(self) -> bool:
        """Whether the force of the one who holds is there, as far as noise and a tick of the cell allow."""
        return bool(self.words[0] & ENABLED) and self.words[10] == 0 and abs(self.words[2] - FORCE) < 250


@dataclass
class Attempted:
    """draw: every chance is its; said: what was done, in order; looks: what the one who looks on has seen."""

    gateway: RunningGateway
    rig: Path
    draw: Random
    said: list[str] = field(default_factory=list)
    looks: list[Look] = field(default_factory=list)
    is_held: threading.Event = field(default_factory=threading.Event)
    is_over: threading.Event = field(default_factory=threading.Event)
    faults: list[str] = field(default_factory=list)
    last_kill_s: dict[str, float] = field(default_factory=dict)

    @property
    def port(self) -> int:
        return self.gateway.port

    def say(self, text: str) -> None:
        self.said.append(f"{time.monotonic():.2f} {text}")

    def verb(self, *words: str) -> None:
        """A verb of the command line in a process of its own, which may be refused, but neither break nor be silent."""
        command = ["nice", "-n", "5", sys.executable, "-m", "gateway", *words]
        done = subprocess.run(
            command, capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=_VERB_S, check=False
        )
        text = done.stdout + done.stderr
        self.say(f"{' '.join(words[:4])}: {done.returncode}")
        if done.returncode < 0 or any(word in text for word in DEFECTS) or (done.returncode and not text.strip()):
            self.faults.append(f"{words} ended with {done.returncode}: {text[-1500:]}")

    def processes(self) -> dict[int, str]:
        """Every process of the gateway with its command line: the guardian's own, and all below it."""
        parents: dict[int, int] = {}
        for folder in Path("/proc").glob("[0-9]*"):
            with contextlib.suppress(OSError):
                parents[int(folder.name)] = int((folder / "stat").read_text().rpartition(")")[2].split()[1])
        ours = {self.gateway.process.pid}
        while more := {child for child, parent in parents.items() if parent in ours} - ours:
            ours |= more
        found = {}
        for pid in ours:
            with contextlib.suppress(OSError):
                found[pid] = Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode()
        return found

    def pids(self, part: str) -> list[int]:
        """The processes whose command line holds this."""
        return sorted(pid for pid, words in self.processes().items() if part in words)


def client(port: int) -> ModbusTcpClient:
    return ModbusTcpClient("127.0.0.1", port=port, timeout=2.0, retries=0)


def write(master: ModbusTcpClient, address: int, words: list[int]) -> bool:
    """Whether a write was taken. A connection that is lost is made anew at the next one."""
    try:
        return not master.write_registers(address, words, device_id=1).isError()
    except (ModbusException, OSError):
        master.close()
        return False


def _look_on(scene: Attempted) -> None:
    eye = client(scene.port)
    while not scene.is_over.wait(_LOOK_S):
        asked_s = time.monotonic()
        with contextlib.suppress(ModbusException, OSError):
            answer = eye.read_holding_registers(100, count=_STATUS, device_id=1)
            if not answer.isError():
                words = tuple(
                    word - 65536 if word >= 32768 and index == 2 else word
                    for index, word in enumerate(answer.registers)
                )
                scene.looks.append(Look(asked_s, time.monotonic() - asked_s, words))
    eye.close()


def _beat(scene: Attempted) -> None:
    """The setpoint and a new heartbeat, from 40002 on as the README advises, for as long as the force is to be held."""
    master, beats = client(scene.port), 30_000
    while not scene.is_over.wait(_BEAT_S):
        if scene.is_held.is_set():
            beats += 1
            write(master, 1, [FORCE, 0, 0, beats & 0xFFFF])
    master.close()


def take_up(scene: Attempted, within_s: float) -> float:
    """Reset what is latched, enable and come into the band; s it took. AssertionError where it does not come about."""
    scene.is_held.clear()
    began_s, beats = time.monotonic(), 0
    master = client(scene.port)

    def command(word: int, force: int) -> None:
        nonlocal beats
        beats += 1
        write(master, 0, [word, force, 0, 0, beats, *[0] * (_COMMANDS - 5)])
        scene.is_over.wait(_BEAT_S)

    with contextlib.closing(master):
        while time.monotonic() - began_s < within_s:
            for word in (0, TAKE_OWNERSHIP, 0, RESET, 0, 0):
                command(word, 0)
            command(ENABLE, FORCE)
            scene.is_held.set()
            asked_s = time.monotonic()
            while time.monotonic() - asked_s < 2.5:
                seen = scene.looks[-1] if scene.looks else None
                if seen and seen.at_s > asked_s and seen.words[0] & IN_BAND and seen.holds():
                    return time.monotonic() - began_s
                scene.is_over.wait(_LOOK_S)
            scene.is_held.clear()
    raise AssertionError(f"no force within {within_s} s: {scene.looks[-1:]}\n" + "\n".join(scene.said[-30:]))


@contextlib.contextmanager
def attempted(folder: Path, draw: Random) -> Iterator[Attempted]:
    """A gateway with every face that needs no certificate, on a rig with or without a lease. At its end: no defect was said,
    and the record of writes holds."""
    rig = folder / "cell.yaml"
    lease = draw.choice(["lease_s: null", "lease_s: 0.5"])
    rig.write_text(_RIG.read_text().replace("name: demo", "name: cell").replace("lease_s: null", lease))
    faces = ("--sim", "--rtu", "--web", "127.0.0.1:0", "--metrics", "127.0.0.1:0", "--record")
    scene = Attempted(start(folder / "state", *faces, rig=str(rig)), rig, draw)
    threads = [threading.Thread(target=act, args=(scene,)) for act in (_look_on, _beat)]
    for thread in threads:
        thread.start()
    try:
        yield scene
    finally:
        scene.is_over.set()
        for thread in threads:
            thread.join()
        wake(scene)
        code = stop(scene.gateway)
    assert code == 0, scene.said[-30:]
    log = scene.gateway.log.read_text()
    assert not [word for word in DEFECTS if word in log], log[-5000:]
    scene.verb("audit", "verify", "--state", str(folder / "state"))
    assert scene.said[-1].endswith(": 0"), scene.said[-1]


def wake(scene: Attempted) -> None:
    """Let every process go on that was stopped."""
    for pid in scene.processes():
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGCONT)


def ready(scene: Attempted, key: str) -> Any:
    """What the first line of READY says of this face: an address and port, or a path."""
    return scene.gateway.ready[key]


def ask_http(scene: Attempted, method: str, path: str, body: str | None = None) -> None:
    """Ask something of the page, a POST with the session and token of a browser. It may refuse, but not have a defect (500)."""
    headers = {}
    page = http.client.HTTPConnection("127.0.0.1", ready(scene, "web")[1], timeout=5.0)
    try:
        with contextlib.closing(page):
            if method == "POST":
                page.request("GET", "/api/v1/session")
                answer = page.getresponse()
                token, cookie = json.loads(answer.read())["csrf"], (answer.getheader("Set-Cookie") or "").split(";")[0]
                headers = {"X-CSRF-Token": token, "Cookie": cookie, "Content-Type": "application/json"}
            page.request(method, path, body, headers)
            status = page.getresponse().status
    except (OSError, http.client.HTTPException, ValueError):
        return  # its process has just died, or is to come
    scene.say(f"{method} {path}: {status}")
    if status == 500:
        scene.faults.append(f"{method} {path} {body!r:.100}: {status}")
