"""What User-Mode Linux needs where a processor has more registers than it knows; see xstate.c."""

from __future__ import annotations

import shutil
from pathlib import Path

from tests.bus.process import run_bounded

SOURCE = Path(__file__).with_suffix(".c")
PROCESSOR = Path("/proc/cpuinfo")
COMPILED_S = 30.0


def has_more_registers() -> bool:
    """Return whether the processor has tiles (AMX)."""
    return " amx_tile" in PROCESSOR.read_text()


def compiled(folder: Path) -> Path | str:
    """Return the library to load into the kernel, compiled into a folder, or why there is none."""
    compiler = shutil.which("cc")
    if compiler is None:
        return (
            "User-Mode Linux needs a C compiler on a processor with AMX (Debian packages gcc and "
            "libc6-dev)"
        )
    out = folder / "xstate.so"
    # No canary: a guest's threads have another one than the library was loaded with.
    how = ["-O1", "-fno-stack-protector", "-shared", "-fPIC", "-o", str(out), str(SOURCE)]
    done = run_bounded([compiler, *how], COMPILED_S)
    return out if done.returncode == 0 else f"{SOURCE.name} does not compile: {done.stderr.strip()}"
