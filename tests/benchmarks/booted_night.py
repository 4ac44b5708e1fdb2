"""Two nights under a systemd that has booted: ``python -m tests.benchmarks.booted_night``.

A kernel in User-Mode Linux boots systemd as process 1 on a copy of this machine's files in memory
(an overlay: nothing of it is written here, none of its own services starts). In there are a real
vcan0, the simulated drive and a PLC. `stribeck night install` is told yes; the clock is set to ten
seconds before the window; the timer must start the service, and the service the cycle. The next
night's service is stopped by systemd while the joint moves. What was seen is printed as JSON; the
exit code is 1 when anything is not as it must be. Needs root, user-mode-linux and systemd.
"""

from __future__ import annotations

import contextlib
import datetime
import json
import shlex
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import tomli_w

from agent.cycle.precedence import PRIORITY
from agent.night.description import night_path
from agent.record.events_file import read_events
from agent.record.reading import read
from drivers.clock import MonotonicClock
from tests.bus import uml
from tests.bus.process import kill_group
from tests.conftest import REPOSITORY
from tests.system.processes import be_patient, started

SYSTEMD = Path("/lib/systemd/systemd")
BOOT_AND_NIGHTS_S = 600.0
ZONE, WINDOW = "Europe/Berlin", "01:00-03:00"
FIRST_NIGHT = datetime.datetime(2026, 1, 15, 0, 0, tzinfo=datetime.UTC)  # 01:00 in Berlin
BEFORE_S = 10.0
PATIENCE_S = 200.0
SERVICE, TIMER = (f"stribeck-night-simulated-joint.{kind}" for kind in ("service", "timer"))
OVERLAY = "fs/overlayfs/overlay.ko"

INIT = """\
#!/bin/sh
set -eux
PATH={path}
export PATH
mount -t proc proc /proc
trap 'sync; echo o >/proc/sysrq-trigger; sleep 60' EXIT
for module in {modules}; do insmod "$module"; done
ip link set lo up
ip link add vcan0 type vcan
ip link set vcan0 up
mount -t tmpfs tmpfs /mnt
mkdir /mnt/upper /mnt/work /mnt/root
mount -t overlay overlay -o lowerdir=/,upperdir=/mnt/upper,workdir=/mnt/work /mnt/root
cd /mnt/root
mount -t hostfs none .{folder} -o {folder}
mount -t tmpfs tmpfs tmp
rm -rf etc/systemd/system/* etc/fstab
cp .{folder}/default.target .{folder}/seen.service etc/systemd/system/
echo 5a1df3c0e6f84d7b9a0c4e2b7d915f36 >etc/machine-id
trap - EXIT
exec switch_root /mnt/root {systemd}
"""
TARGET = """\
[Unit]
Description=What is looked at here
Requires=basic.target
Wants=timers.target seen.service
After=basic.target
AllowIsolate=yes
"""
SEEN = """\
[Unit]
Description=The cell, and whoever looks
After=basic.target
SuccessAction=poweroff-force
FailureAction=poweroff-force

[Service]
Type=oneshot
WorkingDirectory={cwd}
Environment=HOME=/root PATH={path}
ExecStart={python} -m tests.benchmarks.booted_night --inside {folder}
StandardOutput=file:{folder}/inside.out
StandardError=file:{folder}/inside.err
"""


def main() -> int:
    """Boot, wait until it has powered off, print what was seen."""
    if sys.argv[1:2] == ["--inside"]:
        look(Path(sys.argv[2]))
        return 0
    kernel = uml.find_user_mode_linux()
    if not SYSTEMD.exists():
        sys.stderr.write(f"{SYSTEMD} is not there (Debian package systemd)\n")
        return 2
    with uml._turn(MonotonicClock()), uml._scratch_folder() as folder:
        boot(kernel, folder)
        seen = folder / "seen.json"
        if seen.exists():
            sys.stdout.write(seen.read_text() + "\n")
            return 0
        for name in ("inside.err", "console"):
            text = (folder / name).read_text(errors="replace") if (folder / name).exists() else ""
            sys.stderr.write(f"--- {name}\n" + "\n".join(text.splitlines()[-60:]) + "\n")
        return 1


