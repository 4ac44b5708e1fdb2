"""The real CAN bus of the tests in this folder: found, and where it must be booted, once."""

from __future__ import annotations

import os
from collections.abc import Iterator

import pytest

from tests.bus.vcan import Vcan, VcanUnavailableError, open_vcan


@pytest.fixture(scope="module")
def vcan() -> Iterator[Vcan]:
    """Yield a real CAN bus; where there is none, skip, or fail with STRIBECK_REQUIRE_BUS=1."""
    try:
        with open_vcan() as bus:
            yield bus
    except VcanUnavailableError as error:
        if os.environ.get("STRIBECK_REQUIRE_BUS") == "1":
            pytest.fail(str(error))
        pytest.skip(str(error))
