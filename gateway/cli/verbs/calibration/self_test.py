"""`self-test`: start the rig's self-test by Modbus as a robot does, follow it, and tell the verdict on each item."""

import json
import sys
import time
from typing import TYPE_CHECKING, Any, Final

import click

from gateway.cli.errors import CliError
from gateway.cli.options import gateway_options, json_option
from gateway.cli.terminal import can_write_over
from gateway.processes import exit_codes

if TYPE_CHECKING:
    from gateway.cli.master.client import GatewayClient
    from gateway.cli.master.wires import Wire
    from gateway.registers import Register

_LOOK_S: Final = 0.05  # a heartbeat with each look: the shortest usual lease is 200 ms
_LONGEST_S: Final = 30.0
_PREFIX: Final = "self_test_"


EXAMPLES = ("self-test", "self-test --json")


@click.command()
@gateway_options
@json_option
def command(*, wire: "Wire", unit: int, map_name: str, as_json: bool) -> None:
    """Test load cell, force, response and both lines in under 20 s.

    Presses with no more than the rig's self_test.force_n, against whatever the tool touches, and goes back to 0; Ctrl-C ends it
    sooner. Begins from off or ready with force 0. Exit code 1 when an item failed, or the test did not come to its end.
    """
    from gateway.cli.master.client import GatewayClient
    from gateway.cli.master.refusal_text import explain_refusals
    from gateway.profiles import load_register_map

    register_map = load_register_map(map_name)
    with GatewayClient(wire, unit, register_map) as client:
        with explain_refusals(client):
            client.check_map()
            run = _SelfTest(client)
        _run_to_its_end(run, shows=can_write_over(sys.stderr) and not as_json)
        with explain_refusals(client):
            answer = run.answer(wire)
            why = run.tell_fault() if answer["result"] in ("stopped", "failed") else ""
    _tell(answer, as_json=as_json)
    if why:
        click.echo(why, err=True)
    if answer["result"] not in ("passed", "warned"):
        sys.exit(1)


def _run_to_its_end(run: "_SelfTest", *, shows: bool) -> None:
    """Begin it and follow it; whatever ends this process ends the test."""
    from gateway.cli.master.ending_signals import watch_to_the_end

    try:
        ended_by = watch_to_the_end(run.begin, lambda: run.follow(shows=shows), run.stop)
    except CliError as error:
        if error.exit_code != exit_codes.DEVICE:
            raise
        raise CliError(f"{error.format_message()}\n  {_what_is_left(run)}", error.exit_code) from None
    if ended_by:
        raise CliError("self-test stopped; the force went to 0", exit_codes.BY_SIGNAL + ended_by)


def _what_is_left(run: "_SelfTest") -> str:
    """Stop a test behind an answer that is lost, for nobody looks at it any more; return what is known of it in words."""
    try:
        if not run.may_run():
            return "the self-test has not begun"
        run.stop()
    except CliError:
        return "whether the self-test goes on there nobody knows; it ends by itself, and by control_word 0"
    return "the self-test was stopped; the force went to 0"


