"""What can be wrong with a recording, in a sentence for the user."""


class RecordingError(Exception):
    """A file that is no recording, or none that can be read. Exit code 65 at the command line."""
