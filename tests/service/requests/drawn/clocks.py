"""The one clock of a scene, wherever what it plays would ask the machine's own: a scene is the same each time it is played."""

from collections.abc import Callable
from functools import partial
from types import SimpleNamespace

import pytest

from gateway.fieldbus import socket_transport
from gateway.service import live_answers
from gateway.service.live_answers import LiveAnswers
from gateway.web import events, security
from gateway.web import server as page_server
from gateway.web.tabs import calibrate
from gateway.web.tabs.run_follower import RunFollower

BEGAN_UNIX_S = 1.8e9
"""What the wall clock says when the scene's says 0."""


def patch_clocks(patch: pytest.MonkeyPatch, now: Callable[[], float], live: LiveAnswers) -> None:
    """Let modules tell the time by this clock. How long a text is depends on the digits in it, and how many sockets are served
    in a turn on how fast the machine is. Sessions have one name each time. live: of the gateway, which was made before."""
    wall = SimpleNamespace(time=lambda: BEGAN_UNIX_S + round(now(), 3), monotonic=now)
    patch.setattr(socket_transport, "monotonic", now)
    for module in (live_answers, events, security):
        patch.setattr(module, "time", wall)
    live.alarm_times = live_answers.AlarmTimes(wall.time, now)
    patch.setattr(security, "secrets", SimpleNamespace(token_bytes=bytes, token_urlsafe=lambda size: size * "s"))
    patch.setattr(page_server, "Standstill", lambda: SimpleNamespace(is_aftermath=lambda: False))
    patch.setattr(calibrate, "RunFollower", partial(RunFollower, clock=now))
