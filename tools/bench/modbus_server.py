"""Requests per second and CPU per request of our Modbus TCP server, beside a libmodbus C server and stock pymodbus.

    python tools/bench/modbus_server.py [--seconds 3] [--rounds 5] [--connections 16] [--bank real|simple] [--compiled] [--json]

Same load generator for all (harness/modbus_load.c: one outstanding request per connection, one epoll), same run, rounds
interleaved so that a busy machine hurts all alike; rates are medians over rounds, CPU is the server process's user + system
time over all its requests. Only ratios mean something: read them, not the absolute numbers.
With the real bank (the default) our FC16 checks thirteen values, owner and state and makes a Command, where the others copy
words, and looks at a write that repeats the last one but for its heartbeat no second time; --bank simple copies words too, and
so compares the servers alone.
--compiled: beside them ours from a wheel of `tools/compile_wheel`, which takes a minute to make.
What is absent (gcc, libmodbus, uvloop, pymodbus) is skipped, and said.
"""

import argparse
import asyncio
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from time import monotonic

from gateway.cli.diagnosis.progress_line import show_progress
from gateway.progress import report, reported

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path[:0] = [str(ROOT)]
LOOPS = ("uvloop", "asyncio")
GOALS: dict[str, dict[str, float]] = {
    "read": {"uvloop": 1.0, "asyncio": 0.85},
    "write": {"uvloop": 0.6},
    "setpoints": {},
}
"""Of ours, on each loop."""
YARDSTICK = "libmodbus (C)"


def real_bank() -> object:
    """Return the bank of the demo rig, as the service builds it."""
    from gateway.profiles import load_rig
    from gateway.registers import RegisterBank
    from gateway.service.running_rig.bank_rules import bank_rules

    rig = load_rig("demo")
    return RegisterBank(rig.register_map, bank_rules(rig), now=monotonic)


async def serve_ours(bank: str) -> None:
    """Serve the bank by the gateway's own server; the real one is published into 100 times a second, as by control."""
    from gateway.fieldbus import ModbusTcpServer, ServerSettings
    from gateway.registers import RegisterBank, Status
    from tests.modbus.memory_bank import MemoryBank

    data = real_bank() if bank == "real" else MemoryBank(2000)
    server = ModbusTcpServer(
        data, ServerSettings(connections=256), on_peer_closed=lambda _peer: None, log=lambda *_: None
    )
    _host, port = await server.start("127.0.0.1", 0)
    print(port, flush=True)
    while True:
        await asyncio.sleep(0.01)
        if isinstance(data, RegisterBank):
            data.publish(Status(force_measured_n=monotonic() % 10.0))


async def serve_pymodbus() -> None:
    """Serve the same registers by pymodbus."""
    from pymodbus.server import ModbusTcpServer
    from pymodbus.simulator import DataType, SimData, SimDevice

    device = SimDevice(1, simdata=[SimData(0, values=0, count=2000, datatype=DataType.REGISTERS)])
    server = ModbusTcpServer(device, address=("127.0.0.1", 0))
    await server.serve_forever(background=True)
    print(server.transport.sockets[0].getsockname()[1], flush=True)
    await asyncio.Event().wait()


def serve(which: str, loop: str, bank: str) -> None:
    """Serve as a process of its own: print the port, then serve until it is ended."""
    main = serve_pymodbus() if which == "pymodbus" else serve_ours(bank)
    if loop == "uvloop":
        import uvloop

        uvloop.run(main)
    else:
        asyncio.run(main)


