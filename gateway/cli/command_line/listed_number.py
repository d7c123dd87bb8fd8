"""The number of a calibration, plant or recording as an argument: a file there is a common slip, and gets its own sentence."""

from typing import Any

import click

from gateway.plain_file import exists


class ListedNumber(click.IntRange):
    """A number that `VERB list` shows. verb: `calibration`, `plant` or `recordings`; least: 0 where that means none; word: what
    may stand for a number, and is returned as it is."""

    def __init__(self, verb: str, least: int = 1, word: str = "") -> None:
        super().__init__(min=least)
        self._verb, self._word = verb, word

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the number, or the word; a click error that says where numbers are, for anything else."""
        text = str(value)
        if self._word and text == self._word:
            return text
        if text.lstrip("-").isdecimal():
            return super().convert(value, param, ctx)
        what = "is a file" if exists(text) else "is no number"
        return self.fail(f"{text} {what}: a number of `force-gateway {self._verb} list` is wanted", param, ctx)
