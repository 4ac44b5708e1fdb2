"""Network management (CiA 301): the states of a node, and what a reset of it brings back."""

from __future__ import annotations

import enum

COMMUNICATION_OBJECTS = (0x1000, 0x1FFF)
ALL_OBJECTS = (0x1000, 0x9FFF)
"""First and last index that NMT reset communication, and reset node, bring back."""


class Nmt(enum.IntEnum):
    """NMT states as the heartbeat carries them."""

    BOOT_UP = 0x00
    STOPPED = 0x04
    OPERATIONAL = 0x05
    PRE_OPERATIONAL = 0x7F
