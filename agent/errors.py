"""What can go wrong above the drivers: one tree, one sentence each, and what to do now.

::

    AgentError
    |-- InputError        exit 3   a file or a cell description cannot be used
    |   `-- UsageError    exit 2   an option's value means nothing, whatever the files hold
    |-- StorageError      exit 3   a result cannot be written (disk full, no permission)
    |-- RefusedError      exit 5   nothing has moved, and nothing will: the reasons are listed
    `-- StoppedError      exit 5   the joint was stopped by the agent; the recording so far is kept

Device and bus errors are `drivers.errors.DriverError` (exit 4). `agent.cli.terminal.exits` holds
the one table from errors to exit codes.
"""

from __future__ import annotations


class AgentError(Exception):
    """Root of the agent's own errors: what happened, where, and what to do now.

    Parameters
    ----------
    what : str
        One sentence: what was expected, what came.
    do : str, optional
        One sentence: what to do now.
    """

    def __init__(self, what: str, do: str = "") -> None:
        super().__init__(f"{what} {do}".strip())
        self.what = what
        self.do = do


class InputError(AgentError):
    """A file or a cell description cannot be used, or an argument does not fit them."""


class UsageError(InputError):
    """An option's value means nothing, whatever the files hold."""


class StorageError(AgentError):
    """A result cannot be written: disk full, no permission, folder missing."""


class RefusedError(AgentError):
    """Nothing has moved and nothing will.

    Parameters
    ----------
    what : str
        One sentence.
    reasons : tuple of str
        Every reason, not only the first.
    """

    def __init__(self, what: str, reasons: tuple[str, ...] = (), do: str = "") -> None:
        super().__init__(what, do)
        self.reasons = reasons


class StoppedError(AgentError):
    """The joint was stopped by the agent; what had been recorded is kept."""