def boot(kernel: uml.UserModeLinux, folder: Path) -> None:
    """Boot systemd and wait until the machine has powered itself off."""
    modules = (*kernel.modules, kernel.modules[0].parents[2] / OVERLAY)
    path = f"{Path(sys.executable).parent}:{uml.SYSTEM_PATH}"
    (folder / "init").write_text(
        INIT.format(
            path=uml.SYSTEM_PATH,
            modules=shlex.join(str(m) for m in modules),
            folder=folder,
            systemd=SYSTEMD,
        )
    )
    (folder / "init").chmod(0o700)
    (folder / "default.target").write_text(TARGET)
    (folder / "seen.service").write_text(
        SEEN.format(cwd=REPOSITORY, path=path, python=sys.executable, folder=folder)
    )
    command = [*kernel.prefix, kernel.kernel, "mem=1536M", "rootfstype=hostfs", "rootflags=/", "ro"]
    command += [f"init={folder}/init", "con=null", "con0=null,fd:1", f"uml_dir={folder}"]
    command += ["systemd.log_target=console", "systemd.show_status=false"]
    environment = {"PATH": uml.SYSTEM_PATH, "HOME": str(folder)}
    environment["TMPDIR"] = str(uml._memory_folder(folder))
    with (folder / "console").open("wb") as console:
        process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=console,
            stderr=console,
            env=environment,
            start_new_session=True,
        )
    try:
        process.wait(BOOT_AND_NIGHTS_S)
    except subprocess.TimeoutExpired:
        sys.stderr.write(f"not over within {BOOT_AND_NIGHTS_S:g} s\n")
    finally:
        kill_group(process.pid)
        process.wait()


# -- inside ----------------------------------------------------------------------------------------


def look(folder: Path) -> None:
    """Install the night, let it run twice, and keep what was seen."""
    work = Path("/root/cell")
    work.mkdir(parents=True)
    seen: dict[str, Any] = {"systemd": said("systemctl", "--version").split("\n")[0]}
    cell = work / "cell.toml"
    fake: list[str | Path] = ["fake", "--interface", "socketcan", "--channel", "vcan0"]
    fake += ["--write-cell", cell, "--short"]
    with plc() as port, started(fake, work / "fake.log", ready="ready"):
        be_patient(cell)
        document = tomllib.loads(cell.read_text())
        # patient: the guest stands still while the host reads files for it
        document["release"] = {"kind": "modbus", "tcp": f"127.0.0.1:{port}"}
        document["release"] |= {"wait_s": 20.0, "age_max_s": 5.0, "timeout_s": 2.0}
        cell.write_text(tomli_w.dumps(document))
        axis = {"number": 1, "window": WINDOW}
        night_path(cell).write_text(
            tomli_w.dumps({"schema": "stribeck.night/1", "time_zone": ZONE, "axis": [axis]})
        )
        set_clock(FIRST_NIGHT - datetime.timedelta(hours=1))
        program = str(Path(sys.executable).with_name("stribeck"))
        said(program, "night", "install", str(cell), stdin="y\n")
        seen["verified"] = said("systemd-analyze", "verify", TIMER, SERVICE) or "no complaint"
        try:
            seen["first night"] = whole_night(work, FIRST_NIGHT)
            seen["second night"] = stopped_night(work, FIRST_NIGHT + datetime.timedelta(days=1))
        finally:
            for name in ("fake.log", "recordings"):
                place = work / name
                with contextlib.suppress(OSError):  # a night that failed has not made all of it
                    (shutil.copytree if place.is_dir() else shutil.copy)(place, folder / name)
            (folder / "journal").write_text(said("journalctl", "-b", "--no-pager"))
    (folder / "seen.json").write_text(json.dumps(seen, indent=1))


