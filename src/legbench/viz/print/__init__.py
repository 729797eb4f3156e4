"""Print figures: planes, overlays, modes, hops, designs and timing, drawn with matplotlib."""
