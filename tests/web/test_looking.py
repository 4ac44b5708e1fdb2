"""What the devices say before a start: shown as it is seen, and never in the way of a cycle."""

from __future__ import annotations

import sys
import threading
from pathlib import Path

import pytest

from agent.web.looking import OLDEST_S, Look, Looking
from agent.web.roles import Role
from tests.web.bench import Bench
from tests.web.test_attended import ended, wait_until

CHILD = """
import json, pathlib, sys, time
out = pathlib.Path(sys.argv[sys.argv.index("--out") + 1])
told = {"look": 0, "untold": "The cell's PLC answers.", "conditions": [
    ["identity", True, ""], ["drive healthy", False, "The drive is in <fault>: 0x8611."]]}
while not pathlib.Path(sys.argv[1]).exists():
    time.sleep(0.005)
fresh = out.with_suffix(".new")
fresh.write_text(json.dumps(told))
fresh.replace(out)
while sys.stdin.buffer.read(1):
    pass
"""


def may_tell(bench: Bench) -> Path:
    """Return the file that lets the child tell what it has seen."""
    return bench.recordings / "may-tell"


def looks(bench: Bench, *command: str) -> Looking:
    state, cell = bench.page.settings.state, bench.page.settings.cell_path
    bench.page.looking = Looking(
        state, cell, bench.clock, command or (sys.executable, "-c", CHILD, str(may_tell(bench)))
    )
    return bench.page.looking


def test_what_was_seen_is_in_the_list_and_refuses_nothing_by_itself(bench: Bench) -> None:
    looking, browser = looks(bench), bench.browser(Role.TECHNICIAN)
    first = browser.get("/axes/1/start").text
    assert "nothing is known of them yet" in first
    may_tell(bench).touch()
    wait_until(lambda: looking.ask(1))
    text = browser.get("/axes/1/preconditions", **{"accept-language": "en"}).text
    assert "Refused now. Reasons: 1." in text
    assert "The drive is in &lt;fault&gt;: 0x8611." in text
    assert text.count("read just now, and is judged again after the start") == 1
    assert text.index("Refused now") < text.index("Drive healthy") < text.index("<details")
    assert "The cell&#39;s PLC answers." in text
    german = browser.get("/axes/1/preconditions", **{"accept-language": "de"}).text
    assert '<span lang="de">Der Antrieb meldet einen Fehler' in german
    (child,) = looking._children.values()
    started = browser.post("/axes/1/start", {"cycle": "stair", "confirmed": "yes"})
    assert started.headers["location"] == "/run"
    assert child.process.poll() is not None  # the bus is the cycle's
    run = bench.page.attendant.run
    assert run is not None
    browser.get("/axes/1/preconditions")
    assert looking._children == {}  # nobody looks while a cycle runs
    bench.page.attendant.stop()
    ended(bench, run)


def test_an_old_look_is_none_and_one_that_has_ended_is_begun_anew(bench: Bench) -> None:
    may_tell(bench).touch()
    looking = looks(bench)
    wait_until(lambda: looking.ask(1))
    assert looking.ask(1) == Look(
        {"identity": "", "drive healthy": "The drive is in <fault>: 0x8611."},
        "The cell's PLC answers.",
    )
    bench.clock.time_s += OLDEST_S + 1.0
    assert looking.ask(1) is None
    (child,) = looking._children.values()
    child.process.kill()
    child.process.wait()
    wait_until(lambda: looking.ask(1))
    assert looking._children[1] is not child
    together = [threading.Thread(target=looking.ask, args=(1,)) for _ in range(8)]
    for thread in together:
        thread.start()
    for thread in together:
        thread.join()
    assert len(looking._children) == 1
    looking.end()
    looking.end()


@pytest.mark.parametrize("command", [("/no/such/program",), (sys.executable, "-c", "pass")])
def test_a_look_that_cannot_be_made_leaves_the_list_as_it_was(
    bench: Bench, command: tuple[str, ...]
) -> None:
    looking, browser = looks(bench, *command), bench.browser(Role.TECHNICIAN)
    for _ in range(2):
        assert browser.get("/axes/1/preconditions").status_code == 200
    looking.end()


def test_a_spoilt_file_is_no_look(bench: Bench) -> None:
    looking = looks(bench, sys.executable, "-c", "import sys; sys.stdin.read()")
    looking.ask(1)
    (child,) = looking._children.values()
    for text in ("", "[]", "{}", '{"conditions": [1], "untold": ""}', '{"conditions": 3}'):
        child.out.write_text(text)
        assert looking.ask(1) is None, text
    looking.end()
