"""A real `vcan0` where the host's kernel has no AF_CAN: the command runs inside User-Mode Linux.

User-Mode Linux is a Linux kernel that runs as an ordinary program. The host's files are its root
file system (hostfs), so the command sees the same checkout, interpreter and paths; its processes,
network and kernel are its own. It keeps real time: its monotonic clock stays within 0.3 ms of the
host's over 20 s, because no time-travel mode is used.

Its placement makes it fit for 500 Hz (two processes, SYNC and answer, on two cores):

=====================================  =============  ============================  ==========
on the host                            system call    round trip median / p99       late of
                                                                                    2500 ticks
=====================================  =============  ============================  ==========
both cores, idle                       56 us          0.42 / 0.80 ms                2
one core, idle                         16 us          0.51 / 0.74 ms                0
one core, three busy processes         16 us          0.42 / 6.3 ms                 128
one core, FIFO, three busy processes   16 us          0.40 / 0.58 ms                0
=====================================  =============  ============================  ==========

Every system call in there is a ptrace stop that hands over between two host processes; pinned to
one core, the hand-over needs no other core to be woken. The kernel is built without SMP, so a
second core would not be used anyway. Two guests on that core would halve each other's speed, so
one waits until the other has ended.
"""

from __future__ import annotations

import fcntl
import os
import shlex
import shutil
import subprocess
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from drivers.clock import MonotonicClock
from tests.bus.process import run_bounded

KERNEL = "linux.uml"
MEMORY_MIB = 1024
BOOT_AND_POWER_OFF_S = 30.0  # seen: 2 s
FIFO_PRIORITY = "20"
SHARED_FOLDER = "/var/tmp"  # not under /dev or /run, which the guest mounts for itself
TURN_S = 600.0
SYSTEM_PATH = "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"
MODULES = (
    "net/can/can.ko",
    "net/can/can-raw.ko",
    "drivers/net/can/dev/can-dev.ko",
    "drivers/net/can/vcan.ko",
)
NEEDED_PROGRAMS = (("insmod", "kmod"), ("ip", "iproute2"), ("chrt", "util-linux"))
PASSED_ON = ("PATH", "HOME", "USER", "LANG", "TZ", "CI", "VIRTUAL_ENV", "TMPDIR")
PASSED_ON_PREFIXES = ("STRIBECK_", "PYTHON", "LC_")

INIT = """\
#!/bin/sh
# Process 1 of the guest: one real vcan0, one command, its exit code in a file, power off.
set -eux
PATH={system_path}
export PATH
mount -t proc proc /proc
trap 'sync; echo o >/proc/sysrq-trigger; sleep 60' EXIT
mount -t sysfs sysfs /sys
mkdir -p /dev/pts /dev/shm
mount -t devpts devpts /dev/pts
mount -t tmpfs tmpfs /dev/shm
mount -t tmpfs tmpfs /run
for module in {modules}; do insmod "$module"; done
ip link set lo up
ip link add vcan0 type vcan
ip link set vcan0 up
cd {cwd}
set +ex
{exports}
# batch scheduling: with one core, a frame that wakes its reader must not interrupt its sender
chrt --batch 0 timeout --kill-after=5 {timeout_s:.3f} {command} \\
    </dev/null >{folder}/stdout 2>{folder}/stderr
echo $? >{folder}/exit_code
"""


class BootError(Exception):
    """User-Mode Linux cannot be used here, or ended before the command did; says why."""


