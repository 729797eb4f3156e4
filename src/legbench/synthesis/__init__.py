"""From requirements to a leg that can be built: search, what its bounds cost, its tolerances."""
