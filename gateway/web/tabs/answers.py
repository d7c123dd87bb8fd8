"""How a tab answers: JSON, or a sentence that says why not, with the status that fits; and how it reads a request's body.

What a person did wrong, or control refuses, is a TabRefusedError or a ValueError (409), and so is what an extra is missing for;
no gateway is an OSError (503). The body of an error is always {"error": sentence}.
"""

import errno
import os
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from functools import wraps
from typing import Any, Final, TypeVar

from starlette.requests import Request
from starlette.responses import HTMLResponse, Response

from gateway.extras import MissingExtraError
from gateway.processes.json_socket.messages import encode_answer, load_shallow
from gateway.profiles.strict_yaml.text import Document
from gateway.profiles.strict_yaml.typed import build

Shape = TypeVar("Shape")
Endpoint = Callable[[Request], Awaitable[Response]]

BAD_REQUEST: Final = 400
NOT_FOUND: Final = 404
CONFLICT: Final = 409
UNAVAILABLE: Final = 503
_MOST_DIGITS: Final = 6
REPORT_POLICY: Final = (
    "default-src 'none'; style-src 'unsafe-inline'; img-src data:; frame-ancestors 'self'; base-uri 'none'; sandbox"
)
"""Of a report: its own style and drawings, no script, nothing from anywhere."""


class TabRefusedError(Exception):
    """A request that is not answered. str: the sentence for people."""

    def __init__(self, sentence: str, status: int = CONFLICT) -> None:
        super().__init__(sentence)
        self.status = status


@dataclass(frozen=True, slots=True, kw_only=True)
class Nothing:
    """A body without a field."""

    __pydantic_config__ = {"extra": "forbid"}  # noqa: RUF012  read by pydantic


def answers(handler: Callable[[Request], Awaitable[Any]]) -> Endpoint:
    """Make an endpoint of a function: its value as JSON, or the Response that it returns; what it raises as a sentence."""

    @wraps(handler)
    async def endpoint(request: Request) -> Response:
        try:
            answer = await handler(request)
        except TabRefusedError as refusal:
            return _as_json({"error": str(refusal)}, refusal.status)
        except OSError as error:
            return _as_json({"error": _unreachable(error)}, UNAVAILABLE)
        except (ValueError, MissingExtraError) as error:
            return _as_json({"error": str(error)}, CONFLICT)
        return answer if isinstance(answer, Response) else _as_json(answer)

    return endpoint


def _as_json(answer: dict[str, Any], status: int = 200) -> Response:
    """In ASCII: a file's name need not be UTF-8."""
    return Response(encode_answer(answer), status, media_type="application/json")


async def read_body(request: Request, shape: type[Shape]) -> Shape:
    """Return the request's JSON as `shape`, read strictly; how long it may be, the guard has said. TabRefusedError names the
    first key that does not fit."""
    try:
        fields = load_shallow(await request.body() or b"{}")
    except ValueError:
        raise TabRefusedError("the request is no JSON", BAD_REQUEST) from None
    shaped, faults = build(shape, Document("request", fields, {}))
    if shaped is None or faults:
        raise TabRefusedError(f"{faults[0].path} {faults[0].message}".strip(), BAD_REQUEST)
    return shaped


def number_in_path(request: Request) -> int:
    """Return the number of the address. TabRefusedError for anything but digits: files are named by numbers only."""
    return number_of(request.path_params["number"])


def number_in_query(request: Request, name: str) -> int:
    """Return a number of the query (?a=3). TabRefusedError where it is missing or none."""
    return number_of(request.query_params.get(name, ""))


def number_of(text: str) -> int:
    """Return a plain decimal number. TabRefusedError for anything else."""
    if not (text.isascii() and text.isdecimal() and len(text) <= _MOST_DIGITS):
        raise TabRefusedError(f"{text[:40]!r} is no number of the list", NOT_FOUND)
    return int(text)


def report_page(text: str) -> Response:
    """Return a report, which is a whole page of its own, for a frame of the page."""
    return HTMLResponse(text, headers={"Content-Security-Policy": REPORT_POLICY, "X-Frame-Options": "SAMEORIGIN"})


def _unreachable(error: OSError) -> str:
    """Of the socket a missing file has no name and the system's words; other files have either."""
    is_socket = error.filename is None and error.strerror == os.strerror(errno.ENOENT)
    if isinstance(error, (ConnectionError, TimeoutError)) or (isinstance(error, FileNotFoundError) and is_socket):
        return "the gateway does not answer: it is being started, or has ended"
    place = f"{error.filename}: " if error.filename else ""
    return f"{place}{error.strerror or error}"
