"""What no law describes from samples, left out of one table as it was of another."""

from __future__ import annotations

from agent.explain.rows.beginnings import without_beginnings
from agent.explain.rows.images import without_images
from agent.explain.rows.table import Table


def left_out_as_in(table: Table, like: Table) -> Table:
    """Return a table without waves' images and arms' beginnings, as another one was left."""
    table = without_images(table, like.imaged_orders)
    return without_beginnings(table, like.arm_forgets)
