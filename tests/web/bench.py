"""A page in this process: a cell in a folder, users of every role, a cycle that is no cycle."""

from __future__ import annotations

import asyncio
import json
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx
import numpy as np

from agent.cli.devices.fake_cell import fake_cell_text
from agent.record.recording import Metadata, Recording
from agent.record.verdict_file import Verdict, estimate_path, write_verdict
from agent.record.writing import write
from agent.web.application import create_page
from agent.web.attended import Launch
from agent.web.looking import Looking
from agent.web.page import Page
from agent.web.passwords import Argon2
from agent.web.roles import Role
from agent.web.settings import PageSettings
from fakes.specification import FakeSpecification

PASSWORD = "four plain words here"
NAMES = {Role.VIEWER: "vera", Role.TECHNICIAN: "toni", Role.ENGINEER: "eva"}

CHILD = Path(__file__).with_name("child.py")
"""Stands where `stribeck serve-run` stands: says how far it is, ends when it is asked to stop."""


class Clock:
    """Time that a test moves."""

    def __init__(self) -> None:
        self.time_s = 1000.0

    def now(self) -> float:
        return self.time_s

    def sleep_until(self, deadline_s: float) -> None:
        self.time_s = max(self.time_s, deadline_s)

    def settle(self) -> None:
        """Nothing lives on this clock."""


@dataclass
class Browser:
    """Somebody's browser: cookies, and the token that the page's own forms carry."""

    page: Page
    csrf: str = ""
    cookies: httpx.Cookies = field(default_factory=httpx.Cookies)
    headers: dict[str, str] = field(default_factory=dict)

    def get(self, path: str, **headers: str) -> httpx.Response:
        return self.ask("GET", path, headers=headers)

    def post(self, path: str, data: Mapping[str, str] | None = None) -> httpx.Response:
        """Send a form as the page's own forms are sent."""
        return self.ask("POST", path, data={"csrf": self.csrf, **(data or {})})

    def ask(self, method: str, path: str, **request: Any) -> httpx.Response:
        async def once() -> httpx.Response:
            transport = httpx.ASGITransport(self.page.app, raise_app_exceptions=False)
            async with httpx.AsyncClient(
                transport=transport, base_url="http://127.0.0.1:8420", cookies=self.cookies
            ) as client:
                answer = await client.request(method, path, **request)
                self.cookies = client.cookies
                return answer

        request["headers"] = {**self.headers, **request.get("headers", {})}
        return asyncio.run(once())


@dataclass
class Bench:
    """The page and those who use it."""

    page: Page
    clock: Clock
    recordings: Path

    def browser(self, role: Role | None) -> Browser:
        """Return the browser of somebody who is logged in, or of nobody."""
        browser = Browser(self.page)
        if role is not None:
            token, session = self.page.sessions.begin(NAMES[role], role)
            browser.cookies.set("stribeck_session", token)
            browser.csrf = session.csrf
        return browser

    def shelve(self, name: str, day: int, *, friction: float = 1.0, **more: Any) -> str:
        """Put a finished cycle on the shelf; friction is a factor, `alarm` its verdict."""
        metadata = Metadata(
            robot="simulated-joint",
            axis=1,
            gear_ratio=224.0,
            started_at=f"2026-03-{day:02d}T02:00:00.000Z",
            trajectory={"name": "stair-paired"},
            extra=more.get("extra", {}),
        )
        time_s = np.arange(200) / 100.0
        columns: dict[str, Any] = {
            "time_s": time_s,
            "velocity_rad_s": 0.0 * time_s,
            "torque_nm": 0.0 * time_s,
        }
        path = write(Recording(columns, metadata, "bench"), self.recordings / f"{name}.parquet")
        document = estimate_document(friction, **more)
        estimate_path(path).write_text(json.dumps(document), encoding="utf-8")
        path.with_suffix(".report.html").write_text("<!doctype html><p>report", encoding="utf-8")
        if "alarm" in more:
            verdict = Verdict(
                path.name,
                "0" * 64,
                "simulated-joint",
                1,
                metadata.started_at,
                "",
                True,
                bool(more["alarm"]),
                "H1",
                "Friction at low speed has risen by 12 %.",
            )
            write_verdict(path, verdict)
        return name


def estimate_document(friction: float, **more: Any) -> dict[str, Any]:
    """Return an estimate as `stribeck run` writes it, as far as the page reads it."""
    speeds = [2.0, 5.0, 12.0, 30.0, 80.0]
    torque = [friction * (0.6 + 0.01 * v) for v in speeds]
    plain = {
        "coulomb_nm": {"value": 0.6 * friction, "ci95": [0.59 * friction, 0.61 * friction]},
        "viscous_nm_s_per_rad": {"value": 0.01, "ci95": [0.0099, 0.0101]},
    }
    decidable = more.get("decidable", True)
    return {
        "schema": "stribeck.estimate/1",
        "decidable": decidable,
        "reasons": [] if decidable else ["one speed only <b>"],
        "sentence": "Friction is 0.6 N m.",
        "next_steps": [] if decidable else ["Drive more speeds."],
        "advice": [] if decidable else ["steady", "again"],
        "friction_curve": {
            "velocity_rad_s": speeds,
            "friction_nm": torque,
            "ci95_nm": [[f - 0.002, f + 0.002] for f in torque],
        },
        "friction_models": [
            {"model": "coulomb-viscous", "selected": True, "rmse_nm": 0.001, "parameters": plain}
        ],
        "rigid_body": {"rmse_nm": 0.04, "fit_percent": 98.0, "parameters": {}},
        "quality": {
            "samples": 200,
            "samples_lost": 0,
            "sample_rate_hz": 100.0,
            "temperature_degc": more.get("temperature_degc", [25.0, 26.0]),
        },
    }


def make(folder: Path, **settings: Any) -> Bench:
    """Make a page with a user of each role."""
    cell = folder / "cell.toml"
    cell.write_text(
        fake_cell_text(
            FakeSpecification(), interface="udp_multicast", channel="239.74.163.9", short=True
        )
    )
    recordings = folder / "recordings"
    recordings.mkdir()
    clock = Clock()
    state = folder / "state"
    page = create_page(
        PageSettings(cell, state, port=8420, **settings),
        clock=clock,
        hasher=Argon2(time_cost=1, memory_kib=8),
        launch=Launch(state, cell, (sys.executable, str(CHILD))),
        looking=Looking(state, cell, clock, ()),
    )
    for role, name in NAMES.items():
        page.users.accept(page.users.invite(name, role), name, PASSWORD)
    return Bench(page, clock, recordings)
