"""What somebody might try: foreign names, large and broken requests, forged sessions, guesses."""

from __future__ import annotations

import json
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import pytest
import schemathesis
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from schemathesis.core.result import Ok

from agent.errors import InputError
from agent.web.access import local_path
from agent.web.guard import LARGEST_BODY, host_name
from agent.web.limits import FIRST_WAIT_S, FREE, LONGEST_WAIT_S, Attempts
from agent.web.roles import Role
from agent.web.settings import PageSettings, is_loopback
from tests.web.bench import NAMES, PASSWORD, Bench, Browser, Clock


def test_a_foreign_host_name_gets_nothing_not_even_the_stop(bench: Bench) -> None:
    browser = bench.browser(Role.ENGINEER)
    for host in ("evil.example", "127.0.0.1.evil.example:8420", "", "localhost:1:2"):
        assert browser.get("/", host=host).status_code == 421, host
        assert browser.ask("POST", "/stop", headers={"host": host}).status_code == 421
    for host in ("localhost", "LOCALHOST:9", "127.0.0.1:8420", "[::1]:8420"):
        assert browser.get("/", host=host).status_code == 200, host


def test_every_answer_carries_the_strict_headers(bench: Bench) -> None:
    bench.shelve("first", 1)
    browser = bench.browser(Role.VIEWER)
    for path in ("/", "/nowhere", "/static/page.js", "/status", "/results/first/report"):
        headers = browser.get(path).headers
        policy = headers["content-security-policy"]
        assert "default-src 'none'" in policy
        assert "frame-ancestors 'none'" in policy
        assert "unsafe-eval" not in policy
        script = policy.partition("script-src")[2].partition(";")[0]
        assert "unsafe-inline" not in script
        assert headers["x-content-type-options"] == "nosniff"
        assert headers["cache-control"] == "no-store"
    assert "sandbox" in browser.get("/results/first/report").headers["content-security-policy"]


def test_no_template_has_inline_script_or_style() -> None:
    from importlib.resources import files

    for file in (files("agent.web") / "templates").iterdir():
        text = file.read_text("utf-8")
        assert " style=" not in text, file.name
        assert " onclick=" not in text, file.name
        assert text.count("<script") == text.count('<script src="/static') + text.count(
            '<script type="application/json"'
        )


def test_a_session_cookie_is_out_of_scripts_reach_and_of_other_sites(tmp_path: Path) -> None:
    from tests.web.bench import make

    bench = make(tmp_path, public_url="https://cell7.example")
    browser = Browser(bench.page)
    answer = browser.post("/login", {"name": "eva", "password": PASSWORD})
    said = answer.headers["set-cookie"]
    assert said.startswith("__Host-stribeck_session=")
    for word in ("HttpOnly", "Secure", "SameSite=strict", "Path=/"):
        assert word in said
    assert "strict-transport-security" in answer.headers
    assert browser.get("/status", host="cell7.example").status_code == 200
    bench.page.store.close()


