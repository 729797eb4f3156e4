"""Cells of a notebook: a run, its table, its figure, and its rows for other libraries.

Editors that know `# %%` run it cell by cell and show what the last line of each returns.
"""

# %% A swing in the air, built up in four seconds, kept in memory
import legbench

run = legbench.run(
    legbench.Experiment(
        design=legbench.load_design("models/prototype.toml"),
        setup=legbench.Setup(kind=legbench.SetupKind.HFTS),
        controller=legbench.BangBangConfig(),
        duration=4.0,
    )
)
print(run)

# %% Its figure, which the notebook shows
legbench.phase_figure(run)

# %% Its rows: an Arrow table here, run.to_pandas() where pandas is installed
table = run.to_arrow()
table.select(["t_ns", "joint_pos_1", "joint_pos_2"]).slice(0, 5)
