"""What a cycle writes: its recording with all that is known of it, and the journal of its drive.

A part of the composition root.
"""

from __future__ import annotations

import importlib.metadata
import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path

from agent.acquisition import KEY as ACQUISITION
from agent.acquisition import Acquisition
from agent.cell.cell import Axis
from agent.cycle.job import job_columns
from agent.cycle.plan import CyclePlan
from agent.cycle.precedence import scheduling
from agent.cycle.recorder import columns
from agent.errors import InputError
from agent.given_back import KEY as GIVEN_BACK
from agent.record.atomic import publish
from agent.record.recording import Metadata
from agent.record.rows import Kind
from agent.record.streams.stream import StreamWriter
from agent.replayed import KEY as REPLAY
from agent.wire.drive import watched_configs
from agent.wire.replay import Replay
from agent.wire.request import CycleRequest
from drivers.cia402.config import ExpectedUnits
from drivers.cia402.scaling import Scaling
from drivers.clock import wall_time_utc
from drivers.ports import AxisEvidence, SyncAccount, WatchdogProof

PROBE_KINDS: Mapping[str, Kind] = {"gearbox_temperature_quality": "text"}


def software() -> str:
    """Return name and version of this product, as recordings carry it."""
    return f"stribeck {importlib.metadata.version('stribeck')}"


def _columns(axis: Axis, plan: CyclePlan) -> tuple[str, ...]:
    """Return the columns of this axis's recordings, as its runner writes them."""
    with_temperature = plan.limits.temperature_required
    if axis.job is not None:
        return job_columns(with_temperature=with_temperature)
    return columns(with_temperature=with_temperature, with_probe=plan.temperature_beside_drive)


def _torque_source(axis: Axis) -> dict[str, object]:
    """Return where the torque comes from and what scales it."""
    if axis.job is not None:
        return {"torque_source": "the controller's own, motor side, N m"}
    return {
        "rated_torque_nm": axis.drive.rated_torque_nm,
        **_known(profile=axis.drive.profile),
        "torque_source": "0x6077, per mille of rated torque",
    }


def _known(**values: object) -> dict[str, object]:
    """Return what is known of `values`, to go into a recording's metadata."""
    return {name: value for name, value in values.items() if value}


class Journal:
    """What a drive was set to before it was overwritten, kept until it has been given back.

    A run that is killed leaves this file; the next one on the axis restores the drive from it.
    """

    def __init__(self, path: Path) -> None:
        self._path = path

    def write(self, found: Mapping[str, int]) -> None:
        """Keep what was found: raw numbers by their objects."""
        self._path.parent.mkdir(parents=True, exist_ok=True)
        publish({self._path: json.dumps(dict(found), indent=1).encode()}, overwrite=True)

    def read(self) -> dict[str, int]:
        """Return what a killed run has found; nothing where none has left it.

        Raises
        ------
        agent.errors.InputError
            The file cannot be read: nobody knows then how the drive was.
        """
        try:
            found = json.loads(self._path.read_text(encoding="utf-8"))
        except FileNotFoundError:
            return {}
        except (OSError, ValueError) as error:
            raise InputError(
                f"{self._path} should say how a killed run had found the drive, and cannot be "
                f"read: {error}.",
                "Compare the drive with its parameter file, then remove this file.",
            ) from error
        return {str(key): int(value) for key, value in found.items()}

    def clear(self) -> None:
        """Forget it: the drive has been given back."""
        self._path.unlink(missing_ok=True)


