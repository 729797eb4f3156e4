"""The experiments that the paper shows one by one, found in a campaign by their settings.

Their recordings are those that the campaign kept. Where it kept none they are run afresh: an
experiment is data, its hash names it, and on one machine it gives the same rows again.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from legbench.campaign.again import experiment_of
from legbench.campaign.curves import (
    CONTROLLER,
    DZ2,
    SETUP,
    Z2,
    rows_of,
    same_set_point,
    sound_runs,
)
from legbench.campaign.records import RECORDS
from legbench.errors import CampaignError, RecordingError
from legbench.experiment.run import run
from legbench.experiment.writing import flat
from legbench.loop import Progress
from legbench.paper import Published
from legbench.recording.reader import Recording, load
from legbench.report.sources import CampaignSource

READINGS: Final = {
    "step": ("step_to", "step_to_caption"),
    "bang-bang": ("bang_bang_middle",),
    "jump": ("jump_middle",),
}
"""Named experiment -> keys of the numbers that give its settings, the first choice first."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Named:
    """Experiment that the paper shows, as a campaign has it."""

    name: str
    """Name: `step`, `bang-bang` or `jump`."""
    settings: str
    """Its set points in words."""
    experiment: str | None
    """Hash of the experiment; none: the campaign has no such run that is sound."""
    recording: Recording | None
    origin: str
    """Origin of the recording, or the reason why there is none, in words."""

    @property
    def entries(self) -> tuple[str, ...]:
        """Every setting of the experiment as `dotted.key = value`, from its recording."""
        told = {} if self.recording is None else self.recording.manifest.get("experiment", {})
        return tuple(f"{key} = {value}" for key, value in sorted(flat(told).items()))


def named_experiments(
    source: CampaignSource, numbers: Mapping[str, Published], progress: Progress | None = None
) -> tuple[Named, ...]:
    """Find the step and bang-bang of Fig. 4 and the jump of Figs. 6 and 7, with their recordings.

    Args:
        source: the campaign.
        numbers: the paper's numbers by key, which give the settings.
        progress: told how far a run is that is done afresh.
    """
    rows = rows_of(sound_runs(source.table), "run")
    return tuple(
        _named(source, name, _chosen(rows, [numbers[key] for key in keys]), progress)
        for name, keys in READINGS.items()
    )


def _chosen(rows: Sequence[Mapping[str, Any]], readings: Sequence[Published]) -> Any:
    """First trial with the settings of the first reading that is there; a jump, of any."""
    for number in readings:
        here = [r for r in rows if r[SETUP] == number.setup and r[CONTROLLER] == number.controller]
        exact = [
            r
            for r in here
            if same_set_point(r[Z2], number.z2) and same_set_point(r[DZ2], number.dz2)
        ]
        if found := exact or (here if number.setup == "jump" else []):
            return min(found, key=lambda row: row["trial"])
    return None


def _named(
    source: CampaignSource, name: str, row: Mapping[str, Any] | None, progress: Progress | None
) -> Named:
    if row is None:
        return Named(
            name=name,
            settings="",
            experiment=None,
            recording=None,
            origin="the campaign has no sound run with its settings",
        )
    recording, origin = _recorded(source, row, progress)
    return Named(
        name=name,
        settings=f"{row['design.name']}, z2 = {row[Z2]:g} rad, dz2 = {row[DZ2]:g} rad",
        experiment=row["experiment"],
        recording=recording,
        origin=origin,
    )


def _recorded(
    source: CampaignSource, row: Mapping[str, Any], progress: Progress | None
) -> tuple[Recording | None, str]:
    """Recording of a run and its origin; none with the reason."""
    kept = source.folder / RECORDS / row["experiment"]
    if kept.is_dir():
        try:
            return load(kept), "recording that the campaign kept"
        except RecordingError as error:
            return None, f"its recording cannot be read: {error}"
    try:
        experiment = experiment_of(source.folder, row)
    except CampaignError as error:
        return None, str(error)
    if experiment.plant.kind == "can":
        return None, "the bench kept no recording of it, and a report moves no drives"
    return run(experiment, progress=progress), "run afresh, as the campaign kept no recordings"
