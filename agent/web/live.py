"""The running cycle to everybody who watches: one look, one text, any number of viewers."""

from __future__ import annotations

import asyncio
import json
import math
from collections.abc import AsyncIterator
from typing import Any

from agent.web.attended import Attendant, AttendedRun
from agent.web.tail import POINT_PERIOD_S, Point
from trajectories import lasting

LOOK_PERIOD_S = 0.5 * POINT_PERIOD_S
"""As often as points come, two would now and then share a look, and a viewer's picture stutter."""
IDLE_PERIOD_S = 0.25
LONGEST_CATCH_UP_S = 0.5
"""Looks that a loaded machine has delayed are made up for, up to this; older ones are not."""
BEAT_EVERY = 40
"""Looks without news before a sign of life is sent: one a second."""
MOST_VIEWERS = 200


class Live:
    """Looks at the attended cycle forty times a second and wakes its viewers when there is news.

    Parameters
    ----------
    attendant : Attendant
        Whose cycle.
    """

    def __init__(self, attendant: Attendant) -> None:
        self._attendant = attendant
        self._news = asyncio.Event()
        self._texts: list[str] = []
        self._run = ""
        self._plan = ("", "")  # of which run, and the event that everybody gets first
        self.viewers = 0

    async def keep_looking(self) -> None:
        """Look until cancelled."""
        looks, told = 0, ""
        due_s = asyncio.get_running_loop().time()
        while True:
            active = self._attendant.active
            self._attendant.look()
            looks += 1
            run = self._attendant.run
            if run is not None:
                fresh = self._take(run)
                state = json.dumps(state_of(run))
                if fresh or state != told or looks % BEAT_EVERY == 0:
                    told = state
                    self._wake()
            due_s += LOOK_PERIOD_S if active is not None else IDLE_PERIOD_S
            now_s = asyncio.get_running_loop().time()
            if due_s < now_s - LONGEST_CATCH_UP_S:
                due_s = now_s
            await asyncio.sleep(max(0.0, due_s - now_s))

    async def events(self, run: AttendedRun, seen: int) -> AsyncIterator[str]:
        """Yield server-sent events of one cycle: its plan, points as they come, its end.

        Parameters
        ----------
        run : AttendedRun
        seen : int
            How many points the viewer has already.
        """
        self.viewers += 1
        try:
            if self._plan[0] != run.identity:  # once for all viewers, as the points are
                self._plan = (run.identity, json.dumps(plan_of(run)))
            yield _event("plan", run, self._plan[1], seen)
            while True:
                news, texts = self._news, self._texts if self._run == run.identity else []
                fresh = f"[{','.join(texts[seen:])}]"
                seen = max(seen, len(texts))
                state = json.dumps(state_of(run))
                yield f"event: points\nid: {run.identity}.{seen}\ndata: [{state},{fresh}]\n\n"
                if run.ended is not None:
                    yield _event("end", run, json.dumps({"code": run.ended.code}), seen)
                    return
                await news.wait()
        finally:
            self.viewers -= 1

    def _take(self, run: AttendedRun) -> bool:
        """Write the new points as text, once for all viewers."""
        if self._run != run.identity:
            self._run, self._texts = run.identity, []
        fresh = run.points[len(self._texts) :]
        self._texts += [_text(point, run.gear_ratio) for point in fresh]
        return bool(fresh)

    def _wake(self) -> None:
        news, self._news = self._news, asyncio.Event()
        news.set()


def state_of(run: AttendedRun) -> dict[str, Any]:
    """Return where a cycle is."""
    return {
        "stage": run.stage,
        "stopping": run.stopping,
        "step": run.step,
        "steps": run.steps,
        "left_s": round(run.left_s, 1),
        "left": lasting(math.ceil(run.left_s)),
        "stair_began_s": run.stair_began_s,
        "ended": run.ended is not None,
    }


def plan_of(run: AttendedRun) -> dict[str, Any]:
    """Return the stair that is driven, twenty points a second from its beginning; rad/s."""
    samples = math.ceil(run.trajectory.duration_s / POINT_PERIOD_S) + 1
    times = [POINT_PERIOD_S * i for i in range(samples)]
    velocity = [round(float(v), 2) for v in run.trajectory.sample(times).velocity_rad_s]
    return {
        "run": run.identity,
        "axis": run.asked.axis,
        "period_s": POINT_PERIOD_S,
        "velocity_rad_s": velocity,
    }


def _event(kind: str, run: AttendedRun, data: str, seen: int) -> str:
    return f"event: {kind}\nid: {run.identity}.{seen}\ndata: {data}\n\n"


def _text(point: Point, gear_ratio: float) -> str:
    """Return a point as JSON: s, rad/s, rad/s, N m, degrees of the arm, degC; null is unknown."""
    arm_deg = math.degrees(point.position_rad / gear_ratio)
    values = (*point[:4], arm_deg, point.gearbox_temperature_degc)
    return f"[{','.join(f'{v:.4g}' if math.isfinite(v) else 'null' for v in values[1:])}]".replace(
        "[", f"[{point.time_s:.3f},", 1
    )
