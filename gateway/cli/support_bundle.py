"""What somebody who helps from afar needs to know of a gateway, in one file, and nothing that they must not.

In it: versions, the machine, the rig's files as `check` reads them, the newest events, the loop's figures and the live state
where a gateway runs, and which calibrations, plants and recordings there are (not their content).
Not in it: keys, certificates, passwords, tokens, addresses of masters (they become `master-1` ...), recordings. A secret is
found by the name of its key in a rig file, and by its looks in any text; who packs it is shown the list before it is sent.
"""

import contextlib
import gzip
import io
import json
import platform
import re
import sys
import tarfile
from collections import deque
from collections.abc import Callable, Iterable
from importlib.metadata import version
from ipaddress import IPv6Address
from pathlib import Path
from typing import Any, Final

from gateway import VERSION
from gateway.cli.errors import CliError
from gateway.defaults import HOST
from gateway.plain_file import is_file, tell_place_and_refusal
from gateway.processes.durable_file import replacing_file

EVENT_LINES: Final = 2000
_NOT_IN_IT: Final = "not in it: "
_LIBRARIES: Final = ("numpy", "scipy", "pymodbus", "pyserial", "pydantic", "uvloop", "numba", "pyarrow", "starlette")
_SECRET_KEY: Final = re.compile(
    r"^(\s*(?:-\s*)?\"?(?:[\w.-]*(?:password|token|secret|passphrase|credential)[\w.-]*)\"?\s*[:=]\s*)\S.*$",
    re.I | re.M,
)
_SECRET_WORD: Final = re.compile(
    r"((?:\b[\w.-]*(?:password|passwort|kennwort|passwd|passcode|pwd|token|secret|passphrase|credential|api[_-]?key)"
    r"|(?<![\w-])(?:\w+[_-])?pass)\b[\"']?\s*[:=]\s*[\"']?|[?&](?:key|sig|auth|code)=|\bpin\b[^\w\n]{0,3}(?=\d{4}))"
    r"(?!\(left out)[^\s\"',;}\]&]+",
    re.I,
)
_SECRET_COMMENT: Final = re.compile(
    r"((?:^|(?<=\s))#[^\n]*?(?:passwor[dt]|kennwort|passwd|passcode|pwd|token|secret|passphrase|credential|api[_-]?key"
    r"|\bpsk\b|\bpw\b|\bpass(?=\s*[:=])|[?&]key=|\bpin\b(?=[^\d\n]{0,8}\d{4})))[^\n]*",
    re.I | re.M,
)
"""A comment may tell one in a sentence: `the old token was ...`. What follows the word goes, whatever it is."""
_IN_SECTION: Final = re.compile(r'(\b(?:web|mqtt)[\w.]*: \\?")[^"\\\n]+(?=\\?")')
"""What a fault quotes of the sections that hold secrets: `web: "TOKEN" is not a group of keys`."""
_KNOWN_KEY: Final = (
    r"(?:listen|token|host|port|tls|ca|certificate|key|username|password_file|base_topic|sparkplug|group|node|commands)"
)
_KEY_IN_SECTION: Final = re.compile(rf"(:\d+:\d+ (?:web|mqtt)\.)(?!{_KNOWN_KEY}(?:\.{_KNOWN_KEY})*: )[^\n]+?(?=: )")
"""The same where it stands as a key: `web.TOKEN: is not a known key`."""
_TAG_IN_SECTION: Final = re.compile(r"(:\d+:\d+ (?:web|mqtt)[\w.]*: tag `)[^`\n]+(?=`)")
"""The same where it begins with a `!`, which makes a tag of it."""
_LOGIN: Final = re.compile(r"(?<=://)[^/\s@\"]+(?=@)|(?<=\bbearer )[\w.~+/=-]+|(?<=\bbasic )[\w+/=]{8,}", re.I)
_PEM: Final = re.compile(r"-----BEGIN [^-]+-----.*?(?:-----END [^-]+-----|\Z)", re.S)
_IPV4: Final = re.compile(r"(?<![\d.])(?:\d{1,3}\.){3}\d{1,3}(?![\d.])")
_MAYBE_IPV6: Final = re.compile(r"(?<![\w:.])[0-9a-f]{0,4}(?::[0-9a-f]{0,4}){2,7}(?![\w:])", re.I)
_OURS: Final = frozenset({HOST, "0.0.0.0", "::", "::1"})


