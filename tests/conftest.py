"""What every test shares: real recordings, seeds, and the check that no thread is left behind."""

from __future__ import annotations

import os
import sys
import tempfile
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings

from agent.cli.terminal.interrupts import ignore_by_handler
from tests.starvation import pytest_runtest_protocol

__all__ = ["pytest_runtest_protocol"]

pytest_plugins = ["pytester"]  # tests/unit/test_starvation.py runs a suite of its own

REPOSITORY = Path(__file__).resolve().parents[1]

# Where Python is told to leave no bytecode, every process that a test starts would compile all that
# it imports anew, as much work as its own. It is kept where no source lies, and once for all.
if sys.dont_write_bytecode:
    sys.dont_write_bytecode = False
    sys.pycache_prefix = str(REPOSITORY / ".pytest_cache" / "bytecode")
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    os.environ["PYTHONPYCACHEPREFIX"] = sys.pycache_prefix

# A test keeps to one core, and so do its commands: two processes of tests fill two cores already,
# and threads that wait for each other spin. NumPy reads this when it is imported, later than here.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# A suite in the background of a script ignores Ctrl-C; what its tests start must not.
ignore_by_handler()

# How long an example takes on a busy machine says nothing of the law that it is of.
settings.register_profile("unhurried", settings(), deadline=None)
settings.load_profile("unhurried")


@pytest.fixture(scope="session", autouse=True)
def locks_of_this_run() -> Iterator[None]:
    """Let two test runs on one machine have simulated joints of the same name at a time."""
    with tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        patch.setenv("STRIBECK_LOCK_FOLDER", folder)
        patch.setenv("STRIBECK_CACHE", str(Path(folder) / "cache"))  # and the user's cache alone
        yield


@pytest.fixture(autouse=True)
def no_thread_left_behind() -> Iterator[None]:
    """Fail the test that leaves a thread of its own running."""
    before = set(threading.enumerate())
    yield
    leaked = [t for t in threading.enumerate() if t not in before and not _lasting(t)]
    for thread in leaked:
        thread.join(timeout=10.0)
    leaked = [t for t in leaked if t.is_alive()]
    assert not leaked, f"threads left behind: {[t.name for t in leaked]}"


def _lasting(thread: threading.Thread) -> bool:
    """Tell whether a thread is one that fsspec starts once and keeps for the whole process."""
    return thread.name == "fsspecIO" or thread.name.startswith("asyncio_")


@pytest.fixture(scope="session")
def real_recordings() -> Path:
    """Return the folder of real recordings, or skip, saying so."""
    folder = Path(os.environ.get("STRIBECK_DATA", REPOSITORY.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"real recordings are not here ({folder}); set STRIBECK_DATA")
    return folder


def pytest_xdist_auto_num_workers(config: pytest.Config) -> int:
    """Run the whole suite in two processes; what is asked for by name runs in this one."""
    return 0 if config.args_source is pytest.Config.ArgsSource.ARGS else 2
