"""Reading and writing of video and image files: the only module that imports PyAV and Pillow."""

from legbench.errors import MissingExtraError

try:
    import av
    from PIL import Image, ImageDraw, ImageFont
except ImportError as error:
    raise MissingExtraError(
        "PyAV or Pillow is not installed; rendering needs them: pip install 'legbench[render]'"
    ) from error

__all__ = ["Image", "ImageDraw", "ImageFont", "av"]
