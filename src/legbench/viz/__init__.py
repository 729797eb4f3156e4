"""From a recording to pictures: rerun, print figures, rendered video. Reads recordings only."""