def test_large_bodies_are_refused_declared_or_not(bench: Bench) -> None:
    browser = bench.browser(Role.ENGINEER)
    big = b"a" * (LARGEST_BODY + 1)

    async def in_parts() -> AsyncIterator[bytes]:
        for _ in range(5):
            yield big[: LARGEST_BODY // 4]

    form = {"content-type": "application/x-www-form-urlencoded"}
    assert browser.ask("POST", "/users", content=big, headers=form).status_code == 413
    assert browser.ask("POST", "/users", content=in_parts(), headers=form).status_code == 413
    odd = browser.ask("POST", "/stop", headers={"content-length": "-1"})
    assert odd.status_code == 413


@pytest.mark.parametrize("body", [b"\xff\xfe=%zz&&==", b"{" * 5000, b"name=" + b"%00" * 60, b""])
@pytest.mark.parametrize(
    "kind",
    [
        "application/x-www-form-urlencoded",
        "multipart/form-data; boundary=x",
        "application/json",
        "multipart/form-data",
        "text/\xfcx",
    ],
)
def test_malformed_forms_are_refused_politely(bench: Bench, body: bytes, kind: str) -> None:
    browser = bench.browser(Role.ENGINEER)
    headers = {"content-type": kind.encode("latin-1"), "x-csrf-token": browser.csrf}
    for path in ("/login", "/users", "/axes/1/start", "/alarms/x"):
        answer = browser.ask("POST", path, content=body, headers=headers)
        assert 400 <= answer.status_code < 500, (path, answer.status_code)


NAMES_TRIED = (
    "../cell.toml",
    "..%2fcell",
    "%2e%2e/%2e%2e/etc/passwd",
    "/etc/passwd",
    "....//cell",
    "..\\cell",
    "first%00",
    "first/../../cell",
    "~",
    "*",
    "first.parquet",
    "x" * 4000,
)


def test_no_name_leads_out_of_the_recordings(bench: Bench) -> None:
    bench.shelve("first", 1)
    (bench.recordings / "other.estimate.json").write_text("{}")
    (bench.recordings.parent / "secret.parquet").write_text("TOP-SECRET")
    browser = bench.browser(Role.ENGINEER)
    for name in (*NAMES_TRIED, "other", "../secret"):
        for path in (f"/results/{name}", f"/results/{name}/download/parquet", f"/static/{name}"):
            answer = browser.get(path)
            assert answer.status_code in (404, 405), path
            assert "TOP-SECRET" not in answer.text
    for kind in ("exe", "%2e%2e", "sh"):
        assert browser.get(f"/results/first/download/{kind}").status_code == 404


def test_forged_and_ended_sessions_are_nobody(bench: Bench) -> None:
    browser = bench.browser(Role.ENGINEER)
    good = browser.cookies["stribeck_session"]
    for forged in ("", "x", good[:-1], good + "x", good.swapcase(), "a" * 100_000, "%00", "null"):
        other = Browser(bench.page)
        other.cookies.set("stribeck_session", forged)
        assert other.get("/users").status_code in (303, 431), forged[:20]
    assert browser.post("/logout").status_code == 303
    again = Browser(bench.page)
    again.cookies.set("stribeck_session", good)
    assert again.get("/users").headers["location"].startswith("/login")


def test_a_disabled_user_is_out_at_once_and_a_role_is_no_word_of_the_browser(bench: Bench) -> None:
    viewer = bench.browser(Role.VIEWER)
    assert bench.browser(Role.ENGINEER).post("/users/vera/disable").status_code == 303
    assert viewer.get("/").headers["location"].startswith("/login")
    assert bench.page.users.authenticate("vera", PASSWORD) is None
    last = bench.browser(Role.ENGINEER).post("/users/eva/disable")
    assert last.status_code == 409  # nobody could invite any more
    toni = bench.browser(Role.TECHNICIAN)
    assert toni.post("/users", {"name": "toni", "role": "engineer"}).status_code == 403


def test_guessing_passwords_is_slowed_down_by_name_and_by_address(bench: Bench) -> None:
    browser = Browser(bench.page)
    for _ in range(FREE):
        answer = browser.post("/login", {"name": "eva", "password": "wrong password"})
        assert answer.status_code == 401
    right = {"name": "eva", "password": PASSWORD}
    assert browser.post("/login", right).status_code == 429
    bench.clock.time_s += FIRST_WAIT_S + 0.1
    assert browser.post("/login", right).status_code == 303
    assert browser.get("/").status_code == 200


def test_the_wait_grows_has_an_end_and_needs_little_memory() -> None:
    clock = Clock()
    attempts = Attempts(clock)
    waits = []
    for _ in range(20):
        attempts.failed("name")
        waits.append(attempts.wait_s("name"))
    assert waits == sorted(waits)
    assert waits[FREE - 2] == 0.0 < waits[FREE - 1]
    assert waits[-1] == LONGEST_WAIT_S
    for i in range(20_000):
        attempts.failed(str(i))
    assert len(attempts._failures) <= 10_000


def test_a_wrong_name_and_a_wrong_password_are_told_alike(bench: Bench) -> None:
    nobody, wrong = Browser(bench.page), Browser(bench.page)
    texts = [
        nobody.post("/login", {"name": "nobody", "password": PASSWORD}).text,
        wrong.post("/login", {"name": "eva", "password": "wrong password"}).text,
    ]
    assert texts[0].replace("nobody", "eva") == texts[1]


@given(st.text())
def test_after_log_in_one_is_never_sent_to_another_site(path: str) -> None:
    local = local_path(path)
    assert local.startswith("/")
    assert not local.startswith("//")
    assert "\\" not in local
    assert local in ("/", path)


@given(st.text(max_size=40))
def test_a_host_header_is_no_trouble_whatever_it_is(text: str) -> None:
    assert host_name(text) == host_name(text).lower()


@pytest.mark.parametrize(
    "host", ["0.0.0.0", "192.168.0.7", "cell7", "::", "10.0.0.1", "example.org"]
)
def test_nothing_but_loopback_without_tls(tmp_path: Path, host: str) -> None:
    assert not is_loopback(host)
    with pytest.raises(InputError, match="without TLS"):
        PageSettings(tmp_path / "cell.toml", tmp_path, host=host)
    with pytest.raises(InputError, match="needs both"):
        PageSettings(tmp_path / "cell.toml", tmp_path, host=host, tls_cert=tmp_path)
    with pytest.raises(InputError, match="https://"):
        PageSettings(tmp_path / "cell.toml", tmp_path, public_url="http://cell7")


def test_no_route_answers_500_to_what_schemathesis_thinks_of(bench: Bench) -> None:
    """A few requests a route, by an engineer with the right token: as deep as anybody gets."""
    bench.shelve("first", 1, alarm=True)
    browser = bench.browser(Role.ENGINEER)
    schema = schemathesis.openapi.from_dict(json.loads(json.dumps(bench.page.app.openapi())))
    seen = set()
    for result in schema.get_all_operations():
        assert isinstance(result, Ok)
        operation = result.ok()
        if operation.path in ("/logout", "/lock"):  # they would end what the others need
            continue

        @given(operation.as_strategy())
        @settings(
            max_examples=3, deadline=None, database=None, suppress_health_check=list(HealthCheck)
        )
        def ask(case: Any) -> None:
            headers = {**dict(case.headers or {}), "x-csrf-token": browser.csrf}
            request = case.as_transport_kwargs(base_url="http://127.0.0.1:8420", headers=headers)
            request.pop("cookies", None)
            try:
                answer = browser.ask(
                    request["method"],
                    request["url"],
                    params=request.get("params"),
                    data=request.get("data") or None,
                    headers={k: str(v).encode() for k, v in request["headers"].items()},
                )
            except (ValueError, UnicodeError, TypeError):
                return  # what no client can send
            assert answer.status_code < 500, (request["method"], request["url"], answer.text)
            seen.add(answer.status_code)

        ask()
    assert {200, 404, 422} <= seen
    assert {user.name for user in bench.page.users.all()} == set(NAMES.values())
