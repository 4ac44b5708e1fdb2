"""A page for each test."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.web.bench import Bench, make


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    made = make(tmp_path)
    try:
        yield made
    finally:
        run = made.page.attendant.run
        if run is not None and run.process.poll() is None:
            run.process.kill()
            run.process.wait()
        if run is not None:
            run.let_go()
        made.page.store.close()
