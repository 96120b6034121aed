"""OpenCV, which reads cameras and finds AprilTags; an extra, since only robots with such a camera need it."""

from __future__ import annotations

import importlib
import os
from typing import Any

from chefbot.errors import UserError

SELECT_TIMEOUT = "OPENCV_VIDEOIO_V4L_SELECT_TIMEOUT"
"""Environment variable of OpenCV: how long it waits for an image of a camera, in whole seconds."""


def load_opencv(needed_by: str) -> Any:
    """Return the module cv2. UserError with the command that installs it; needed_by: what in which file needs it."""
    os.environ.setdefault(SELECT_TIMEOUT, "1")  # read at the import
    try:
        cv2 = importlib.import_module("cv2")
    except ImportError as error:
        raise UserError(
            f"{needed_by} needs OpenCV, which cannot be imported ({error}); install it: pip install 'chefbot[camera]'"
        ) from error
    cv2.setNumThreads(1)  # the cores belong to the robot's other nodes
    return cv2
