"""Pictures of recordings: what the viewer, print figures and films share."""
