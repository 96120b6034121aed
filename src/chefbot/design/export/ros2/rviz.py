"""RViz 2's settings: the robot alone, and the robot with map, scan, costs, plan and goals.

Classes and properties as RViz saves them: https://github.com/ros2/rviz/tree/jazzy/rviz_default_plugins.
"""

from __future__ import annotations

from chefbot.design.export.ros2.derived_nav_params import Doubt, Figures
from chefbot.robot.geometry.layout import overall_height
from chefbot.robot.spec import Robot

_QUALITY = "{Value: %%s, Durability Policy: %s, Reliability Policy: %s, History Policy: Keep Last, Depth: %d}"
LATCHED = _QUALITY % ("Transient Local", "Reliable", 1)
SENSED = _QUALITY % ("Volatile", "Best Effort", 5)
TOLD = _QUALITY % ("Volatile", "Reliable", 5)


def rviz_files(robot: Robot, doubt: Doubt) -> dict[str, str]:
    """File to text."""
    figures = Figures(robot, doubt)
    near, far = 4 * overall_height(robot), 4 * figures.window.number
    base = [GRID, ROBOT, TF]
    scene = [_scan(figures), _image(robot)]
    seen = [
        _map("Map", "/map", LATCHED, "map", 0.7),
        _map("Global costs", "/global_costmap/costmap", LATCHED, "costmap", 0.3),
        _map("Local costs", "/local_costmap/costmap", LATCHED, "costmap", 0.5),
        PLAN,
        PARTICLES,
    ]
    return {
        "robot.rviz": _file("base_footprint", [*base, *scene], near),
        "navigation.rviz": _file("map", [*base, *seen, *scene], far),
    }


GRID = """\
    - Class: rviz_default_plugins/Grid
      Enabled: true
      Name: Grid
      Cell Size: 1
      Plane Cell Count: 20
"""
ROBOT = f"""\
    - Class: rviz_default_plugins/RobotModel
      Enabled: true
      Name: RobotModel
      Description Source: Topic
      Description Topic: {LATCHED % "/robot_description"}
"""
TF = """\
    - Class: rviz_default_plugins/TF
      Enabled: false
      Name: TF
      Marker Scale: 0.3
"""
PLAN = f"""\
    - Class: rviz_default_plugins/Path
      Enabled: true
      Name: Plan
      Color: 255; 0; 127
      Topic: {TOLD % "/plan"}
"""
PARTICLES = f"""\
    - Class: nav2_rviz_plugins/ParticleCloud
      Enabled: true
      Name: Guesses
      Color: 0; 160; 0
      Topic: {SENSED % "/particle_cloud"}
"""


def _scan(figures: Figures) -> str:
    return f"""\
    - Class: rviz_default_plugins/LaserScan
      Enabled: true
      Name: Scan
      Color Transformer: FlatColor
      Color: 255; 0; 0
      Style: Flat Squares
      Size (m): {figures.resolution.number:g}
      Topic: {SENSED % figures.sight.topic}
"""


def _image(robot: Robot) -> str:
    if robot.sensors.depth_camera is None:
        return ""
    return f"""\
    - Class: rviz_default_plugins/Image
      Enabled: true
      Name: Depth
      Normalize Range: true
      Topic: {SENSED % "/camera/depth/image_raw"}
"""


def _map(name: str, topic: str, service: str, scheme: str, alpha: float) -> str:
    return f"""\
    - Class: rviz_default_plugins/Map
      Enabled: true
      Name: {name}
      Alpha: {alpha:g}
      Color Scheme: {scheme}
      Draw Behind: {"true" if scheme == "map" else "false"}
      Topic: {service % topic}
"""


def _file(frame: str, displays: list[str], distance: float) -> str:
    return f"""Panels:
  - Class: rviz_common/Displays
    Name: Displays
  - Class: rviz_common/Tool Properties
    Name: Tool Properties
Visualization Manager:
  Class: ""
  Displays:
{"".join(displays)}  Enabled: true
  Global Options:
    Fixed Frame: {frame}
    Frame Rate: 30
  Tools:
    - Class: rviz_default_plugins/MoveCamera
    - Class: rviz_default_plugins/Select
    - Class: rviz_default_plugins/Measure
    - Class: rviz_default_plugins/SetInitialPose
      Topic: {TOLD % "/initialpose"}
    - Class: rviz_default_plugins/SetGoal
      Topic: {TOLD % "/goal_pose"}
  Value: true
  Views:
    Current:
      Class: rviz_default_plugins/Orbit
      Distance: {distance:.3g}
      Focal Point: {{X: 0, Y: 0, Z: 0}}
      Pitch: 0.9
      Yaw: 3.9
      Name: Current View
"""
