"""Our own command line in a process of its own: what a tab wants that a verb can do already, in the words of that verb.

The page's process stays small and quick that way: what compares, fits and draws is imported by the child, which goes behind
everybody else and is gone afterwards.
"""

import asyncio
import json
import os
import subprocess
from typing import Any, Final

from gateway.module_command import module_command
from gateway.web.context import WebContext
from gateway.web.tabs.answers import CONFLICT, UNAVAILABLE, TabRefusedError

_PATIENCE_S: Final = 60.0


async def run_verb(*words: str) -> str:
    """Return what a verb prints. TabRefusedError with its sentence where it refuses, E178 where it does not come to an end."""
    return await asyncio.to_thread(_run, words)


async def ask_verb(context: WebContext, *words: str) -> dict[str, Any]:
    """Return the JSON of a verb that takes --state, --rig and --json."""
    printed = await run_verb(*words, "--json", *state_words(context))
    answer: dict[str, Any] = json.loads(printed)
    return answer


def state_words(context: WebContext) -> tuple[str, ...]:
    """Return the options that name this gateway."""
    return "--state", str(context.state), "--rig", context.rig


def last_sentence(said: str) -> str:
    """Return the last line of what a command has said on stderr, without click's prefix."""
    lines = [line.strip() for line in said.splitlines() if line.strip()]
    return lines[-1].removeprefix("Error: ") if lines else ""


def child_environment() -> dict[str, str]:
    """Return the environment of a child: one thread for its mathematics, and plain text."""
    return os.environ | {"OPENBLAS_NUM_THREADS": "1", "NO_COLOR": "1"}


def _run(words: tuple[str, ...]) -> str:
    command = [*module_command("gateway"), *words]
    try:
        done = subprocess.run(
            command,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=_PATIENCE_S,
            env=child_environment(),
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise TabRefusedError(
            f"E178 force-gateway {' '.join(words[:2])} has not answered for {_PATIENCE_S:g} s", UNAVAILABLE
        ) from None
    if done.returncode:
        why = last_sentence(done.stderr) or f"it ended with {done.returncode}"
        raise TabRefusedError(why, CONFLICT)
    return done.stdout
