"""The systemd unit of a rig (systemd.service(5), systemd.exec(5)), as text.

Decisions
- `Type=notify` and a watchdog that the control loop feeds through the guardian: a loop that stands restarts the service.
- No restart behind an exit that says that another start would end the same way: command line, data, permission,
  configuration. Any other end starts again every ten seconds, without end: a device whose cabinet is switched on an hour after
  this machine, or whose adapter comes late, must not leave the gateway off until somebody logs in, nor must a signal that was
  meant for another program. Only `systemctl stop` ends it.
- A stop is told to every process. With `KillMode=mixed` whoever is left when the guardian is gone is killed at once, and
  control must write the safe voltage then; each process minds what else it is told here.
- An address of its own is there only once the network is up: a start before it would be in vain.
- A user of its own that owns nothing but the state directory, and the serial ports by their group. Nothing else of the machine
  can be written, most of it not even seen; only the devices named here are there at all.
- `systemd-analyze security --offline=true` judges it; a test holds it to at most 1.5.
- MemoryDenyWriteExecute stays: the processes of the service compile nothing. The residual watch does, and so does a diagnosis
  that the page begins, where the extra `analysis` is installed; with `compiles` the unit leaves that one bolt open.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from gateway.processes import exit_codes
from gateway.processes.scheduling.priority import LOOP_NICE

NAME: Final = "force-gateway"
USER: Final = "force-gateway"
WATCHDOG_S: Final = 10
STOP_S: Final = 15  # a ramp of at most 5 s, the safe voltage, and the children's ends
_NO_RESTART: Final = (exit_codes.USAGE, exit_codes.DATA, exit_codes.PERMISSION, exit_codes.CONFIGURATION)
_LOWEST_FREE_PORT: Final = 1024
_USB: Final = ("char-ttyUSB", "char-ttyACM")
_PLAIN: Final = re.compile(r"[\w./+%-]+")
_TTY: Final = re.compile(r"/dev/(tty(?:[A-Z]+|mxc))\d+")

_HARDENING: Final = """\
# What it may not do
NoNewPrivileges=yes
ProtectSystem=strict
ProtectHome=yes
PrivateTmp=yes
PrivateMounts=yes
ProtectClock=yes
ProtectControlGroups=yes
ProtectHostname=yes
ProtectKernelLogs=yes
ProtectKernelModules=yes
ProtectKernelTunables=yes
ProtectProc=invisible
ProcSubset=pid
RestrictNamespaces=yes
RestrictRealtime=yes
RestrictSUIDSGID=yes
RemoveIPC=yes
LockPersonality=yes
SystemCallArchitectures=native
SystemCallFilter=@system-service
SystemCallFilter=~@privileged @resources @mount @debug
SystemCallFilter=setpriority ioprio_set sched_setscheduler sched_setaffinity
SystemCallErrorNumber=EPERM
RestrictAddressFamilies=AF_UNIX AF_INET AF_INET6
UMask=0077
KeyringMode=private
DevicePolicy=closed
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class UnitOptions:
    """What the unit of one rig depends on."""

    command: Path
    rig: str  # a shipped name or an absolute path
    stem: str  # what its state directory and unit are called
    ports: Sequence[int] = ()  # of all its listeners: one below 1024 needs a privilege
    devices: Sequence[str] = ()  # serial ports, as /dev/serial/by-id/...
    networks: Sequence[str] = ()  # who may reach it (CIDR); empty for everybody
    compiles: bool = False  # the residual watch runs, or there is a page
    waits_for_network: bool = False  # it listens on an address of its own

    @property
    def name(self) -> str:
        """Name of the unit: one a rig."""
        return unit_name(self.stem)


def unit_name(stem: str) -> str:
    """Return the unit of a rig."""
    return f"{NAME}-{stem}.service"


