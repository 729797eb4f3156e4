"""The master's parts of a bus; `legbench.drives.link` joins them."""
