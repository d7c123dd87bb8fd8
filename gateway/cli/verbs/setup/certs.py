"""`certs`: a test CA, the gateway's certificate and those of its clients, and what to do with them."""

import json
import re
from datetime import UTC, datetime, timedelta
from ipaddress import ip_address
from pathlib import Path
from shlex import quote
from typing import Final

import click

from gateway.cli.command_line.given_path import GivenPath
from gateway.cli.command_line.numbers import Whole
from gateway.cli.errors import CliError
from gateway.modbus import Role
from gateway.modbus.certificate import ROLES
from gateway.plain_file import exists, tell_place_and_refusal
from gateway.processes import exit_codes

_HOSTS: Final = ("localhost", "127.0.0.1")
_CLIENTS: Final = ("robot:setpoint", "service:calibration", "panel:monitor")
_NAME: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,62}")
_HOST: Final = re.compile(
    r"(?=.{1,253}$)([A-Za-z0-9]([\w-]{0,61}[A-Za-z0-9])?\.)*(?!\d+$)[A-Za-z0-9]([\w-]{0,61}[A-Za-z0-9])?", re.ASCII
)
_PLAIN: Final = re.compile(r"[\w/](?:[\w/. -]|:(?! |$))*")
_TAKEN: Final = ("ca", "gateway")


def check_hosts(context: click.Context, parameter: click.Parameter, values: tuple[str, ...]) -> tuple[str, ...]:
    """Return the names and addresses as they were given, for an option's callback."""
    for value in values:
        if not _HOST.fullmatch(value) and not _is_address(value):
            raise click.BadParameter(
                f"{value!r} is neither a host name such as cell3.local nor an address, without a port"
            )
    return values


def _is_address(text: str) -> bool:
    try:
        ip_address(text)
    except ValueError:
        return False
    return True


def parse_clients(context: click.Context, parameter: click.Parameter, values: tuple[str, ...]) -> dict[str, Role]:
    """Return name -> role of each NAME:ROLE, for an option's callback."""
    clients: dict[str, Role] = {}
    for value in values:
        name, _, role = value.partition(":")
        if role not in ROLES:
            raise click.BadParameter(f"{value} is not NAME:ROLE; roles are {', '.join(ROLES)}")
        if not _NAME.fullmatch(name) or name in _TAKEN:
            raise click.BadParameter(f"{name!r} is no name for a client: letters, digits, . _ - (not ca, not gateway)")
        if name in clients:
            raise click.BadParameter(f"{name} is there twice: a certificate has one role")
        clients[name] = ROLES[role]
    return clients


EXAMPLES = (
    "certs keys --host 192.168.125.20 --client robot:setpoint",
    "certs more-keys --host localhost --client panel:monitor",
)


@click.command()
@click.argument("folder", metavar="DIR", type=GivenPath(file_okay=False))
@click.option(
    "--host",
    "hosts",
    callback=check_hosts,
    multiple=True,
    metavar="NAME|IP",
    help=f"The gateway is reached by this  [default: {', '.join(_HOSTS)}]",
)
@click.option(
    "--client",
    "clients",
    multiple=True,
    callback=parse_clients,
    metavar="NAME:ROLE",
    help=f"A client and its role: {', '.join(ROLES)}  [default: {', '.join(_CLIENTS)}]",
)
@click.option("--days", type=Whole(1, 7300), default=825, show_default=True, help="How long they are valid.")
def command(*, folder: Path, hosts: tuple[str, ...], clients: dict[str, Role], days: int) -> None:
    """Make certificates for Modbus/TCP Security.

    A CA, the gateway's certificate and one per client, with the role in it. Where DIR holds a CA already, it signs further
    clients. Nothing is overwritten. The CA's key is not protected by a password: for a plant, keep it off the machine.
    """
    is_first = not exists(folder / "ca.crt")
    if not clients and is_first:
        clients = parse_clients(click.get_current_context(), click.Option(["--client"]), _CLIENTS)
    if not is_first and not clients and not hosts:
        raise click.UsageError(f"{folder} holds a CA already: say with --client NAME:ROLE whom it shall sign for")
    makes_server = is_first or bool(hosts)
    _refuse_to_overwrite(folder, [*(["ca"] if is_first else []), *(["gateway"] if makes_server else []), *clients])
    _make(folder, (hosts or _HOSTS) if makes_server else (), clients, days)
    _say_next_steps(folder, (hosts or _HOSTS)[0], clients)