@dataclass
class Contender:
    """One server in a process of its own, and what was measured of it. loop: of ours; modules: folder of other modules than
    the checkout's."""

    name: str
    command: list[str]
    loop: str = ""
    modules: Path | None = None
    process: subprocess.Popen[str] | None = None
    stderr: int | None = None
    port: int = 0
    rates: list[float] = field(default_factory=list)
    requests: int = 0
    cpu_s: float = 0.0
    faulty: int = 0

    def start(self, stack: ExitStack) -> None:
        """Start the server and read its port."""
        environment = {**os.environ, "PYTHONPATH": str(self.modules)} if self.modules else None
        self.process = stack.enter_context(
            subprocess.Popen(
                self.command, stdout=subprocess.PIPE, stderr=self.stderr, text=True, cwd=ROOT, env=environment
            )
        )
        stack.callback(self.process.kill)
        assert self.process.stdout is not None
        self.port = int(self.process.stdout.readline() or 0)
        if not self.port:
            raise SystemExit(f"{self.name}: the server did not start")

    def cpu_now_s(self) -> float:
        """Return the processor time that its process has taken, s."""
        assert self.process is not None
        after_name = Path(f"/proc/{self.process.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(after_name[11]) + int(after_name[12])) / os.sysconf("SC_CLK_TCK")

    def round(self, load: Path, seconds: float, connections: int, kind: str) -> None:
        """Load it once; note rate and processor time."""
        before_s = self.cpu_now_s()
        command = [str(load), str(self.port), str(seconds), str(connections), kind]
        words = subprocess.run(command, check=True, capture_output=True, text=True, timeout=seconds + 30).stdout.split()
        self.cpu_s += self.cpu_now_s() - before_s
        self.requests += int(words[0])
        self.rates.append(int(words[0]) / float(words[1]))
        self.faulty += int(words[2])

    def clear(self) -> None:
        """Forget the rounds so far."""
        self.rates, self.requests, self.cpu_s, self.faulty = [], 0, 0.0, 0

    @property
    def rate_per_s(self) -> float:
        """Requests per second, median of the rounds."""
        return statistics.median(self.rates)

    @property
    def cpu_us(self) -> float:
        """Processor time per request, us."""
        return 1e6 * self.cpu_s / max(self.requests, 1)


def compile_c(source: str, into: Path, *libraries: str) -> Path | None:
    """Compile a C program with gcc; where that fails, say so and return None."""
    program = into / source.removesuffix(".c")
    command = ["gcc", "-O2", "-o", str(program), str(HERE / "harness" / source), *libraries]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        print(f"SKIPPED {source}: {done.stderr.strip().splitlines()[0]}", file=sys.stderr)
    return None if done.returncode else program


def is_importable(module: str) -> bool:
    """Return whether a module is installed; say so where it is not."""
    import importlib.util

    is_there = importlib.util.find_spec(module) is not None
    if not is_there:
        print(f"SKIPPED everything that needs {module}: it is not installed", file=sys.stderr)
    return is_there


def compiled_modules(into: Path) -> Path | None:
    """Make and unpack a compiled wheel; where that fails, say so and return None."""
    report("compiling the gateway, about a minute")
    done = subprocess.run([sys.executable, ROOT / "tools" / "compile_wheel", into], capture_output=True, text=True)
    if done.returncode:
        print(f"SKIPPED ours, compiled: {done.stderr.strip()}", file=sys.stderr)
        return None
    shutil.unpack_archive(done.stdout.strip(), into / "compiled", "zip")
    return into / "compiled"


def contenders(into: Path, bank: str, *, with_compiled: bool) -> list[Contender]:
    """Return the servers that this machine can run."""
    me = [sys.executable, str(Path(__file__).resolve())]
    servers: list[Contender] = []
    if (server := compile_c("libmodbus_server.c", into, "-lmodbus")) is not None:
        servers.append(Contender(YARDSTICK, [str(server)]))
    compiled = compiled_modules(into) if with_compiled else None
    for loop in LOOPS if is_importable("uvloop") else LOOPS[1:]:
        serve = [*me, "--serve", "ours", "--loop", loop, "--bank", bank]
        servers.append(Contender(f"ours on {loop}", serve, loop))
        if compiled is not None:
            servers.append(Contender(f"compiled, {loop}", serve, loop, compiled))
    if is_importable("pymodbus"):
        servers.append(
            Contender("stock pymodbus", [*me, "--serve", "pymodbus", "--loop", "asyncio"], stderr=subprocess.DEVNULL)
        )
    return servers


def measure_servers(
    load: Path, servers: list[Contender], arguments: argparse.Namespace, kind: str
) -> list[dict[str, object]]:
    """Measure every server and return one row for each. The first, short round warms up and is thrown away."""
    for server in reported(f"{kind}: warming up", servers):
        server.clear()
        server.round(load, 0.3, arguments.connections, kind)
        server.clear()
    for server in reported(f"{kind}: rounds of all servers", servers * arguments.rounds):
        server.round(load, arguments.seconds / arguments.rounds, arguments.connections, kind)
    yardstick = next((server for server in servers if server.name == YARDSTICK), None)
    return [row(server, yardstick, kind) for server in servers]


def row(server: Contender, yardstick: Contender | None, kind: str) -> dict[str, object]:
    """Return a server's figures beside those of the yardstick."""
    goal = GOALS[kind].get(server.loop)
    rate = server.rate_per_s / yardstick.rate_per_s if yardstick else None
    cpu = server.cpu_us / yardstick.cpu_us if yardstick and yardstick.cpu_us else None
    reached = None if goal is None or rate is None else rate >= goal
    return {
        "run": kind,
        "server": server.name,
        "requests_per_s": round(server.rate_per_s),
        "rate_ratio": rate and round(rate, 3),
        "cpu_us_per_request": round(server.cpu_us, 2),
        "cpu_ratio": cpu and round(cpu, 3),
        "rate_goal": goal,
        "goal_reached": reached,
        "faulty_answers": server.faulty,
    }


def print_rows(rows: list[dict[str, object]], title: str) -> None:
    """Print the rows as a table."""
    print(f"\n{title}\n{'server':<18}{'requests/s':>12}{'x libmodbus':>13}{'CPU us/req':>12}{'x libmodbus':>13}  goal")
    for result in rows:
        goal, reached = result["rate_goal"], result["goal_reached"]
        verdict = "" if reached is None else f">= {goal}: {'reached' if reached else 'MISSED'}"
        faulty = f"  {result['faulty_answers']} FAULTY ANSWERS" if result["faulty_answers"] else ""
        cells = [f"{result['requests_per_s']:>12}", f"{result['rate_ratio'] or '-':>13}"]
        cells += [f"{result['cpu_us_per_request']:>12}", f"{result['cpu_ratio'] or '-':>13}"]
        print(f"{result['server']:<18}{''.join(cells)}  {verdict}{faulty}")


def main() -> int:
    """Serve where asked to, else compare."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=3.0, help="load on each server in each of the three runs")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--connections", type=int, default=16)
    parser.add_argument("--bank", choices=("simple", "real"), default="real", help="what ours writes into")
    parser.add_argument("--compiled", action="store_true", help="measure the compiled wheel, too")
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--serve", choices=("ours", "pymodbus"), help=argparse.SUPPRESS)
    parser.add_argument("--loop", choices=("uvloop", "asyncio"), default="asyncio", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.serve:
        serve(arguments.serve, arguments.loop, arguments.bank)
        return 0
    if shutil.which("gcc") is None:
        print("SKIPPED: the load generator and the libmodbus server need gcc", file=sys.stderr)
        return 0
    return compare(arguments)


def compare(arguments: argparse.Namespace) -> int:
    """Compare all servers and print what was measured."""
    started_s = monotonic()
    with ExitStack() as stack, show_progress("modbus servers"):
        report("compiling the load generator and the C server")
        into = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        load = compile_c("modbus_load.c", into)
        if load is None:
            return 1
        servers = contenders(into, arguments.bank, with_compiled=arguments.compiled)
        for server in servers:
            server.start(stack)
        titles = {
            "read": "FC03, 32 registers",
            "write": "FC16, 13 registers, a new heartbeat in each",
            "setpoints": "FC16, 13 registers, a new heartbeat and force in each",
        }
        results = {kind: measure_servers(load, servers, arguments, kind) for kind in titles}
    if arguments.json:
        print(json.dumps([result for rows in results.values() for result in rows], indent=1))
        return 0
    for kind, title in titles.items():
        print_rows(results[kind], f"{title}, {arguments.connections} connections, bank {arguments.bank}")
    print(f"\n{monotonic() - started_s:.0f} s on {os.cpu_count()} cores")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
