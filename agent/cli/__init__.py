"""Typer commands: parse, call, print. No logic of their own.

A room holds the commands of one story. Its `commands.py` names their options and imports what
does the work when it is called, so that `--help` is instant; ``stribeck WORD`` is `WORD.py`, and
what does not fit into one file is beside it. `terminal` is what all of them share.
"""

from __future__ import annotations

import sys

INTERRUPTED = 130
"""By Ctrl-C, as shells have it: 128 and the signal's number."""
NOBODY_READS = 141
"""As of SIGPIPE: 1 would be an alarm."""


def main() -> None:
    """Run the command line: one sentence for an error, the exit code of the contract.

    A traceback is shown with `--debug` only.
    """
    try:
        _run()
    except KeyboardInterrupt:  # before a command runs, while it is loaded; a command has its own
        sys.exit(INTERRUPTED)
    except SystemExit as ended:
        if _nobody_reads(ended):
            sys.exit(NOBODY_READS)
        raise
    except Exception as error:
        if "--debug" in sys.argv:
            raise
        sys.exit(_said(error))


def _nobody_reads(ended: SystemExit) -> bool:
    """Tell whether a command ended as what it wrote to is closed, which Click has exit with 1."""
    import errno

    why = ended.__context__
    return ended.code == 1 and isinstance(why, OSError) and why.errno == errno.EPIPE


def _run() -> None:
    """Load the commands and run the one that is asked for."""
    import logging

    from agent.cli.terminal.alphabet import say_in_any_alphabet
    from agent.cli.terminal.interrupts import ignore_by_handler
    from agent.cli.terminal.threads import keep_to_one_thread

    ignore_by_handler()
    keep_to_one_thread()
    _talk_somewhere()
    say_in_any_alphabet()
    from agent.cli.app import app
    from agent.cli.terminal.arguments import repeated

    if "--debug" in sys.argv:
        logging.basicConfig(level=logging.DEBUG)
    else:  # libraries talk to their developers; what matters to a user comes as a sentence
        logging.getLogger().addHandler(logging.NullHandler())
    app(args=repeated(sys.argv[1:]))


def _talk_somewhere() -> None:
    """Have talk go nowhere where stderr is closed, and data where stdout is: codes still tell."""
    import os
    from pathlib import Path

    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            nowhere = Path(os.devnull).open("w", encoding="utf-8")  # noqa: SIM115 - until the end
            setattr(sys, name, nowhere)


def _said(error: Exception) -> int:
    """Say what went wrong in a sentence and return the exit code."""
    from agent.cli.terminal.exits import OUR_FAULT, exit_code, sentence

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
    return code
