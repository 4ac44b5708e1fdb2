"""A cycle in a Python from which everything is taken that macOS's lacks (`tests/as_macos`).

All that drives devices runs there in ``python -m tests.benchmarks.elsewhere``.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

from tests.benchmarks.elsewhere import PLACE
from tests.conftest import REPOSITORY

CHILD = """
import json, os, socket, sys
from pathlib import Path
from agent.cli.devices.fake_cell import fake_cell_text
from agent.record.reading import read
from fakes.specification import FakeSpecification
from tests.system.processes import called
from tests.system.rig import rig

def brief(cell):
    cell["recording"]["sample_rate_hz"] = 100.0
    cell["axis"][0]["stair"] |= {"duration_s": 4.0, "speeds": 2}

folder = Path(sys.argv[1])
with rig(folder / "out", edit=brief) as made:
    account = read(made.run().recording).metadata.extra["acquisition"]
cell = folder / "cell.toml"
cell.write_text(fake_cell_text(FakeSpecification(), interface="socketcan", channel="can0"))
refused = called("run", cell, "--axis", "1")
print(json.dumps({
    "platform": sys.platform, "lacks": not hasattr(socket, "AF_CAN") and not hasattr(os, "eventfd"),
    "received": account["received"], "lost": account["lost"],
    "code": refused.returncode, "said": " ".join(refused.stderr.split()),
}))
"""


def test_a_cycle_runs_and_what_is_linuxs_own_says_so(tmp_path: Path) -> None:
    path = os.pathsep.join([str(PLACE), str(REPOSITORY)])
    done = subprocess.run(
        [sys.executable, "-c", CHILD, str(tmp_path)],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": path},
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["platform"] == "darwin"
    assert found["lacks"]
    assert found["received"] > 300
    assert found["lost"] == 0
    assert found["code"] == 4
    assert "SocketCAN is Linux's own; this is darwin." in found["said"]
