"""`hold`: hold a force from this terminal: enable, heartbeat, one line of state, and a ramp to 0 when told to stop."""

import json
import os
import re
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from math import inf, isfinite
from typing import TYPE_CHECKING, Any, Final

import click

from gateway import defaults
from gateway.cli.command_line.duration import parse_duration_s
from gateway.cli.command_line.numbers import NUMBER
from gateway.cli.command_line.rig_choice import rig_option
from gateway.cli.errors import CliError
from gateway.cli.options import gateway_options, json_option
from gateway.units import format_ms

if TYPE_CHECKING:
    from gateway.cli.force_hold.heartbeat import HeartbeatThread, KnownLease
    from gateway.cli.master.wires import Wire

_SHOW_S: Final = 0.1
_ALWAYS_HEARD: Final = (signal.SIGINT, signal.SIGTERM)  # a script's job in the background begins with SIGINT ignored


def _parse_time(context: click.Context, parameter: click.Parameter, text: str | None) -> float | None:
    """Return the seconds that the option's text means, None where it is not given; BadParameter for no duration, and for 0,
    which pressed for a moment."""
    seconds = parse_duration_s(text) if text is not None else None
    if text is not None and not seconds:
        raise click.BadParameter(f"{text} is no time such as 10s, 500ms or 2min")
    return seconds


class _TakesNegative(click.Command):
    """Takes -3 for a number, to say what is allowed; for click it is an option that does not exist."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Put a negative number behind `--`."""
        negative = [word for word in args if re.fullmatch(r"-\d+\.?\d*", word)]
        if negative and "--" not in args:
            args = [*(word for word in args if word not in negative), "--", *negative]
        return super().parse_args(ctx, args)


EXAMPLES = ("hold 12 --for 1s", "hold 8.5 --for 500ms --rig demo")


@click.command(cls=_TakesNegative)
@click.argument("newton", type=NUMBER)
@click.option("--for", "for_s", callback=_parse_time, metavar="TIME", help="Let go by itself after 10s, 2min, ...")
@click.option("--reset", "resets", is_flag=True, help="Reset a latched fault first.")
@rig_option(
    "The rig that runs there, whose lease sets the pace of the heartbeat  [default: as a gateway on this machine says, else "
    f"{format_ms(defaults.LEASE_S)}]"
)
@gateway_options
@json_option
def command(
    *, newton: float, rig: str | None, for_s: float | None, wire: "Wire", as_json: bool, **options: Any
) -> None:
    """Hold NEWTON until Ctrl-C, which ramps the force to 0.

    Sets the force, enables, and keeps the heartbeat that a rig with a lease wants. A second Ctrl-C skips the ramp; Ctrl-Z
    does what Ctrl-C does. While another one beats it is refused; a force that was left is taken over.

    The lease is read from a gateway on this machine (unless it runs with a --state of its own); for a remote one give
    --rig.
    """
    from gateway.cli.force_hold.heartbeat import HeartbeatThread
    from gateway.cli.force_hold.other_holder import check_nobody_holds
    from gateway.cli.force_hold.sequence import HoldRun
    from gateway.cli.master.client import GatewayClient
    from gateway.cli.master.first_heartbeat import draw_first_heartbeat
    from gateway.cli.master.refusal_text import explain_refusals
    from gateway.profiles import load_register_map

    lease = _read_rig_lease(rig) if rig is not None else _find_gateway_lease(wire)
    register_map = load_register_map(options["map_name"])
    force_n = _check_force(register_map, newton)
    with GatewayClient(wire, options["unit"], register_map) as client:
        with explain_refusals(client):
            client.check_map()
            standing = check_nobody_holds(client)
        run = HoldRun(force_n, heartbeat=draw_first_heartbeat(standing), resets=options["resets"])
        beat = HeartbeatThread(client, run, lease, time.monotonic)
        _show_until_end(beat, for_s, as_json=as_json)
    _report_end(beat, client.where, as_json=as_json)


def _read_rig_lease(rig: str) -> "KnownLease":
    """Return the lease that the rig file gives."""
    from gateway.cli.force_hold.heartbeat import KnownLease
    from gateway.profiles import load_rig

    supervision = load_rig(rig, simulated=True).control.supervision
    return KnownLease(supervision.lease_s, supervision.lease_action.value)


def _find_gateway_lease(wire: "Wire") -> "KnownLease | None":
    """Return the lease of the gateway behind this wire, where it runs on this machine; None where it is not known."""
    from gateway.cli.force_hold.heartbeat import KnownLease
    from gateway.cli.master.local_gateways import running_behind, usual_root

    answer = running_behind(wire, usual_root())
    if answer is None or not {"lease_s", "lease_action"} <= answer.keys():
        return None
    return KnownLease(answer["lease_s"], str(answer["lease_action"]))


