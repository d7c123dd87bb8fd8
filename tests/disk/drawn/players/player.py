"""What all players of a scene have in common: each has one store, and knows what was said of it."""

from abc import ABC, abstractmethod
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

if TYPE_CHECKING:
    from tests.disk.drawn.scene import Scene


class Player(ABC):
    """folders: its places in the state directory. is_touched: a person has changed files beneath them, and from then on less
    is asked."""

    folders: ClassVar[tuple[str, ...]] = ()

    def __init__(self, scene: "Scene") -> None:
        self.scene, self.rng, self.state = scene, scene.rng, scene.state
        self.is_touched = False

    @property
    def disk(self):  # type: ignore[no-untyped-def]
        """The disk of the scene."""
        return self.scene.disk

    def begin(self) -> None:  # noqa: B027 - not all have something in the gateway's memory
        """A gateway starts."""

    def tick(self) -> None:  # noqa: B027
        """The gateway's loop turns."""

    @abstractmethod
    def act(self) -> None:
        """Do something in the gateway."""

    def verb(self) -> None:
        """Do something from a terminal."""
        self.act()

    def die(self) -> None:  # noqa: B027
        """The gateway was killed."""

    def close(self) -> None:  # noqa: B027
        """The scene has ended."""

    def lose_power(self) -> None:  # noqa: B027
        """What was not synced may be gone."""

    @abstractmethod
    def judge(self) -> None:
        """Look, on a disk that is well."""

    def judge_healed(self) -> None:
        """Look, behind the healing time."""
        self.judge()

    def complain(self, words: str) -> None:
        """A law did not hold."""
        self.scene.complain(f"{type(self).__name__}: {words}")

    def complain_if(self, words: str) -> None:
        """The same, where there is something to say."""
        if words:
            self.complain(words)

    def judge_words(self, sentence: str) -> None:
        """A refusal is a sentence that names what and where."""
        self.scene.judge_words(sentence)

    def path(self, *parts: str) -> Path:
        """A place in the state directory."""
        return self.state.joinpath(*parts)
