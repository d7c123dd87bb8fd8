"""Which serial ports are there: by-id names that survive a replug first, with what is needed to choose one."""

import os
from dataclasses import dataclass
from pathlib import Path

from gateway.plain_file import exists
from gateway.ports.holders import holders_of, list_folder
from gateway.ports.latency import latency_ms


@dataclass(frozen=True, slots=True)
class PortInfo:
    """by_id: the name to write into a rig file, None where udev gives none; holder: who has it open, empty if nobody."""

    by_id: str | None
    device: str
    description: str
    driver: str
    latency_ms: int | None
    holder: str

    @property
    def path(self) -> str:
        """Path that names the port best: by its serial number where it has one."""
        return self.by_id or self.device


def list_ports(devices: Path = Path("/dev"), system: Path = Path("/sys")) -> list[PortInfo]:
    """Return every serial port of this machine that has hardware behind it."""
    by_id = _by_id(devices)
    names = sorted({entry.name for entry in list_folder(system / "class" / "tty") if _is_real(entry)} | set(by_id))
    return [_info(name, by_id.get(name), devices, system) for name in names]


def present_paths(devices: Path = Path("/dev"), system: Path = Path("/sys")) -> list[str]:
    """Return the paths that could be opened, as a rig file should name them."""
    by_id = _by_id(devices)
    names = {entry.name for entry in list_folder(system / "class" / "tty") if _is_real(entry)} - set(by_id)
    return sorted(by_id.values()) + sorted(str(devices / name) for name in names)


def _by_id(devices: Path) -> dict[str, str]:
    """Device name -> its by-id path."""
    links = list_folder(devices / "serial" / "by-id")
    return {Path(os.path.realpath(link)).name: str(link) for link in sorted(links) if exists(link)}


def _is_real(entry: Path) -> bool:
    """Consoles have no device; a PC's four ttyS have one each, of type 0 where there is no chip."""
    return exists(entry / "device" / "driver") and _text(entry / "type") != "0"


def _info(name: str, by_id: str | None, devices: Path, system: Path) -> PortInfo:
    device = str(devices / name)
    entry = system / "class" / "tty" / name / "device"
    return PortInfo(
        by_id=by_id,
        device=device,
        description=_description(entry),
        driver=Path(os.path.realpath(entry / "driver")).name if exists(entry / "driver") else "",
        latency_ms=latency_ms(device, system),
        holder=", ".join(str(holder) for holder in holders_of(device)),
    )


def _description(entry: Path) -> str:
    """Return what the USB adapter says it is: maker and product, from the nearest folder above that has them."""
    here = Path(os.path.realpath(entry))
    for folder in (here, *list(here.parents)[:3]):
        words = [text for text in (_text(folder / "manufacturer"), _text(folder / "product")) if text]
        if words:
            return " ".join(words)
    return ""


def _text(file: Path) -> str:
    try:
        return file.read_text().strip()
    except OSError:
        return ""