def _check_force(register_map: Any, newton: float) -> float:
    """Return a force that the register can carry; the rig's own limits are the gateway's to tell."""
    from gateway.cli.command_line.numbers import describe_allowed
    from gateway.cli.master.value_text import encode_within, limits_of

    register = register_map.find("force_setpoint")
    low, high = limits_of(register)
    try:
        if not (isfinite(newton) and newton >= 0.0):
            raise ValueError(describe_allowed(f"{newton:g}", low, high, register.unit))
        encode_within(register, newton)
    except ValueError as error:
        raise click.UsageError(f"NEWTON: {error}") from None
    return newton


def _show_until_end(beat: "HeartbeatThread", for_s: float | None, *, as_json: bool) -> None:
    """Show the line until the beat ends; what stops it comes as a signal, as the end of its time (the beat's own to see, for a
    paused terminal keeps us here), or as a closed pipe."""
    from gateway.cli.force_hold.state_line import StateLine

    state_line, began_s = StateLine(as_json=as_json), time.monotonic()
    beat.lasts_s = inf if for_s is None else for_s
    with _handle_signals(beat):
        beat.start()
        try:
            while beat.is_alive():
                beat.join(_SHOW_S)
                if beat.status:
                    state_line.show(beat.status, time.monotonic() - began_s)
        except BrokenPipeError:
            sys.stdout = open("/dev/null", "w")  # noqa: PTH123, SIM115 - nobody reads what would follow
        finally:  # a full disk behind stdout, too: what ends us lets go of the force first
            beat.stopping.set()
            beat.join()
    with suppress(BrokenPipeError):
        state_line.close()


@contextmanager
def _handle_signals(beat: "HeartbeatThread", clock: Callable[[], float] = time.monotonic) -> Iterator[None]:
    """The first of Ctrl-C, Ctrl-Z, SIGTERM, a closed terminal (not with nohup) and of whatever would end or suspend us ramps
    down, a second one but a closed terminal drops the force at once; where none is held any more it ends us. Suspended by
    Ctrl-Z nobody would watch a force that goes on, and its heartbeat would stand still."""
    from gateway.cli.master.ending_signals import handle_ends
    from gateway.service.supervisor.event_wait import StopSignals

    stops = StopSignals(clock)

    def on_signal(number: int, frame: object) -> None:
        if not stops.asks_anew(number):
            return
        if beat.stopping.is_set() and not beat.is_alive():
            signal.signal(number, signal.SIG_DFL)  # whoever does not read the last lines keeps us here
            os.kill(os.getpid(), number)
        else:
            (beat.dropping if beat.stopping.is_set() and number != signal.SIGHUP else beat.stopping).set()

    with handle_ends(on_signal, always=_ALWAYS_HEARD):
        yield


def _report_end(beat: "HeartbeatThread", where: str, *, as_json: bool) -> None:
    """Print how it ended; CliError when not as asked."""
    from gateway.cli.force_hold.sequence import HoldEnd

    end = beat.hold.end
    if as_json:
        click.echo(json.dumps({"end": end.value if end and not beat.failure else "failed"}))
    if beat.failure:
        raise beat.failure
    if end is HoldEnd.FAULT:
        raise CliError(_describe_fault(beat))
    if end is HoldEnd.DISABLED:
        raise CliError(f"{_describe_disabled(beat)} ({where})")
    if not as_json:
        click.echo("0 N, disabled: the output has been told the safe voltage", err=True)


def _describe_disabled(beat: "HeartbeatThread") -> str:
    """Return why the output is off although nobody here has asked for it."""
    from gateway.codes.warning_bits import WarningBit

    if beat.warned & WarningBit.MASTER_LOST:
        return "A310 the lease ran out: the gateway has ramped to 0 N and let go; a busy machine? --rig tells the lease"
    if beat.warned & WarningBit.RESTARTED:
        return "A401 the gateway has started anew, in OFF: its log has the first cause"
    if beat.hold.is_unheard:
        return "E131 the enable got no answer, and the output is off: it was not heard; hold again"
    return "W336 somebody else has cleared enable; the output has been told the safe voltage"


def _describe_fault(beat: "HeartbeatThread") -> str:
    """Return the fault's sentence, what is known of the output, and how to go on."""
    from gateway.codes.faults import FaultCode

    assert beat.status
    entry = beat.status.fault.explanation
    obeys = "The output is at the safe voltage"
    doubted = (FaultCode.OUTPUT_SILENT, FaultCode.OUTPUT_REFUSED, FaultCode.OUTPUT_ALTERED, FaultCode.OUTPUT_LOST)
    if beat.status.fault in doubted:
        obeys = "The output is told the safe voltage, and nobody knows whether it obeys: look at the tool"
    when = f"while holding {beat.hold.force_n:g} N" if beat.hold.is_pressing else "is latched"
    return (
        f"{entry.code} {entry.title}, {when}: {entry.seen} {obeys}\n"
        f"  {entry.do} (force-gateway explain {entry.code})\n"
        "  then: the same command with --reset"
    )