def whole_night(work: Path, begins: datetime.datetime) -> dict[str, Any]:
    """Let the timer elapse and the service run to its end."""
    set_clock(begins - BEFORE)
    due = state(TIMER, "NextElapseUSecRealtime")
    await_state(lambda: state(SERVICE, "ExecMainExitTimestamp"))
    kinds, texts = told(work)
    assert state(SERVICE, "Result") == "success", texts
    assert kinds == ["night", "begun", "run"], texts
    (recording,) = recordings(work)
    metadata = read(recording).metadata
    assert metadata.extra["scheduling"].startswith("SCHED_FIFO"), metadata.extra["scheduling"]
    return {
        "timer elapses next": due,
        "service started": state(SERVICE, "ExecMainStartTimestamp"),
        "service ended": state(SERVICE, "ExecMainExitTimestamp"),
        "exit status": state(SERVICE, "ExecMainStatus"),
        "said": texts[-1],
        "samples lost": metadata.samples_lost,
        "scheduling": metadata.extra["scheduling"],
    }


def stopped_night(work: Path, begins: datetime.datetime) -> dict[str, Any]:
    """Have systemd stop the service while the joint moves."""
    before = set(recordings(work))
    set_clock(begins - BEFORE)
    await_state(lambda: moving(work))
    clock = MonotonicClock()
    asked_s = clock.now()
    said("systemctl", "stop", SERVICE)
    took_s = clock.now() - asked_s
    kinds, texts = told(work)
    assert kinds[3:] == ["begun", "stopped"], texts
    (recording,) = set(recordings(work)) - before
    columns = read(recording).columns
    return {
        "service started": state(SERVICE, "ExecMainStartTimestamp"),
        "stop took, s": round(took_s, 1),
        "result": state(SERVICE, "Result"),
        "said": texts[-1],
        "samples kept": int(columns["time_s"].size),
    }


BEFORE = datetime.timedelta(seconds=BEFORE_S)


def moving(work: Path) -> bool:
    """Return whether a stream has grown far beyond its first flush: the stair is under way."""
    streams = list((work / "recordings").glob("*.arrows"))
    return any(path.stat().st_size > 400_000 for path in streams)


def set_clock(at: datetime.datetime) -> None:
    """Set the machine's clock."""
    said("date", "-u", "-s", f"@{at.timestamp():.0f}")


def recordings(work: Path) -> list[Path]:
    """Return the recordings so far."""
    return sorted((work / "recordings").glob("*.parquet"))


def told(work: Path) -> tuple[list[str], list[str]]:
    """Return kinds and texts of the night's events so far."""
    events = [event for _, event in read_events(work / "recordings")[0]]
    return [e.kind for e in events], [e.text for e in events]


def state(unit: str, what: str) -> str:
    """Return one property of a unit."""
    return said("systemctl", "show", unit, f"--property={what}", "--value").strip()


def await_state(holds: Callable[[], object]) -> None:
    """Wait until something holds."""
    clock = MonotonicClock()
    until_s = clock.now() + PATIENCE_S
    while not holds():
        assert clock.now() < until_s, said("systemctl", "status", "--no-pager", TIMER, SERVICE)
        clock.sleep_until(clock.now() + 0.5)


def said(*command: str, stdin: str = "") -> str:
    """Return what a command says; what it complains of goes to our own stderr."""
    done = subprocess.run(command, input=stdin, capture_output=True, text=True, check=False)
    if done.returncode or done.stderr:
        sys.stderr.write(f"$ {shlex.join(command)}: {done.returncode}\n{done.stderr}")
    return done.stdout


@contextlib.contextmanager
def plc() -> Iterator[int]:
    """Yield the port of a PLC that permits."""
    # a PLC has a processor of its own; here one is all that there is
    command = ["chrt", "--fifo", str(PRIORITY + 1), sys.executable, "-m", "fakes.plc"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            yield int(process.stdout.readline().rpartition(":")[2])
        finally:
            process.terminate()


if __name__ == "__main__":
    sys.exit(main())
