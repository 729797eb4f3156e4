"""What foot and controller are doing, as coloured lanes over time."""

from typing import final

import numpy as np
from numpy.typing import NDArray

from legbench.signals import Phase
from legbench.viz import style
from legbench.viz.facts import Facts
from legbench.viz.live._rerun import rr, rrb
from legbench.viz.trace import Trace

FOOT, CONTROLLER = "/states/foot", "/states/controller"
FOOT_NAMES = ("flight", "stance")
PHASE_NAMES = tuple(phase.name.lower() for phase in Phase)


@final
class States:
    """Publishes the changes of foot and controller states."""

    def __init__(self, stream: rr.RecordingStream, facts: Facts) -> None:
        self._stream = stream
        self._last: dict[str, int] = {}
        self._foot = facts.jumps
        if self._foot:
            self._configure(FOOT, FOOT_NAMES, [style.FLIGHT, style.STANCE])
        self._configure(CONTROLLER, PHASE_NAMES, [style.PHASES[phase] for phase in Phase])

    def push(self, trace: Trace) -> None:
        """Add the changes within these rows."""
        if self._foot:
            self._send(FOOT, trace, trace.stance.astype(np.int64), FOOT_NAMES)
        self._send(CONTROLLER, trace, trace.rows["phase"], PHASE_NAMES)

    def _configure(self, path: str, names: tuple[str, ...], colours: list[style.Rgb]) -> None:
        packed = [style.packed(colour) for colour in colours]
        configuration = rr.StateConfiguration(values=list(names), colors=packed)
        self._stream.log(path, configuration, static=True)

    def _send(
        self, path: str, trace: Trace, codes: NDArray[np.int64], names: tuple[str, ...]
    ) -> None:
        before = self._last.get(path, -1)
        changes = np.flatnonzero(np.diff(codes, prepend=before))
        if len(changes) == 0:
            return
        self._last[path] = int(codes[-1])
        index = [rr.TimeColumn("t", duration=trace.time[changes])]
        names_here = [names[code] for code in codes[changes]]
        self._stream.send_columns(path, index, rr.StateChange.columns(state=names_here))


def states_view() -> rrb.StateTimelineView:
    """The lanes of foot and controller."""
    return rrb.StateTimelineView(origin="/states", name="foot and controller")
