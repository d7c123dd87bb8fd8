"""The number of a calibration, plant or recording as an argument: a file there is a common slip, and gets its own sentence."""

from pathlib import Path
from typing import Any

import click


class ListedNumber(click.IntRange):
    """A number that `VERB list` shows. verb: `calibration`, `plant` or `recordings`; least: 0 where that means none."""

    def __init__(self, verb: str, least: int = 1) -> None:
        super().__init__(min=least)
        self._verb = verb

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the number; a click error that says where numbers are, for anything else."""
        text = str(value)
        if text.lstrip("-").isdecimal():
            return super().convert(value, param, ctx)
        what = "is a file" if Path(text).exists() else "is no number"
        return self.fail(f"{text} {what}: a number of `force-gateway {self._verb} list` is wanted", param, ctx)
