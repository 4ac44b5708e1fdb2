"""Waves of the motor's angle are kept for the next search, and never for other recordings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from agent.explain.rows.scene import Scene
from agent.explain.rows.table import BASE, tabulate
from tests.science.explain_joint import TWIN, Conditions, record, stair


def test_a_wave_is_that_of_the_scenes_own_recordings_however_it_was_made() -> None:
    run = record(stair((8.0, 16.0)), lambda p, _: np.zeros(p.position_rad.shape), Conditions(), 1)
    table = tabulate(TWIN, [run])
    scene = Scene(table, np.zeros(len(BASE)), np.zeros(table.used.shape[0]))
    angle = table.full["position_rad"]
    assert scene.wave(2.0) is replace(scene, late_s=0.01).wave(2.0)
    away = replace(table, full={**table.full, "position_rad": angle + 0.3})
    for seen, position in ((scene, angle), (replace(scene, table=away), angle + 0.3)):
        for order in (2.0, *np.linspace(0.1, 9.0, 30), 2.0):
            expected = np.stack((np.cos(order * position), np.sin(order * position)), axis=-1)
            np.testing.assert_array_equal(seen.wave(float(order)), expected)
    assert len(scene.waves) < 20
