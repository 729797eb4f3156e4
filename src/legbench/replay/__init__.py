"""Replay of what was recorded: through its controller, through a plant, and out of a bus log.

- `recorded` reads leg and controller of a run, with edits;
- `controller` takes recorded observations through a control law, and compares the commands;
- `resimulation` takes recorded commands or measured motors through a plant;
- `comparison` says where and by how much two such sets of signals differ;
- `log` reads a log of raw frames as a `Recording`.

Names are imported from these modules.
"""
