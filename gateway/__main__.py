"""`python -m gateway` is `force-gateway`, and both begin here: Ctrl-C while the first modules are read shows no traceback."""

import sys


def main() -> None:
    """Run `force-gateway`."""
    try:
        from gateway.cli.main import main as run_verb
    except KeyboardInterrupt:
        sys.exit("Aborted!")  # as any verb says it later
    run_verb()


if __name__ == "__main__":
    main()
