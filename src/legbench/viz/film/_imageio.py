"""Reading and writing of video and image files: the only module that imports imageio."""

from legbench.errors import MissingExtraError

try:
    import av as _av  # noqa: F401
    import imageio.v3 as iio
    from imageio.plugins.pyav import PyAVPlugin
    from PIL import Image, ImageDraw, ImageFont
except ImportError as error:
    raise MissingExtraError(
        "imageio, PyAV or Pillow is not installed; rendering needs them: "
        "pip install 'legbench[render]'"
    ) from error

__all__ = ["Image", "ImageDraw", "ImageFont", "PyAVPlugin", "iio"]
