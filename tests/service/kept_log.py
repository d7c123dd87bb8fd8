"""A log that keeps its sentences, for tests that look at them."""


class Log(list[str]):
    """Stands for `EventLog`."""

    def __call__(self, cause: str, sentence: str) -> None:
        self.append(sentence)