class LastUnits:
    """What a drive's units depended on when its axis was last driven, kept beside the recordings.

    With it stand the cell's own numbers for these units: whoever has changed them since has looked
    at both, and then the drive may count otherwise.
    """

    def __init__(self, path: Path, scaling: Scaling) -> None:
        self._path = path
        self._of_cell = {
            "encoder_counts_per_motor_rev": scaling.encoder_counts_per_motor_rev,
            "velocity_unit": scaling.velocity_unit,
            "direction": scaling.direction,
        }

    def read(self) -> ExpectedUnits | None:
        """Return what is to be expected; None where nothing is known, or the cell is another.

        Raises
        ------
        agent.errors.InputError
            The file cannot be read.
        """
        try:
            kept = json.loads(self._path.read_text(encoding="utf-8"))
            of_cell, units = kept["cell"], {k: int(v) for k, v in kept["units"].items()}
        except FileNotFoundError:
            return None
        except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
            raise InputError(
                f"{self._path} should say in which units the drive counted when its axis was last "
                f"driven, and cannot be read: {error}.",
                "Compare the drive with its parameter file, then remove this file.",
            ) from error
        return ExpectedUnits(units, str(self._path)) if of_cell == self._of_cell else None

    def write(self, units: Mapping[str, int]) -> None:
        """Keep what the drive says now, before it is driven."""
        kept = {"cell": self._of_cell, "units": dict(units)}
        publish({self._path: json.dumps(kept, indent=1).encode()}, overwrite=True)


class RunWriter:
    """The runner's writer: a stream that becomes one recording with its metadata."""

    def __init__(
        self,
        request: CycleRequest,
        plan: CyclePlan,
        evidence: AxisEvidence,
        temperature_source: Mapping[str, str | int | float],
        *,
        in_real_time: bool,
        replay: Replay | None = None,
        left_behind: Mapping[str, int] | None = None,
    ) -> None:
        self._replay = replay
        cell, axis = request.cell, request.axis
        started_at = wall_time_utc()
        stamp = started_at.replace("-", "").replace(":", "").replace(".", "")
        metadata = Metadata(
            robot=cell.robot,
            axis=axis.number,
            gear_ratio=axis.gear_ratio,
            started_at=started_at,
            trajectory={
                "name": plan.trajectory.name,
                "parameters": plan.trajectory.to_json()["parameters"],
            },
            payload_kg=axis.payload_kg,
            drive={
                **evidence.identity,
                **(_torque_source(axis) if replay is None else replay.torque_source),
                "settings": dict(evidence.settings),
                **_known(
                    units=dict(evidence.units),
                    mode=evidence.mode,
                    mode_reason=evidence.mode_reason,
                ),
            },
            software=software(),
            extra=_known(
                scheduling=scheduling() if in_real_time and replay is None else "",
                watched=[config.name for config in watched_configs(cell, axis)]
                if axis.drive_ is not None
                else [],
                gearbox_serial=axis.gearbox_serial,
                robot_model=cell.robot_model,
                temperature_source=dict(temperature_source),
                **{GIVEN_BACK: dict(left_behind or {})},
            ),
        )
        self._stream = StreamWriter(
            request.folder,
            f"{cell.robot}-axis{axis.number}-{stamp}-{plan.trajectory.name}"
            + ("-reversed" if request.reverse else ""),
            metadata,
            _columns(axis, plan),
            kinds=PROBE_KINDS if plan.temperature_beside_drive else None,
            background=in_real_time,
        )
        self.append = self._stream.append
        self._proof: WatchdogProof | None = None

    def wait_for_disk(self) -> None:
        """Let the disk take its time from now on (`agent.record.streams.stream`)."""
        self._stream.wait_for_disk()

    def note(self, proof: WatchdogProof) -> None:
        """Keep what the watchdog was seen to do."""
        self._proof = proof

    def finish(self, *, account: SyncAccount | None, stopped_because: str) -> Path | None:
        """Finish the stream; where nothing was recorded, leave no file."""
        if self._stream.samples == 0:
            self._stream.abandon()
            return None
        changes: dict[str, object] = {}
        if stopped_because:
            changes["stopped_because"] = stopped_because
        if self._proof is not None:
            changes["watchdog"] = {
                "proven": self._proof.reacted,
                **{k: v for k, v in asdict(self._proof).items() if k != "reacted"},
            }
        if self._replay is not None:
            changes[REPLAY] = self._replay.played().to_json()
        if account is None:
            return self._stream.finish(None, changes)
        changes[ACQUISITION] = Acquisition(**asdict(account)).to_json()
        return self._stream.finish(account.lost, changes)
