"""A real `vcan0` where the host's kernel has no AF_CAN: commands run inside User-Mode Linux.

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

It is booted once and then given one command after the other through files in a folder that both
see; between two commands it ends whatever the first has left running.
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
from tests.bus.process import kill_group, run_bounded
from tests.bus.xstate import compiled, has_more_registers

KERNEL = "linux.uml"
MEMORY_MIB = 1024
BOOT_S = 180.0  # seen: 2 s
POWER_OFF_S = 60.0
KILL_AFTER_S = 5
IDLE_S = 600  # without a command for so long the guest powers off: whoever booted it is gone
LOOK_S = 0.05
FIFO_PRIORITY = "20"
SHARED_FOLDER = "/var/tmp"  # not under /dev or /run, which the guest mounts for itself
TURN_S = 1800.0
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
# Process 1 of the guest: one real vcan0, the commands as they come, power off.
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
set +ex
number=1
idle=0
cd {folder}
ip link set vcan0 up && touch booted
while [ ! -e over ] && [ $idle -lt {idle_looks} ]; do
    if [ ! -e $number.job ]; then
        sleep {look_s}
        idle=$((idle + 1))
        continue
    fi
    sh ./$number.job </dev/null >$number.stdout 2>$number.stderr
    echo $? >exit_code
    kill -9 -1  # every other process: what a command leaves behind would answer the next one
    ip link set vcan0 up
    mv exit_code $number.exit_code
    number=$((number + 1))
    idle=0
done
"""

JOB = """\
cd {cwd} || exit 126
{exports}
# batch scheduling: with one core, a frame that wakes its reader must not interrupt its sender
exec chrt --batch 0 timeout --kill-after={kill_after_s} {timeout_s:.3f} {command}
"""


class BootError(Exception):
    """User-Mode Linux cannot be used here, or ended before the command did; says why."""


@dataclass(frozen=True)
class UserModeLinux:
    """A kernel that can be booted.

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

    @contextmanager
    def boot(self) -> Iterator[Guest]:
        """Yield a guest that has `vcan0` up; power it off afterwards.

        Raises
        ------
        BootError
            It did not come so far; with the end of its console.
        """
        clock = MonotonicClock()
        with _turn(clock), _scratch_folder() as folder:
            init = folder / "init"
            init.write_text(self._init_script(folder))
            init.chmod(0o700)
            loaded = compiled(folder) if has_more_registers() else ""
            if isinstance(loaded, str) and loaded:
                raise BootError(loaded)
            with (folder / "console").open("wb") as console:
                process = subprocess.Popen(
                    self._command(folder, init),
                    stdin=subprocess.DEVNULL,
                    stdout=console,
                    stderr=console,
                    env={
                        "PATH": SYSTEM_PATH,
                        "HOME": str(folder),
                        "TMPDIR": str(_memory_folder(folder)),
                        "LD_PRELOAD": str(loaded),
                    },
                    start_new_session=True,
                )
            guest = Guest(process, folder, clock, " ".join(self.prefix))
            try:
                guest.await_file("booted", BOOT_S)
                yield guest
                (folder / "over").touch()
                process.wait(POWER_OFF_S)
            finally:
                kill_group(process.pid)
                process.wait()

    def _command(self, folder: Path, init: Path) -> list[str]:
        return [
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

    def _init_script(self, folder: Path) -> str:
        return INIT.format(
            system_path=SYSTEM_PATH,
            modules=shlex.join(str(m) for m in self.modules),
            folder=shlex.quote(str(folder)),
            idle_looks=round(IDLE_S / LOOK_S),
            look_s=LOOK_S,
        )


class Guest:
    """A booted kernel that takes one command after the other; made by `UserModeLinux.boot`."""

    channel = "vcan0"

    def __init__(
        self, process: subprocess.Popen[bytes], folder: Path, clock: MonotonicClock, placement: str
    ) -> None:
        self._process = process
        self._folder = folder
        self._clock = clock
        self._placement = placement
        self._number = 0

    def describe(self) -> str:
        """Return in a few words where a command will run."""
        return f"vcan0 in User-Mode Linux ({self._placement})"

    def run(
        self,
        command: Sequence[str],
        timeout_s: float,
        cwd: Path | None = None,
        env: Mapping[str, str] | None = None,
    ) -> subprocess.CompletedProcess[str]:
        """Run `command` with `vcan0` up; nothing that it started outlives it.

        Raises
        ------
        subprocess.TimeoutExpired
            The command ran longer than `timeout_s`; with what it had written by then.
        BootError
            The guest ended without the command's exit code; with the end of its console.
        """
        self._number += 1
        job = self._folder / f"{self._number}.job"
        prepared = job.with_suffix(".new")
        prepared.write_text(_job(command, timeout_s, cwd or Path.cwd(), env or os.environ))
        started_s = self._clock.now()
        prepared.rename(job)  # the guest must not read half of it
        exit_code = self.await_file(
            f"{self._number}.exit_code", timeout_s + KILL_AFTER_S + BOOT_S
        ).strip()
        elapsed_s = self._clock.now() - started_s
        stdout, stderr = _text(job.with_suffix(".stdout")), _text(job.with_suffix(".stderr"))
        # coreutils' timeout: 124 when SIGTERM was enough; 137 when it took SIGKILL
        if exit_code == "124" or (exit_code == "137" and elapsed_s > timeout_s):
            raise subprocess.TimeoutExpired(list(command), timeout_s, stdout, stderr)
        return subprocess.CompletedProcess(list(command), int(exit_code), stdout, stderr)

    def await_file(self, name: str, patience_s: float) -> str:
        """Return what the guest has written under `name`, once it is there.

        Raises
        ------
        BootError
            The guest has ended, or `patience_s` is over; with the end of its console.
        """
        path, deadline_s = self._folder / name, self._clock.now() + patience_s
        while not path.exists():
            if self._process.poll() is not None:
                raise self._failure("ended too early")
            if self._clock.now() > deadline_s:
                raise self._failure(f"did not answer within {patience_s:g} s")
            self._clock.sleep_until(self._clock.now() + LOOK_S)
        return path.read_text()

    def _failure(self, what: str) -> BootError:
        end = "\n".join(_text(self._folder / "console").splitlines()[-15:])
        return BootError(f"User-Mode Linux {what}:\n{end}")


def find_user_mode_linux() -> UserModeLinux:
    """Return a kernel that has what it takes to be booted here.

    Raises
    ------
    BootError
        With what is missing.
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
    return UserModeLinux(kernel, modules, _placement())


def _job(command: Sequence[str], timeout_s: float, cwd: Path, env: Mapping[str, str]) -> str:
    """Return the script that runs one command."""
    passed_on = {
        name: value
        for name, value in env.items()
        if name in PASSED_ON or name.startswith(PASSED_ON_PREFIXES)
    }
    return JOB.format(
        cwd=shlex.quote(str(cwd)),
        exports="\n".join(f"export {n}={shlex.quote(v)}" for n, v in passed_on.items()),
        kill_after_s=KILL_AFTER_S,
        timeout_s=timeout_s,
        command=shlex.join(command),
    )


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
