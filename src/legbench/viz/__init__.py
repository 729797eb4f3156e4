"""From a recording to pictures; what the viewer, print and film share lies here."""