class Redaction:
    """Takes secrets out of texts; the same address becomes the same name in all of them."""

    def __init__(self) -> None:
        self._names: dict[str, str] = {}

    def __call__(self, text: str) -> str:
        text = _PEM.sub("(a key or certificate, left out)", text)
        for quoted in (_KEY_IN_SECTION, _TAG_IN_SECTION, _SECRET_KEY, _IN_SECTION):
            text = quoted.sub(r"\1(left out)", text)
        text = _SECRET_WORD.sub(r"\1(left out)", _LOGIN.sub("(left out)", text))
        text = _IPV4.sub(lambda found: self._name_of(found[0]), text)
        return _MAYBE_IPV6.sub(lambda found: self._name_of(found[0]) if _is_ipv6(found[0]) else found[0], text)

    def _name_of(self, address: str) -> str:
        if address in _OURS:
            return address
        return self._names.setdefault(address, f"master-{len(self._names) + 1}")


def _is_ipv6(text: str) -> bool:
    try:
        return IPv6Address(text) is not None
    except ValueError:
        return False


def collect_parts(state: Path, rig_texts: Callable[[], Iterable[tuple[str, str]]]) -> dict[str, str]:
    """Return name -> text of what goes in, redacted. Whatever cannot be read is in it as a sentence: the rest helps too.

    rig_texts: name and content of each file that the rig was read from.
    """
    redact = Redaction()
    parts: dict[str, Callable[[], str]] = {
        "versions.json": lambda: json.dumps(_versions(), indent=2),
        "rig.txt": lambda: "\n".join(f"# {name}\n{_without_told_secrets(text)}" for name, text in rig_texts()),
        "events.jsonl": lambda: _newest_events(state),
        "live.json": lambda: json.dumps(_ask(state, "state"), indent=2),
        "health.json": lambda: json.dumps(_ask(state, "health"), indent=2),
        "state.txt": lambda: _listing(state),
    }
    return {name: redact(_as_text(_or_sentence(make))) for name, make in parts.items()}


def parts_missing(parts: dict[str, str]) -> list[str]:
    """Return the names of the parts that say only why they are not in it."""
    return [name for name, text in parts.items() if text.startswith(_NOT_IN_IT)]


def pack_bundle(parts: dict[str, str], target: Path) -> None:
    """Write the parts as a tar.gz; OSError when the disk does not take it. Nothing half stays behind.
    Without a time of its own, for which gzip has room until 2106, and a clock may be ahead of that."""
    with (
        replacing_file(target) as stream,
        gzip.GzipFile("", "wb", fileobj=stream, mtime=0) as packed,
        tarfile.open(fileobj=packed, mode="w") as archive,
    ):
        for name, text in parts.items():
            data = text.encode()
            member = tarfile.TarInfo(f"force-gateway-report/{name}")
            member.size = len(data)
            archive.addfile(member, io.BytesIO(data))


def _without_told_secrets(text: str) -> str:
    return _SECRET_COMMENT.sub(r"\1 (left out)", text)


def _as_text(said: str) -> str:
    """The names of files may be bytes that are no text."""
    return said.encode(errors="backslashreplace").decode()


def _or_sentence(make: Callable[[], str]) -> str:
    from gateway.profiles import ProfileError  # here, for the verb's help needs no profiles

    try:
        return make()
    except OSError as error:
        return f"{_NOT_IN_IT}{tell_place_and_refusal(error)}"
    except (CliError, ProfileError, ValueError) as error:
        return f"{_NOT_IN_IT}{getattr(error, 'message', None) or error}"


def _versions() -> dict[str, Any]:
    libraries = {}
    for name in _LIBRARIES:
        try:
            libraries[name] = version(name)
        except ModuleNotFoundError:
            libraries[name] = "not installed"
    return {"force-gateway": VERSION, "python": sys.version, "machine": platform.platform(), "libraries": libraries}


def _newest_events(state: Path) -> str:
    from gateway.processes.event_file import EventReader

    reader = EventReader(state)
    try:
        newest = deque(reader.read_stored(), EVENT_LINES)
    finally:
        reader.close()
    return "\n".join(json.dumps(event._asdict()) for event in newest)


def _ask(state: Path, what: str) -> dict[str, Any]:
    from gateway.cli.control_socket import ask

    return ask(state, {"do": what})


def _listing(state: Path) -> str:
    lines = []
    next(state.iterdir(), None)  # OSError where this user may not look: rglob finds nothing there, and says nothing
    for path in sorted(path for path in state.rglob("*") if is_file(path) and not path.is_symlink()):
        with contextlib.suppress(FileNotFoundError):  # a running gateway removes some
            lines.append(f"{path.stat().st_size:>12} {path.relative_to(state)}")
    return "\n".join(lines)