def _refuse_to_overwrite(folder: Path, names: list[str]) -> None:
    for path in (folder / f"{name}.{kind}" for name in names for kind in ("crt", "key")):
        if exists(path):
            raise CliError(f"E405 {path} exists and was left alone; choose another name or DIR, or remove it first")


def _make(folder: Path, hosts: tuple[str, ...], clients: dict[str, Role], days: int) -> None:
    from gateway.cli.setup import certificates

    folder.mkdir(parents=True, exist_ok=True, mode=0o700)
    made: dict[str, certificates.Signed] = {}
    if exists(folder / "ca.crt"):
        try:
            ca = certificates.load_ca(folder)
        except (OSError, ValueError) as error:
            why = tell_place_and_refusal(error) if isinstance(error, OSError) else str(error)
            sentence = f"E174 the CA in {folder} cannot be used: {why}; another DIR makes a new one"
            raise CliError(sentence, exit_codes.DATA) from None
        _say_earlier_end(folder, ca.certificate.not_valid_after_utc, days)
    else:
        ca = made["ca"] = certificates.make_ca(days)
    if hosts:
        made["gateway"] = certificates.make_server(ca, hosts, days)
    made |= {name: certificates.make_client(ca, name, role, days) for name, role in clients.items()}
    certificates.store(made, folder)
    for name, role in clients.items():
        click.echo(f"{folder / name}.crt, .key   client {name}, role {role.name.lower()}")


def _say_earlier_end(folder: Path, ends: datetime, days: int) -> None:
    if ends < datetime.now(UTC) + timedelta(days=days):
        cure = "make a new CA in another DIR before, for the gateway and every client"
        click.echo(f"{folder / 'ca.crt'} ends on {ends:%Y-%m-%d}, and all that it signs no later: {cure}")


def _in_yaml(text: str) -> str:
    """Return a text as it may stand between braces: quoted where a comma or a colon in it would end it."""
    return text if _PLAIN.fullmatch(text) else json.dumps(text)


def _say_next_steps(folder: Path, host: str, clients: dict[str, Role]) -> None:
    name = next(iter(clients), "CLIENT")
    place, address = folder.resolve(), host if _is_address(host) else "127.0.0.1"
    there = f"[{host}]" if ":" in host else host
    files = {"certificate": "gateway.crt", "key": "gateway.key", "ca": "ca.crt"}
    ours = ", ".join(f"{key}: {_in_yaml(f'{place}/{file}')}" for key, file in files.items())
    ca, client = quote(f"{folder}/ca.crt"), quote(f"{folder}/{name}")
    click.echo(
        f"""
In the rig file (force-gateway check FILE looks at all of it; beyond loopback it wants `allow: [NETWORK]` too):

fieldbus:
  - {{type: tls, bind: {_in_yaml(address)}, port: 8802, {ours}}}

Then try it (port 802 is the standard's, and needs a privilege; 8802 does not):

  force-gateway read force_measured --gateway {there}:8802 --tls {ca} --cert {client}.crt --key {client}.key
  openssl s_client -connect {there}:8802 -CAfile {ca} -cert {client}.crt -key {client}.key

A robot or PLC gets ca.crt, its own .crt and its own .key, nothing else; ca.key stays here, readable by you alone.
To shut a client out, put its serial number (openssl x509 -noout -serial -in FILE) under `revoked:` of the face,
and start the gateway anew: until then it stays connected, and may connect again. So it is with renewed files."""
    )
