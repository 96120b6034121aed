"""OpenCV, which reads cameras and finds AprilTags; an extra, since only robots with such a camera need it."""

from __future__ import annotations

import importlib
import os
from typing import Any

from chefbot.errors import UserError

SETTINGS = {
    "OPENCV_VIDEOIO_V4L_SELECT_TIMEOUT": "1",  # time to wait for an image of a camera, in whole seconds
    "OPENCV_LOG_LEVEL": "ERROR",
    "OPENCV_FFMPEG_LOGLEVEL": "-8",  # what is wrong with a video is reported here
}
"""Environment variables that OpenCV reads when it is imported."""


def load_opencv(needed_by: str) -> Any:
    """Return the module cv2. UserError with the command that installs it; needed_by: what in which file needs it."""
    for name, value in SETTINGS.items():
        os.environ.setdefault(name, value)
    try:
        cv2 = importlib.import_module("cv2")
    except ImportError as error:
        raise UserError(
            f"{needed_by} needs OpenCV, which cannot be imported ({error}); install it: pip install 'chefbot[camera]'"
        ) from error
    cv2.setNumThreads(1)  # the cores belong to the robot's other nodes
    return cv2