def unit_text(options: UnitOptions) -> str:
    """Return the unit file."""
    stem = options.stem
    lines = [
        "[Unit]",
        f"Description=force-gateway, rig {stem}",
        *(["Wants=network-online.target"] if options.waits_for_network else []),
        f"After={'network-online' if options.waits_for_network else 'network'}.target",
        "StartLimitIntervalSec=0",
        "",
        "[Service]",
        "Type=notify",
        "NotifyAccess=main",
        f"ExecStart={_word(str(options.command))} run {_word(options.rig).replace('$', '$$')} --state %S/{NAME}/{stem}",
        f"WatchdogSec={WATCHDOG_S}",
        "TimeoutStartSec=90",
        f"TimeoutStopSec={STOP_S}",
        "KillMode=control-group",
        "Restart=always",
        "RestartSec=10",
        f"RestartPreventExitStatus={' '.join(map(str, _NO_RESTART))}",
        f"User={USER}",
        f"StateDirectory={NAME}",
        "StateDirectoryMode=0700",
        f"CacheDirectory={NAME}",
        "WorkingDirectory=%S/" + NAME,
        f"Nice={LOOP_NICE}",  # as the gateway asks for itself, where it may; its other processes step back
        f"LimitNICE={LOOP_NICE}",  # for control, which is forked from one that has stepped back
        "OOMScoreAdjust=-500",  # another program goes first when memory runs out; what control can do without, before any
        "OOMPolicy=continue",  # of a child that control can do without: the guardian starts it again
        "",
        _HARDENING.rstrip(),
        *_of_the_rig(options),
        "",
        "[Install]",
        "WantedBy=multi-user.target",
    ]
    return "\n".join(lines) + "\n"


def _word(text: str) -> str:
    """Return one word of a command line as systemd reads it: quoted where it must be, and no % of it a specifier."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"').replace("%", "%%")
    return escaped if _PLAIN.fullmatch(text) else f'"{escaped}"'


def _of_the_rig(options: UnitOptions) -> list[str]:
    """What this rig needs of the machine, and nothing besides."""
    needs_port = any(0 < port < _LOWEST_FREE_PORT for port in options.ports)
    privilege = "CAP_NET_BIND_SERVICE" if needs_port else ""
    lines = [f"CapabilityBoundingSet={privilege}", f"AmbientCapabilities={privilege}"]
    if options.devices:
        lines += [
            "SupplementaryGroups=dialout",
            *(f"DeviceAllow={kind} rw" for kind in device_classes(options.devices)),
        ]
    else:
        lines += ["PrivateDevices=yes"]
    if not needs_port:
        lines += ["PrivateUsers=yes"]  # in a user namespace of its own no capability reaches the machine's ports
    if not options.compiles:
        lines += ["MemoryDenyWriteExecute=yes"]
    if options.networks:
        lines += ["IPAddressDeny=any", f"IPAddressAllow={' '.join(options.networks)}"]
    return lines


def device_classes(devices: Sequence[str]) -> list[str]:
    """Return the classes of /proc/devices that these ports belong to: a port by its path would be another one after a replug.
    A path that does not say its class may be any USB adapter."""
    found: dict[str, None] = {}
    for device in devices:
        match = _TTY.fullmatch(device)
        found |= dict.fromkeys([f"char-{match[1]}"] if match else _USB)
    return list(found)


def sysusers_text() -> str:
    """Return the line of sysusers.d(5) that makes the service's user."""
    return f'u {USER} - "force-gateway" -\n'


def udev_text() -> str:
    """Return the udev rule: serial adapters belong to the group dialout, and a modem manager leaves them alone.

    One that asks an unknown device for its modem commands has sent `AT` to a pressure regulator before.
    """
    return (
        "# Serial adapters of force-gateway: no program probes them, and the group dialout may use them.\n"
        'SUBSYSTEM=="tty", SUBSYSTEMS=="usb", ENV{ID_MM_DEVICE_IGNORE}="1", ENV{ID_MM_PORT_IGNORE}="1", '
        'GROUP="dialout", MODE="0660"\n'
        "# An FTDI chip keeps what it has read for 16 ms unless it is told otherwise.\n"
        'ACTION=="add", SUBSYSTEM=="usb-serial", DRIVER=="ftdi_sio", ATTR{latency_timer}="1"\n'
    )
