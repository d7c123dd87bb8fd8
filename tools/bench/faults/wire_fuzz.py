#!/usr/bin/env python3
"""What a client that sends garbage costs the others: `tools/bench/faults/wire_fuzz.py [--seconds 20] [--attackers 2]`.

A demo gateway holds 12 N. A probing client reads 13 registers every 5 ms, first alone, then while processes of their own send
whatever they can: noise, frames with wrong lengths, half frames, floods of refused writes, storms of connections. Printed for
both: the probe's p50, p99 and longest answer, bytes of log and events per minute, missed ticks, and whether the force stayed.
Loopback is exempt from the limits of connections and requests: it is the worst case. Ends with 1 where a bound is broken: p99
20 ms, 1 MB of log a minute.
"""

import argparse
import multiprocessing
import random
import socket
import struct
import sys
import tempfile
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from gateway.cli.control_socket import ask
from tools.bench.harness.running_gateway import running_gateway

P99_MS, LOG_BYTES_PER_MIN = 20.0, 1e6
HOLDING = 3


def frame(pdu: bytes, *, protocol: int = 0, length: int | None = None) -> bytes:
    """Return a frame of Modbus TCP, with any length that is asked for."""
    return struct.pack(">HHHB", 7, protocol, len(pdu) + 1 if length is None else length, 1) + pdu


def refused(chance: random.Random) -> bytes:
    """Return a request that is refused for one of many reasons: each has lines of its own in the log."""
    address = chance.choice((0, 1, 2, 3, 5, 8, 13, 100, 200, 202, 302, 416, 430, 1000, 1145, 40001, 65535))
    word = chance.choice((1, 2, 4, 16, 32, 64, 6001, 0x4140, 0x7FC0, 65535))
    function, count = chance.choice((3, 6, 6, 6, 16, 99)), chance.choice((0, 1, 2, 126))
    if address == 0:
        word |= 1  # who clears enable is obeyed, whoever it is
    if function == 16:
        return struct.pack(">BHHBHH", 16, address, 2, 4, word, 0)
    return struct.pack(">BHH", function, address, word if function == 6 else count)


def garbage(chance: random.Random) -> bytes:
    """Return what one connection sends before the next."""
    way = chance.randrange(8)
    if way == 0:
        return chance.randbytes(chance.randint(1, 4000))
    if way == 1:
        return frame(chance.randbytes(chance.randint(1, 250)), length=chance.choice((0, 1, 255, 65535)))
    if way == 2:
        return frame(b"\x10\x00\x00", length=200)  # the rest never comes
    if way == 3:
        return frame(struct.pack(">BHH", 6, chance.randrange(1, 65536), chance.randrange(65536))) * 200
    if way == 4:
        return frame(bytes((chance.randrange(256),)) + chance.randbytes(6)) * 200
    if way == 5:
        return frame(struct.pack(">BHH", 3, 100, 125)) * 500  # and nobody reads the answers
    if way == 6:
        return b"".join(frame(refused(chance)) for _ in range(300))
    return frame(b"\x03\x00\x00\x00\x01", protocol=chance.randint(1, 9))


def attack(address: tuple[str, int], seed: int) -> None:
    """Send garbage until the process is ended."""
    chance, links = random.Random(seed), list[socket.socket]()
    while True:
        with suppress(OSError):
            link = socket.create_connection(address, timeout=0.2)
            links.append(link)
            link.sendall(garbage(chance))
        if len(links) > 8:
            links.pop(chance.randrange(len(links))).close()


def probe(address: tuple[str, int], seconds: float) -> list[float]:
    """Read 13 registers every 5 ms; return how long each answer took, s, sorted."""
    took = []
    with socket.create_connection(address, timeout=5.0) as link:
        link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        end_s = time.monotonic() + seconds
        while (began_s := time.monotonic()) < end_s:
            link.sendall(frame(struct.pack(">BHH", 3, 100, 13)))
            answer = b""
            while len(answer) < 9 + 26:
                answer += link.recv(1000)
            took.append(time.monotonic() - began_s)
            time.sleep(max(0.0, began_s + 0.005 - time.monotonic()))
    return sorted(took)


def log_bytes(state: Path, told: Path) -> tuple[int, int]:
    """Return the size of what is said (log and events), and of the audit, in which each refused write of consequence stands."""
    said = told.stat().st_size + sum(path.stat().st_size for path in state.glob("events*"))
    return said, sum(path.stat().st_size for path in (state / "audit").glob("*.jsonl"))


@dataclass(frozen=True)
class Stage:
    """A running gateway: its state directory, what it has said, where its masters are."""

    state: Path
    told: Path
    address: tuple[str, int]

    def measure(self, seconds: float, attackers: int) -> dict[str, float]:
        """Return the figures of one stretch of time."""
        crowd = [multiprocessing.Process(target=attack, args=(self.address, k), daemon=True) for k in range(attackers)]
        for one in crowd:
            one.start()
        before, loop = log_bytes(self.state, self.told), ask(self.state, {"do": "state"})["loop"]
        took = probe(self.address, seconds)
        after, then = log_bytes(self.state, self.told), ask(self.state, {"do": "state"})
        for one in crowd:
            one.terminate()
            one.join()
        return {
            "p50_ms": 1e3 * took[len(took) // 2],
            "p99_ms": 1e3 * took[int(0.99 * len(took))],
            "longest_ms": 1e3 * took[-1],
            "log_kB_per_min": (after[0] - before[0]) * 60.0 / seconds / 1e3,
            "audit_kB_per_min": (after[1] - before[1]) * 60.0 / seconds / 1e3,
            "missed_percent": 100.0
            * (then["loop"]["missed"] - loop["missed"])
            / (then["loop"]["ticks"] - loop["ticks"]),
            "holds": float(self._state_of_control() == HOLDING),
        }

    def _state_of_control(self) -> int:
        answer: dict[str, Any] = ask(self.state, {"do": "modbus", "via": "web", "pdu": "0300650001"})
        return int(answer["pdu"][-4:], 16)


def run(seconds: float, attackers: int) -> dict[str, dict[str, float]]:
    """Return the figures alone and under attack."""
    with tempfile.NamedTemporaryFile() as told, running_gateway("demo", "--sim", told=told) as gateway:
        gateway.hold()
        stage = Stage(gateway.state, Path(told.name), gateway.modbus)
        return {f"{count} attackers": stage.measure(seconds, count) for count in (0, attackers)}


def main() -> int:
    """Print both stretches; return 1 where a bound is broken."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--attackers", type=int, default=2)
    asked = parser.parse_args()
    found = run(asked.seconds, asked.attackers)
    for name, figures in found.items():
        print(f"{name:>12}  " + "  ".join(f"{key} {value:.2f}" for key, value in figures.items()))
    worst = found[f"{asked.attackers} attackers"]
    return int(worst["p99_ms"] > P99_MS or worst["log_kB_per_min"] * 1e3 > LOG_BYTES_PER_MIN or not worst["holds"])


if __name__ == "__main__":
    sys.exit(main())
