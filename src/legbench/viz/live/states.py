"""States of foot and controller, as coloured lanes over time."""

from collections.abc import Mapping
from typing import final

import numpy as np
from numpy.typing import NDArray

from legbench.viz import style
from legbench.viz.facts import Facts
from legbench.viz.live._rerun import rr, rrb
from legbench.viz.trace import TracedRows

FOOT, CONTROLLER = "/states/foot", "/states/controller"
FOOT_NAMES = {0: "flight", 1: "stance"}


@final
class States:
    """Publishes the changes of foot and controller states."""

    def __init__(self, stream: rr.RecordingStream, facts: Facts) -> None:
        self._stream = stream
        self._last: dict[str, int] = {}
        self._foot = facts.run.jumps
        if self._foot:
            self._configure(FOOT, FOOT_NAMES, [style.FLIGHT, style.STANCE])
        phases = facts.run.phases
        self._names = {phase.code: phase.name for phase in phases}
        self._configure(CONTROLLER, self._names, list(style.phase_colours(phases).values()))

    def push(self, trace: TracedRows) -> None:
        """Add the changes within these rows."""
        if self._foot:
            self._send(FOOT, trace, trace.stance.astype(np.int64), FOOT_NAMES)
        self._send(CONTROLLER, trace, trace.rows["phase"], self._names)

    def _configure(self, path: str, names: Mapping[int, str], colours: list[style.Rgb]) -> None:
        # The colours are an array, since rerun takes a list of four numbers for one colour.
        packed = np.array([style.packed(colour) for colour in colours], dtype=np.uint32)
        configuration = rr.StateConfiguration(values=list(names.values()), colors=packed)
        self._stream.log(path, configuration, static=True)

    def _send(
        self, path: str, trace: TracedRows, codes: NDArray[np.int64], names: Mapping[int, str]
    ) -> None:
        before = self._last.get(path, -1)
        changes = np.flatnonzero(np.diff(codes, prepend=before))
        if len(changes) == 0:
            return
        self._last[path] = int(codes[-1])
        index = [rr.TimeColumn("t", duration=trace.time[changes])]
        names_here = [names.get(code, f"phase {code}") for code in codes[changes].tolist()]
        self._stream.send_columns(path, index, rr.StateChange.columns(state=names_here))


def states_view() -> rrb.StateTimelineView:
    """The lanes of foot and controller."""
    return rrb.StateTimelineView(origin="/states", name="foot and controller")
