"""The exception for robot files."""

from __future__ import annotations

from chefbot.config import ConfigError


class RobotFileError(ConfigError):
    """A robot that is unknown, or whose file describes a robot that cannot be built.

    The message names file, key and reason.
    """
