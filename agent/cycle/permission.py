"""The cell's release around a cycle: asked for before, watched at every tick, given back after.

Nothing is opened towards the drive before the permit is there; a permit that is withdrawn, or no
longer heard, is a reason to stop like any other, and takes the runner's own way to rest.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator

from agent.errors import RefusedError
from drivers.clock import Clock
from drivers.errors import DriverError
from drivers.ports import Release

StopRequested = Callable[[], str | None]
LOOK_S = 0.02


@contextlib.contextmanager
def permitted(
    release: Release | None, clock: Clock, stop_requested: StopRequested, *, wait_s: float
) -> Iterator[StopRequested]:
    """Hold the cell's permit for as long as the block runs.

    Parameters
    ----------
    release : Release or None
        None where the cell has none: then a person guarantees what a release would.
    clock : Clock
        Paces the waiting.
    stop_requested : callable
        Who else may ask to stop.
    wait_s : float
        How long to wait for the permit.

    Yields
    ------
    callable
        To be asked at every control tick: the reason to stop, or None.

    Raises
    ------
    agent.errors.RefusedError
        No permit within `wait_s`, or somebody has asked to stop meanwhile.
    drivers.errors.DriverError
        Nobody can be asked for it.
    """
    if release is None:
        yield stop_requested
        return
    release.open()
    failure: BaseException | None = None
    try:
        release.request()
        _await(release, clock, stop_requested, wait_s)
        yield lambda: stop_requested() or _withdrawn(release)
    except BaseException as error:
        failure = error
        raise
    finally:
        try:
            release.done(well=failure is None)
        except DriverError as error:
            if failure is None:
                error.add_note("The cycle itself ended well, and its recording is kept.")
                raise
            failure.add_note(f"The cell's release could not be told: {error.what}")
        finally:
            release.close()


def _await(release: Release, clock: Clock, stop_requested: StopRequested, wait_s: float) -> None:
    deadline_s = clock.now() + wait_s
    while not (permit := release.permit()).granted:
        reason = stop_requested()
        if reason is None and clock.now() >= deadline_s:
            reason = f"{permit.reason}; waited {wait_s:.1f} s"
        if reason is not None:
            raise RefusedError(f"Refused, nothing has moved: {reason}.", (reason,))
        clock.sleep_until(clock.now() + LOOK_S)


def _withdrawn(release: Release) -> str | None:
    permit = release.permit()
    return None if permit.granted else f"the permit is gone: {permit.reason}"
