"""What can be wrong with a recording, in a sentence for the user."""

from gateway.plain_file import tell_place_and_refusal


class RecordingError(Exception):
    """A file that is no recording, or none that can be read. Exit code 65 at the command line."""


def tell_unreadable(error: RecordingError | OSError) -> str:
    """Return why a recording cannot be read."""
    return tell_place_and_refusal(error) if isinstance(error, OSError) else str(error)
