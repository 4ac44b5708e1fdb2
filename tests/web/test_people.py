"""How people come in, are locked out while away, and leave."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import typer

from agent.cli.page import user
from agent.errors import InputError
from agent.record.audit import verify
from agent.web.application import first_token
from agent.web.passwords import Argon2
from agent.web.roles import Role
from tests.web.bench import PASSWORD, Bench, Browser, make


def welcome(page_browser: Browser, token: str, name: str, password: str = PASSWORD) -> int:
    data = {"token": token, "name": name, "password": password, "again": password}
    return page_browser.post("/welcome", data).status_code


@pytest.fixture
def empty(tmp_path: Path) -> Bench:
    bench = make(tmp_path)
    with bench.page.store.writing() as connection:
        connection.execute("DELETE FROM users")
    return bench


def test_the_first_user_needs_the_printed_token_and_there_is_no_default(empty: Bench) -> None:
    browser = Browser(empty.page)
    assert browser.get("/login").headers["location"] == "/welcome"
    older, token = first_token(empty.page), first_token(empty.page)
    assert welcome(browser, "guess", "maria") == 422
    assert welcome(browser, older, "maria") == 422  # each start prints another one
    assert welcome(browser, token, "maria", "short") == 422
    assert welcome(browser, token, "maria", "maria maria maria") == 422
    assert welcome(browser, token, "../maria") == 422
    empty.clock.time_s += 400.0  # five tries: now everybody waits a little
    assert welcome(browser, token, "maria") == 303
    assert browser.get("/users").status_code == 200
    assert welcome(Browser(empty.page), token, "mallory") in (422, 429)
    assert first_token(empty.page) == ""
    assert [user.name for user in empty.page.users.all()] == ["maria"]
    empty.page.store.close()


def test_passwords_and_tokens_are_nowhere_in_the_files(bench: Bench) -> None:
    token = bench.page.users.invite("otto", Role.VIEWER)
    assert welcome(Browser(bench.page), token, "") == 303
    Browser(bench.page).post("/login", {"name": "otto", "password": "not my password"})
    assert bench.page.settings.state.stat().st_mode & 0o077 == 0
    for path in bench.page.settings.state.rglob("*"):
        if path.is_file():
            content = path.read_bytes()
            for secret in (PASSWORD, token, "not my password"):
                assert secret.encode() not in content, path


def test_an_invitation_ends_after_a_day(tmp_path: Path) -> None:
    from agent.web.passwords import Argon2
    from agent.web.store import Store
    from agent.web.users import Users

    now = ["2026-03-28T23:30:00.000Z"]
    store = Store(tmp_path / "state")
    users = Users(store, Argon2(1, 8), lambda: now[0])
    token = users.invite("otto", Role.VIEWER)
    now[0] = "2026-03-29T23:29:59.000Z"
    assert users.invitation(token) is not None
    now[0] = "2026-03-29T23:30:00.000Z"
    assert users.invitation(token) is None
    store.close()


def test_a_hash_of_older_numbers_is_made_anew_by_the_right_password_alone(tmp_path: Path) -> None:
    from agent.web.passwords import Argon2
    from agent.web.store import Store
    from agent.web.users import Users

    store = Store(tmp_path / "state")

    def kept() -> str:
        with store.reading() as connection:
            (text,) = connection.execute("SELECT password FROM users").fetchone()
        return str(text)

    before = Users(store, Argon2(2, 16))
    before.accept(before.invite("otto", Role.VIEWER), "otto", PASSWORD)
    old = kept()
    now = Users(store, Argon2(1, 8))
    assert now.authenticate("otto", "not my password") is None
    assert kept() == old
    assert now.authenticate("otto", PASSWORD) is not None
    assert "m=8,t=1,p=1" in kept()
    renewed = kept()
    assert now.authenticate("otto", PASSWORD) is not None
    assert kept() == renewed
    store.close()


def test_an_unused_session_is_locked_and_what_the_page_asks_by_itself_keeps_none_alive(
    bench: Bench,
) -> None:
    browser = bench.browser(Role.TECHNICIAN)
    for _ in range(10):
        bench.clock.time_s += 100.0
        answer = browser.get("/cards", **{"hx-request": "true"})
    assert answer.status_code == 401
    assert answer.headers["hx-redirect"] == "/unlock"
    assert browser.get("/axes/1").headers["location"].startswith("/unlock")
    assert browser.post("/axes/1/events", {"kind": "swap"}).status_code == 401
    assert "toni" in browser.get("/unlock").text
    assert browser.post("/stop").status_code == 303  # the stop asks nobody who they are
    assert browser.post("/login", {"name": "toni", "password": PASSWORD}).status_code == 303
    assert browser.get("/axes/1").status_code == 200


def test_who_uses_the_page_stays_in_for_a_shift_and_no_longer(bench: Bench) -> None:
    browser = bench.browser(Role.VIEWER)
    for _ in range(71):
        bench.clock.time_s += 600.0
        assert browser.get("/").status_code == 200
    bench.clock.time_s += 800.0
    assert browser.get("/").headers["location"].startswith("/login")


def test_a_new_password_ends_the_old_one_and_its_sessions(bench: Bench) -> None:
    browser = bench.browser(Role.VIEWER)
    answer = bench.browser(Role.ENGINEER).post("/users", {"name": "vera", "role": "technician"})
    token = answer.text.partition('class="token">')[2].partition("<")[0]
    assert welcome(Browser(bench.page), token, "", "another four plain words") == 303
    assert browser.get("/").headers["location"].startswith("/login")
    assert bench.page.users.authenticate("vera", PASSWORD) is None
    user = bench.page.users.authenticate("vera", "another four plain words")
    assert user is not None
    assert user.role is Role.TECHNICIAN


def test_what_people_do_stands_in_the_trail(bench: Bench) -> None:
    bench.shelve("bad", 2, alarm=True)
    browser = Browser(bench.page)
    browser.post("/login", {"name": "eva", "password": "wrong"})
    browser.post("/login", {"name": "eva", "password": PASSWORD})
    engineer = bench.browser(Role.ENGINEER)
    engineer.post("/axes/1/events", {"kind": "oil-change", "note": "2.3 l"})
    engineer.post("/alarms/bad", {"note": "grease checked"})
    engineer.post("/results/bad/baseline")
    engineer.post("/users", {"name": "otto", "role": "viewer"})
    engineer.post("/users/otto/disable")
    done = [(e.who, e.what) for e in reversed(bench.page.audit.newest(20))]
    assert done == [
        ("nobody", "log-in refused"),
        ("eva", "logged in"),
        ("eva", "event noted"),
        ("eva", "alarm acknowledged"),
        ("eva", "baseline chosen"),
        ("eva", "user invited"),
    ]
    assert verify(bench.page.settings.state).entries == len(done)


def test_the_commands_invite_list_and_disable(
    bench: Bench, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(user, "Argon2", lambda: Argon2(1, 8))
    state = bench.page.settings.state
    user.invite_user(state, "otto", "viewer")
    token = capsys.readouterr().out.strip()
    assert welcome(Browser(bench.page), token, "") == 303
    user.list_users(state, as_json=True)
    listed = {entry["name"]: entry for entry in json.loads(capsys.readouterr().out)}
    assert (listed["otto"]["role"], listed["otto"]["disabled"]) == ("viewer", False)
    user.disable_user(state, "otto")
    user.list_users(state, as_json=False)
    assert "otto                     viewer      disabled" in capsys.readouterr().out
    assert bench.page.users.authenticate("otto", PASSWORD) is None
    with pytest.raises(typer.BadParameter, match="engineer"):
        user.invite_user(state, "otto", "king")
    with pytest.raises(InputError, match="no page was ever served"):
        user.list_users(state / "nowhere", as_json=False)
