"""Rendered pictures: a run as a video, an animation or stills of its MuJoCo model."""
