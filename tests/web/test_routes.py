"""Every route and every role, in one table; every page in both languages."""

from __future__ import annotations

import pytest

from agent.web.roles import Role
from tests.web.bench import Bench

ANYBODY, VIEWER, TECHNICIAN, ENGINEER = None, Role.VIEWER, Role.TECHNICIAN, Role.ENGINEER

# method, route, a path of it, least role, status for those who are let through
TABLE = (
    ("GET", "/login", "/login", ANYBODY, 200),
    ("POST", "/login", "/login", ANYBODY, 422),
    ("GET", "/unlock", "/unlock", ANYBODY, None),
    ("GET", "/welcome", "/welcome", ANYBODY, 200),
    ("POST", "/welcome", "/welcome", ANYBODY, 422),
    ("GET", "/language/{language}", "/language/de", ANYBODY, 303),
    ("POST", "/stop", "/stop", ANYBODY, 303),
    ("GET", "/stopped", "/stopped", ANYBODY, 200),
    ("GET", "/status", "/status", ANYBODY, 200),
    ("GET", "/", "/", VIEWER, 200),
    ("GET", "/cards", "/cards", VIEWER, 200),
    ("POST", "/lock", "/lock", VIEWER, 303),
    ("POST", "/logout", "/logout", VIEWER, 303),
    ("GET", "/run", "/run", VIEWER, 200),
    ("GET", "/run/live", "/run/live", VIEWER, 204),
    ("GET", "/results/{name}", "/results/second", VIEWER, 200),
    ("GET", "/results/{name}/report", "/results/second/report", VIEWER, 200),
    ("GET", "/results/{name}/explanation", "/results/second/explanation", VIEWER, 404),
    ("GET", "/results/{name}/download/{kind}", "/results/second/download/parquet", VIEWER, 200),
    ("GET", "/axes/{number}", "/axes/1", VIEWER, 200),
    ("GET", "/alarms", "/alarms", VIEWER, 200),
    ("GET", "/axes/{number}/start", "/axes/1/start", TECHNICIAN, 200),
    ("GET", "/axes/{number}/preconditions", "/axes/1/preconditions", TECHNICIAN, 200),
    ("POST", "/axes/{number}/start", "/axes/1/start", TECHNICIAN, 422),
    ("POST", "/axes/{number}/events", "/axes/1/events", TECHNICIAN, 422),
    ("POST", "/alarms/{name}", "/alarms/second", TECHNICIAN, 422),
    ("POST", "/results/{name}/baseline", "/results/second/baseline", ENGINEER, 303),
    ("GET", "/users", "/users", ENGINEER, 200),
    ("POST", "/users", "/users", ENGINEER, 422),
    ("POST", "/users/{name}/disable", "/users/vera/disable", ENGINEER, 303),
    ("GET", "/audit", "/audit", ENGINEER, 200),
)


@pytest.mark.parametrize("role", [ANYBODY, VIEWER, TECHNICIAN, ENGINEER])
def test_each_route_lets_through_its_role_and_those_above(bench: Bench, role: Role | None) -> None:
    bench.shelve("first", 1)
    bench.shelve("second", 2, friction=1.1)
    for method, _route, path, least, status in TABLE:
        browser = bench.browser(role)
        answer = browser.get(path) if method == "GET" else browser.post(path)
        if least is None or (role is not None and role >= least):
            assert status is None or answer.status_code == status, (method, path, answer.text)
        elif role is None:
            to_log_in = answer.headers.get("location", "").startswith("/login")
            assert answer.status_code == 401 or (answer.status_code == 303 and to_log_in), path
        else:
            assert answer.status_code == 403, (method, path)


def test_the_table_has_every_route(bench: Bench) -> None:
    paths = bench.page.app.openapi()["paths"]
    there = {(method.upper(), path) for path, methods in paths.items() for method in methods}
    assert there == {(method, route) for method, route, *_ in TABLE}


def test_a_form_without_its_token_changes_nothing(bench: Bench) -> None:
    bench.shelve("second", 2)
    for method, _route, path, least, _status in TABLE:
        if method == "POST" and least is not None:
            browser = bench.browser(ENGINEER)
            for wrong in ("", "x" * 32, "ü\udcff"):
                browser.csrf = wrong.encode("utf-8", "replace").decode()
                assert browser.post(path).status_code == 403, path
    assert bench.page.baseline(1) == ""
    assert not any(user.disabled for user in bench.page.users.all())


def test_a_form_of_another_site_is_refused_where_it_would_change_something(bench: Bench) -> None:
    browser = bench.browser(ENGINEER)
    for headers in ({"origin": "https://evil.example"}, {"sec-fetch-site": "cross-site"}):
        browser.headers = headers
        assert browser.post("/logout").status_code == 403
        login = browser.post("/login", {"name": "eva", "password": "four plain words here"})
        assert login.status_code == 403


PAGES = (
    "/",
    "/run",
    "/stopped",
    "/alarms",
    "/axes/1",
    "/axes/1/start",
    "/axes/1/start?cycle=triangle",
    "/results/first",
    "/results/second",
    "/results/undecided",
    "/results/stopped",
    "/users",
    "/audit",
    "/welcome",
    "/nowhere",
)


@pytest.mark.parametrize("language", ["en", "de"])
def test_every_page_speaks_the_reader_s_language_and_escapes_what_it_shows(
    bench: Bench, language: str
) -> None:
    bench.shelve("first", 1, alarm=False)
    bench.shelve("second", 2, friction=1.1, alarm=True)
    bench.shelve("undecided", 3, decidable=False)
    bench.shelve("stopped", 4, extra={"stopped_because": "<script>alert(1)</script>"})
    browser = bench.browser(ENGINEER)
    browser.get(f"/language/{language}?back=/")
    for path in PAGES:
        answer = browser.get(path)
        assert answer.headers["content-language"] == language
        assert f'<html lang="{language}">' in answer.text
        assert "<script>alert" not in answer.text
        assert "one speed only <b>" not in answer.text
        assert ("Test stoppen" if language == "de" else "Stop test (not an E-stop)") in answer.text