@dataclass(frozen=True)
class UserModeLinux:
    """A kernel that is ready to be booted, once for each command.

    Parameters
    ----------
    kernel : str
        Path of the kernel's program.
    modules : tuple of pathlib.Path
        What to load for AF_CAN and vcan, in this order.
    prefix : tuple of str
        What places the kernel on one core (and ahead of other work, where that is allowed).
    """

    kernel: str
    modules: tuple[Path, ...]
    prefix: tuple[str, ...]
    channel: str = "vcan0"

    def describe(self) -> str:
        """Return in a few words where a command will run."""
        return f"vcan0 in User-Mode Linux ({' '.join(self.prefix)})"

    def run(
        self,
        command: Sequence[str],
        timeout_s: float,
        cwd: Path | None = None,
        env: Mapping[str, str] | None = None,
    ) -> subprocess.CompletedProcess[str]:
        """Boot, run `command` with `vcan0` up, power off.

        Raises
        ------
        subprocess.TimeoutExpired
            The command ran longer than `timeout_s`; with what it had written by then.
        BootError
            The guest ended without the command's exit code; with the end of its console.
        """
        clock = MonotonicClock()
        with _turn(clock), _scratch_folder() as folder:
            init = folder / "init"
            init.write_text(
                self._init_script(folder, command, timeout_s, cwd or Path.cwd(), env or os.environ)
            )
            init.chmod(0o700)
            started_s = clock.now()
            console = self._boot(folder, init, timeout_s + BOOT_AND_POWER_OFF_S)
            elapsed_s = clock.now() - started_s
            stdout, stderr = _text(folder / "stdout"), _text(folder / "stderr")
            exit_code = _text(folder / "exit_code").strip()
        if not exit_code:
            end = "\n".join(console.splitlines()[-15:])
            raise BootError(f"User-Mode Linux ended without running the command:\n{end}")
        # coreutils' timeout: 124 when SIGTERM was enough; 137 when it took SIGKILL
        if exit_code == "124" or (exit_code == "137" and elapsed_s > timeout_s):
            raise subprocess.TimeoutExpired(list(command), timeout_s, stdout, stderr)
        return subprocess.CompletedProcess(list(command), int(exit_code), stdout, stderr)

    def _boot(self, folder: Path, init: Path, timeout_s: float) -> str:
        command = [
            *self.prefix,
            self.kernel,
            f"mem={MEMORY_MIB}M",
            "rootfstype=hostfs",
            "rootflags=/",
            "rw",
            f"init={init}",
            "con=null",
            "con0=null,fd:1",
            f"uml_dir={folder}",
        ]
        env = {"PATH": SYSTEM_PATH, "HOME": str(folder), "TMPDIR": str(_memory_folder(folder))}
        try:
            result = run_bounded(command, timeout_s, env=env)
        except subprocess.TimeoutExpired as error:
            end = str(error.output)[-1500:]
            raise BootError(f"User-Mode Linux did not end within {timeout_s:g} s:\n{end}") from None
        return result.stdout + result.stderr

    def _init_script(
        self,
        folder: Path,
        command: Sequence[str],
        timeout_s: float,
        cwd: Path,
        env: Mapping[str, str],
    ) -> str:
        passed_on = {
            name: value
            for name, value in env.items()
            if name in PASSED_ON or name.startswith(PASSED_ON_PREFIXES)
        }
        return INIT.format(
            system_path=SYSTEM_PATH,
            modules=shlex.join(str(m) for m in self.modules),
            cwd=shlex.quote(str(cwd)),
            exports="\n".join(f"export {n}={shlex.quote(v)}" for n, v in passed_on.items()),
            timeout_s=timeout_s,
            command=shlex.join(command),
            folder=shlex.quote(str(folder)),
        )


def find_user_mode_linux() -> UserModeLinux:
    """Return a kernel that has booted here and brought `vcan0` up.

    Raises
    ------
    BootError
        With what is missing, or how the trial boot ended.
    """
    kernel = shutil.which(KERNEL)
    if kernel is None:
        raise BootError(f"{KERNEL} is not installed (Debian package user-mode-linux)")
    for program, package in NEEDED_PROGRAMS:
        if shutil.which(program, path=SYSTEM_PATH) is None:
            raise BootError(f"{program} is not installed (Debian package {package})")
    release = run_bounded([kernel, "--version"], 10.0).stdout.strip()
    folder = Path("/usr/lib/uml/modules") / release / "kernel"
    modules = tuple(folder / name for name in MODULES)
    missing = [str(m) for m in modules if not m.is_file()]
    if missing:
        raise BootError(f"{KERNEL} {release} comes without {', '.join(missing)}")
    found = UserModeLinux(kernel, modules, _placement())
    trial = found.run(["ip", "-brief", "link", "show", "dev", "vcan0"], 10.0)
    if trial.returncode != 0:
        raise BootError(f"vcan0 is missing in User-Mode Linux: {trial.stderr.strip()}")
    return found


def _placement() -> tuple[str, ...]:
    """Return the command prefix that pins to one core, with FIFO scheduling where allowed.

    FIFO only where another core is left: a guest that spins must not take the last one.
    """
    cores = sorted(os.sched_getaffinity(0))
    pinned = ("taskset", "--cpu-list", str(cores[-1]))
    fifo = ("chrt", "--fifo", FIFO_PRIORITY)
    allowed = len(cores) > 1 and run_bounded([*fifo, "true"], 10.0).returncode == 0
    return (*pinned, *fifo) if allowed else pinned


@contextmanager
def _scratch_folder() -> Iterator[Path]:
    """Yield a folder that host and guest share."""
    with tempfile.TemporaryDirectory(prefix="stribeck-uml-", dir=SHARED_FOLDER) as folder:
        yield Path(folder)


@contextmanager
def _turn(clock: MonotonicClock) -> Iterator[None]:
    """Wait until no other guest runs on this machine; the kernel ends a turn with its process."""
    lock = os.open(Path(SHARED_FOLDER) / "stribeck-uml.lock", os.O_RDONLY | os.O_CREAT, 0o644)
    try:
        deadline_s = clock.now() + TURN_S
        while not _locked(lock):
            if clock.now() > deadline_s:
                raise BootError(f"another User-Mode Linux has not ended within {TURN_S:g} s")
            clock.sleep_until(clock.now() + 0.2)
        yield
    finally:
        os.close(lock)


def _locked(descriptor: int) -> bool:
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def _memory_folder(scratch: Path) -> Path:
    """Return where the guest's memory file goes: a container's /dev/shm is small and noexec."""
    shared = Path("/dev/shm")
    if not os.access(shared, os.W_OK) or os.statvfs(shared).f_flag & os.ST_NOEXEC:
        return scratch
    return shared if shutil.disk_usage(shared).free >= MEMORY_MIB * 1024**2 else scratch


def _text(path: Path) -> str:
    return path.read_text(errors="replace") if path.is_file() else ""
