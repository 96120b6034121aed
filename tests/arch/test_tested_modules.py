"""A red end-to-end test does not say where the fault is: nearly every module has a test that imports it."""

from __future__ import annotations

from tests.arch.figures import modules_without_test

RUN_BY_ROS = "chefbot.design.export.ros2.packages."
"""Launch files, which only ROS 2 imports."""
MOST = 5


def test_nearly_every_module_is_imported_by_a_test() -> None:
    missing = [name for name in modules_without_test() if not name.startswith(RUN_BY_ROS)]
    assert len(missing) <= MOST, missing
