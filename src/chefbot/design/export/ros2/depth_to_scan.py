"""`depth_to_scan.yaml` for depthimage_to_laserscan, which replaces chefbot's scan node.

Names: https://index.ros.org/p/depthimage_to_laserscan/.
"""

from __future__ import annotations

from chefbot.design.export.ros2.annotated_yaml import Explained, Tree, rounded, short, yaml_text
from chefbot.design.export.ros2.derived_nav_params import CELLS
from chefbot.design.export.urdf_frames import DEPTH_FRAME
from chefbot.robot.sensors import DepthCamera


def depth_to_scan(camera: DepthCamera) -> str:
    """Return the YAML file with reasons as comments."""
    return yaml_text(
        depth_tree(camera),
        "A laser scan from the depth camera's middle rows, written by `chefbot robot export ros2`.",
    )


def depth_tree(camera: DepthCamera) -> Tree:
    """Return the parameters of the node with their reasons."""
    return {
        "depthimage_to_laserscan": {
            "ros__parameters": {
                "output_frame": Explained(
                    DEPTH_FRAME, "x forward, as for a scan; the axis of the optical frame is z"
                ),
                "scan_height": Explained(1, "one row at the height of the camera, as in chefbot's node"),
                "scan_time": Explained(rounded(1.0 / camera.rate), f"1 / {short(camera.rate)} Hz"),
                "range_min": Explained(rounded(camera.range_min), "the camera's"),
                "range_max": Explained(
                    rounded(camera.range_with_noise(CELLS[0])),
                    f"where the noise, {short(camera.noise)} z^2, becomes a cell of {CELLS[0]:g} m; it sees"
                    f" {short(camera.range_max)} m",
                ),
            }
        }
    }
