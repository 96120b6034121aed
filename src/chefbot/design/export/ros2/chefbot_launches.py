"""Launch files of our own that the ROS packages carry: bases for Nav2, and navigation for others' bases."""

from __future__ import annotations

SIMULATED = """# Written by `chefbot ros2`: the simulated robot without anything that says where it is on a map.
description: "The simulated base for ROS 2 navigation{how}."
include: [simulator, base]
"""
BUILT = """# Written by `chefbot ros2`: the built robot without anything that says where it is on a map.
description: "The built base for ROS 2 navigation{how}; board_port:= is where the board is."
clock: wall
args: {{board_port: auto, port: 8080}}
include: [base]
nodes:
  board: {{kind: "chefbot.devices.motor_board:MotorBoardDevice", params: {{port: "${{board_port}}"}}}}
  page:
    kind: chefbot.ui.web_ui:WebUiDevice
    params: {{port: "${{port}}"}}
    disabled: "${{headless}}"
"""
WHEELS_ALONE = """\
  odometry:                     # wheels alone, elsewhere: robot_localization joins them with the gyro
    kind: chefbot.nodes.odometry:OdometryNode
    remap: {odom: wheel_odom, tf: wheel_tf, imu/data: no_imu}
"""
YOURS = """# Written by `chefbot ros2`: our localization and navigation for a robot whose drivers are ROS 2's.
# It needs /scan, odom -> base_footprint -> base_link and the scan's frame on /tf and /tf_static, and obeys /cmd_vel,
# geometry_msgs/Twist. Only radius, speeds and the scan's range and frame are taken from the robot file.
description: Our navigation on a ROS 2 robot; map_file:= is its map.
clock: wall
args: {map_file: runs/demo/map.yaml, port: 8080}
include: [navigation]
nodes:
  base: {kind: "chefbot.nodes.drive_base:DriveBaseNode"}
  map_file: {kind: "chefbot.devices.map_file:MapFileDevice", params: {map: "${map_file}"}}
  amcl: {kind: "chefbot.nodes.amcl:AmclNode"}
  delivery: {kind: "chefbot.nodes.delivery:DeliveryNode"}
  page:
    kind: chefbot.ui.web_ui:WebUiDevice
    params: {port: "${port}"}
    disabled: "${headless}"
"""


def chefbot_launches() -> dict[str, str]:
    """File to text: simulation or built, with our odometry (chefbot) or for robot_localization (ekf); yours."""
    how = ": its wheels alone tell odometry"
    return {
        "simulation_chefbot.yaml": SIMULATED.format(how=""),
        "simulation_ekf.yaml": SIMULATED.format(how=how) + "nodes:\n" + WHEELS_ALONE,
        "built_chefbot.yaml": BUILT.format(how=""),
        "your_robot.yaml": YOURS,
        "built_ekf.yaml": BUILT.format(how=how) + WHEELS_ALONE,
    }
