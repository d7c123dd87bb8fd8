"""What must not cost a held force: bytes, crowds and refused requests on every face, what people look at beside it, a helper
that dies, a disk that is full, a log that nobody reads."""

import contextlib
import os
import resource
import signal
import socket
import struct
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Final

from tests.end_to_end.attempts.attempted_gateway import Attempted, ask_http, client, ready, write

_READ = struct.pack(">HHHBBHH", 1, 0, 6, 1, 3, 100, 10)
_UNKNOWN_FUNCTIONS = (0, 7, 8, 11, 12, 17, 20, 21, 24, 43, 99, 128, 255)
_REFUSED_ADDRESSES = (5, 9, 20, 50, 100, 110, 150, 400, 1200, 1499, 1500, 3000, 65535)
_PATHS = (
    "/",
    "/healthz",
    "/api/v1/state",
    "/api/v1/recordings",
    "/static/app.js",
    "/static/../../etc/passwd",
    "/%00",
    "/events",
)
_BODIES = ('{"force_n": 1e9}', '{"force_n": NaN}', "[]", "{", "null", '{"force_n": [1]}', '{"on": 3}', "x" * 100_000)
_REQUESTS = (b"{}\n", b"\xff\xfe\n", b"[]\n", b'{"command": 5}\n', b"x" * 100_000, b"null\n", b"[[" * 5000 + b"\n")
_VERBS: Final = (
    ("recordings", "list"), ("recordings", "show", "last"), ("recordings", "export", "last", "-o", "{folder}/last.parquet"),
    ("recordings", "keep", "1"), ("recordings", "delete", "1"), ("recordings", "prune", "--days", "1"), ("record", "on"),
    ("record", "off"), ("events", "--since", "2m"), ("audit", "show"), ("audit", "verify"), ("calibration", "list"),
    ("calibration", "use", "7"), ("backup", "{folder}/backup.tar.gz"), ("report", "{folder}/report.tar.gz"), ("sim", "list"),
    ("restore", "{folder}/backup.tar.gz"), ("replay", "last"),
)  # fmt: skip


def _connect(port: int) -> socket.socket:
    return socket.create_connection(("127.0.0.1", port), timeout=2.0)


def send_bytes(scene: Attempted) -> None:
    """Something on the Modbus face that is no request, or one in pieces, or thousands that nobody waits for."""
    draw: Random = scene.draw
    with contextlib.suppress(OSError), _connect(scene.port) as wire:
        match draw.randrange(6):
            case 0:
                wire.sendall(b"\xff" + draw.randbytes(draw.randint(1, 3000)))
            case 1:
                wire.sendall(_READ[: draw.randint(1, 11)])
                wire.shutdown(socket.SHUT_WR)
            case 2:
                wire.sendall(_READ * 3000)
            case 3:
                wire.sendall(_READ)
                wire.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            case 4:
                wire.sendall(struct.pack(">HHHB", 1, 0, 60_000, 1) + draw.randbytes(20_000))
            case _:
                for number in range(200):
                    words = bytes([draw.choice(_UNKNOWN_FUNCTIONS)]) + draw.randbytes(draw.randint(0, 60))
                    unit = draw.choice((0, 1, 7, 255))
                    wire.sendall(struct.pack(">HHHB", number, 0, len(words) + 1, unit) + words)


def write_refused(scene: Attempted) -> None:
    """Values where none may be written."""
    draw, master = scene.draw, client(scene.port)
    words = [draw.choice((0, 1, 65535, 0x7FC0, draw.randint(0, 65535))) for _ in range(draw.randint(1, 20))]
    write(master, draw.choice(_REFUSED_ADDRESSES), words)
    master.close()


def crowd(scene: Attempted) -> None:
    """Hundreds of connections that say nothing."""
    port = scene.draw.choice((scene.port, ready(scene, "web")[1], ready(scene, "metrics")[1]))
    with contextlib.ExitStack() as crowded, contextlib.suppress(OSError):
        for _ in range(300):
            crowded.enter_context(socket.create_connection(("127.0.0.1", port), timeout=0.5))
        scene.is_over.wait(scene.draw.choice((0.0, 0.3)))


def disturb_line(scene: Attempted) -> None:
    """Noise on the serial face, as of another unit."""
    path = next(face["port"] for face in ready(scene, "faces") if face["type"] == "rtu")
    with contextlib.suppress(OSError):
        line = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        try:
            os.write(line, b"\x07" + scene.draw.randbytes(scene.draw.randint(1, 200)))
        finally:
            os.close(line)


def ask_page(scene: Attempted) -> None:
    """A path, method or body that the page does not have."""
    draw = scene.draw
    method, path = draw.choice(("GET", "GET", "POST", "PUT", "HEAD", "BREW")), draw.choice(_PATHS)
    if method == "POST":
        path = "/api/v1/command/" + draw.choice(("enable", "setpoint", "record", "nonsense"))
    ask_http(scene, method, path, draw.choice(_BODIES) if method in ("POST", "PUT") else None)


def ask_socket(scene: Attempted) -> None:
    """A line on control.sock that is no request."""
    with contextlib.suppress(OSError), socket.socket(socket.AF_UNIX) as line:
        line.settimeout(1.0)
        line.connect(str(scene.gateway.state / "control.sock"))
        line.sendall(scene.draw.choice(_REQUESTS))
        line.recv(4096)


def kill_helper(scene: Attempted) -> None:
    """A process that is not between setpoint and wire."""
    pids = [pid for name in ("gateway.watch", "gateway.web", "gateway.telemetry") for pid in scene.pids(name)]
    if pids:
        with contextlib.suppress(ProcessLookupError):
            os.kill(
                scene.draw.choice(pids),
                scene.draw.choice((signal.SIGKILL, signal.SIGTERM, signal.SIGHUP, signal.SIGSTOP)),
            )


def _count_descriptors(pid: int) -> int:
    return sum(1 for _ in Path(f"/proc/{pid}/fd").iterdir())


def take_descriptors(scene: Attempted) -> None:
    """Control may open no further file for a while, as where others of its user have them all."""
    for pid in scene.pids("control_process"):
        with contextlib.suppress(OSError):
            most = resource.prlimit(pid, resource.RLIMIT_NOFILE)
            resource.prlimit(pid, resource.RLIMIT_NOFILE, (_count_descriptors(pid) + scene.draw.randint(0, 3), most[1]))
            scene.is_over.wait(scene.draw.uniform(0.1, 0.8))
            resource.prlimit(pid, resource.RLIMIT_NOFILE, most)


def choose_verb(scene: Attempted) -> tuple[str, ...]:
    """A verb that somebody may ask beside a held force."""
    words = (word.format(folder=scene.rig.parent) for word in scene.draw.choice(_VERBS))
    return (*words, "--state", str(scene.gateway.state))


ACTS: Final[tuple[Callable[[Attempted], None], ...]] = (
    send_bytes, send_bytes, write_refused, write_refused, crowd, disturb_line, ask_page, ask_page, ask_socket, kill_helper,
    take_descriptors,
)  # fmt: skip
