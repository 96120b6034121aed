"""What `chefbot param describe` prints of a parameter: type, description and bounds."""

from __future__ import annotations

from chefbot.msgs import rcl_interfaces as rcl
from chefbot.ros2.tools.param import describe_lines


def test_type_description_and_bounds_are_printed() -> None:
    bounds = (rcl.FloatingPointRange(0.0, 1.5, 0.5),)
    descriptor = rcl.ParameterDescriptor(
        "speed", rcl.DOUBLE, "maximum speed, m/s", floating_point_range=bounds
    )
    assert describe_lines(descriptor) == [
        "speed: double",
        "  maximum speed, m/s",
        "  from 0.0 to 1.5, step 0.5",
    ]


def test_a_read_only_parameter_is_marked() -> None:
    descriptor = rcl.ParameterDescriptor("radius", rcl.INTEGER_ARRAY, read_only=True)
    assert describe_lines(descriptor) == ["radius: integer array, read only"]
    assert describe_lines(rcl.ParameterDescriptor("none")) == ["none: not set"]