class _SelfTest:
    """One self-test on a gateway, by its registers."""

    def __init__(self, client: "GatewayClient") -> None:
        from gateway.cli.master.first_heartbeat import draw_first_heartbeat

        register_map = client.register_map
        found = [one for one in register_map.registers_of("proof") if one.name.startswith(_PREFIX)]
        if not found:
            raise CliError(f"map {register_map.name} has no self-test registers")
        self._client = client
        self._registers: dict[str, Register] = {one.name.removeprefix(_PREFIX): one for one in found}
        self._word, self._heartbeat = register_map.find("control_word"), register_map.find("heartbeat")
        (beat,) = client.read_values([self._heartbeat])
        self._beat = draw_first_heartbeat(int(beat.value))
        self._has_begun = False

    def begin(self) -> None:
        """Write the bit, in one request with a new heartbeat."""
        from gateway.registers.words import ControlBit, SelfTestResult

        if self._read()["result"] == SelfTestResult.RUNNING:  # its bit would not rise, and our Ctrl-C would end it
            raise CliError("W310 a self-test runs there already: wait for its end; control_word 0 ends it")
        self._write(int(ControlBit.START_SELF_TEST))
        self._has_begun = True

    def may_run(self) -> bool:
        """Decide whether it runs. Where the answer to its start was lost the gateway is asked: what presses there may be
        another master's, which no stop of ours may end. CliError where it does not answer."""
        from gateway.registers.words import SelfTestResult

        return self._has_begun or self._read()["result"] == SelfTestResult.RUNNING

    def stop(self) -> None:
        """End the test: the force goes to 0."""
        self._write(0)

    def follow(self, *, shows: bool) -> None:
        """Wait for its end. shows: one line on the terminal, written over and over, and gone with the wait."""
        try:
            self._follow(shows=shows)
        finally:
            if shows:
                click.echo("\r\033[K", nl=False, err=True)

    def _follow(self, *, shows: bool) -> None:
        from gateway.registers.words import SelfTestResult

        end_s = time.monotonic() + _LONGEST_S
        while (result := int(self._read_values("self_test_result")[0])) == SelfTestResult.RUNNING:
            began_s = time.monotonic()
            if began_s > end_s:
                self.stop()
                raise CliError(f"the self-test did not end within {_LONGEST_S:g} s; it was stopped")
            if shows:
                self._write(None)
                self._show()
            time.sleep(max(0.0, _LOOK_S - (time.monotonic() - began_s)))  # a slow line has taken that time already
            self._write(None)
        if result == SelfTestResult.NONE:  # on a serial line no connection breaks with the process behind it
            ended = "and the self-test has ended with it: its log has the first cause"
            raise CliError(f"A401 the gateway has started anew, in OFF, {ended}")

    def answer(self, wire: "Wire") -> dict[str, Any]:
        """Return result, number and items; each with its numbers where the gateway is on this machine."""
        values = self._read()
        number = values.pop("count")
        names = {name: self._registers[name].values.get(value, "?") for name, value in values.items()}
        answer: dict[str, Any] = {"result": names.pop("result"), "number": number}
        answer["items"] = {name: {"verdict": verdict.replace("_", " "), "text": ""} for name, verdict in names.items()}
        told = _ask_gateway(wire, number)
        for name, item in answer["items"].items():
            item["text"] = told.get(name, {}).get("text", "")
        return answer

    def tell_fault(self) -> str:
        """Return the fault that has stopped it and what to do; empty where none is latched."""
        from gateway.codes.faults import FaultCode

        fault = FaultCode(int(self._read_values("fault_code")[0])).explanation
        if not fault.code:
            return ""
        return (
            f"{fault.code} {fault.title}: {fault.seen} The self-test has stopped\n"
            f"  {fault.do} (force-gateway explain {fault.code})"
        )

    def _read(self) -> dict[str, int]:
        from gateway.cli.master.refusal_text import explain_refusals

        with explain_refusals(self._client):
            readings = self._client.read_values(list(self._registers.values()))
        return {name: int(reading.value) for name, reading in zip(self._registers, readings, strict=True)}

    def _read_values(self, *names: str) -> list[float]:
        """Read what stands close together: between two beats a slow line has no time for a whole block."""
        from gateway.cli.master.refusal_text import explain_refusals

        find = self._client.register_map.find
        with explain_refusals(self._client):
            return [reading.value for reading in self._client.read_values([find(name) for name in names])]

    def _write(self, word: int | None) -> None:
        from gateway.cli.master.byte_order_proof import write_with_proof
        from gateway.cli.master.client import Assignment
        from gateway.cli.master.refusal_text import explain_refusals

        self._beat = (self._beat + 1) % 0x10000
        assignments = [Assignment(self._heartbeat, self._heartbeat.encode(self._beat))]
        if word is not None:
            assignments.insert(0, Assignment(self._word, self._word.encode(word)))
        with explain_refusals(self._client):
            frames = self._client.frames(assignments)
        with explain_refusals(self._client, frames):
            for frame in frames:
                write_with_proof(self._client, frame)

    def _show(self) -> None:
        progress, left_s = self._read_values("calibration_progress", "calibration_time_left")
        (force_n,) = self._read_values("force_measured")
        click.echo(
            f"\rself-test {progress / 10:3.0f} %, {left_s:2.0f} s left, {force_n:6.2f} N\033[K", nl=False, err=True
        )


def _ask_gateway(wire: "Wire", number: int) -> dict[str, Any]:
    """Return the items as the gateway itself tells them, where it is on this machine."""
    from gateway.cli.control_socket import ask
    from gateway.cli.master.local_gateways import sockets_near, usual_root

    for directory in sockets_near(wire, usual_root()):
        try:
            if wire.is_served_by(ask(directory, {"do": "running"})):
                told = ask(directory, {"do": "self-test"})
                return dict(told["items"]) if told["number"] & 0xFFFF == number else {}
        except CliError:
            continue
    return {}


def _tell(answer: dict[str, Any], *, as_json: bool) -> None:
    if as_json:
        click.echo(json.dumps(answer, indent=2))
        return
    marks = {"passed": "ok", "warned": "WARN", "failed": "FAIL"}
    for name, item in answer["items"].items():
        mark = marks.get(item["verdict"], "-")
        click.echo(f"{mark:<5} {name.replace('_', ' '):<12} {item['text'] or item['verdict']}")
    click.echo(f"self-test {answer['number']} {answer['result']}")
