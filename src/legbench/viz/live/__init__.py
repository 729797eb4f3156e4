"""The rerun viewer: a run as streams and entities, live or from its recording."""
