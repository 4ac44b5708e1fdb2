"""Typer commands: parse, call, print. No logic of their own."""

from __future__ import annotations

import logging
import sys


def main() -> None:
    """Run the command line: one sentence for an error, the exit code of the contract.

    A traceback is shown with `--debug` only.
    """
    from agent.cli.interrupts import ignore_by_handler
    from agent.cli.threads import keep_to_one_thread

    ignore_by_handler()
    keep_to_one_thread()
    from agent.cli.app import app

    if "--debug" in sys.argv:
        logging.basicConfig(level=logging.DEBUG)
    else:  # libraries talk to their developers; what matters to a user comes as a sentence
        logging.getLogger().addHandler(logging.NullHandler())
    from agent.cli.arguments import repeated

    try:
        app(args=repeated(sys.argv[1:]))
    except Exception as error:
        if "--debug" in sys.argv:
            raise
        from agent.cli.exits import OUR_FAULT, exit_code, sentence

        code = exit_code(error)
        if code == OUR_FAULT:
            said = (
                f"This is a fault of stribeck's own ({type(error).__name__}: {error}). "
                "Run `stribeck --debug ...` and report what it shows."
            )
        else:
            said = sentence(error)
        print(said, file=sys.stderr)  # noqa: T201 - talk belongs on stderr
        for note in getattr(error, "__notes__", ()):
            print(note, file=sys.stderr)  # noqa: T201 - as above
        sys.exit(code)
