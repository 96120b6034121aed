"""Base of the web UI's device: what its 3-D view shows beside the layers of the map."""

from __future__ import annotations

from chefbot.msgs.chefbot_msgs import WheelTicks
from chefbot.msgs.sensor_msgs import CameraInfo, Image
from chefbot.msgs.std_msgs import String
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.runtime.node import In, topic
from chefbot.scan.camera import depth_image
from chefbot.ui.display.robot_view import frame_views, wheel_angles
from chefbot.ui.display.views import DepthView, FrameView
from chefbot.ui.missions.simulation_device import SimulationDevice
from chefbot.ui.server import WebUiServer


class ModelDevice(SimulationDevice):
    """Displays the robot's model, its frames and joints, and the point cloud of its depth camera."""

    depth: In[Image] = topic("camera/depth/image_raw")
    camera_info: In[CameraInfo] = topic("camera/depth/camera_info")
    moving_frames: In[TFMessage] = topic("tf")
    fixed_frames: In[TFMessage] = topic("tf_static")
    robot_description: In[String]
    wheel_ticks: In[WheelTicks]
    _server: WebUiServer

    def start(self) -> None:
        """Start without frames, until the first transforms."""
        super().start()
        self._moving_frames, self._fixed_frames = dict[str, FrameView](), dict[str, FrameView]()

    def on_depth(self, message: Image) -> None:
        """Display the depth image as a point cloud. ScanError if it is no depth image."""
        info = self.camera_info.last
        if info is not None:
            size = (message.height, message.width, message.step)
            depth = depth_image(message.data, message.encoding, *size, bool(message.is_bigendian))
            focal, cx, cy = info.k[0], info.k[2], info.k[5]
            view = DepthView(depth, float(focal), float(cx), float(cy), info.header.frame_id)
            self._server.set_layer("depth", view)

    def on_moving_frames(self, message: TFMessage) -> None:
        """Store transforms, which are displayed at the web UI's own lower rate."""
        self._moving_frames.update(frame_views(message))

    def on_fixed_frames(self, message: TFMessage) -> None:
        """Display the static transforms of mounted parts."""
        self._fixed_frames.update(frame_views(message))
        self._server.set_layer("fixed_frames", tuple(self._fixed_frames.values()))

    def on_robot_description(self, message: String) -> None:
        """Pass the URDF to the 3-D view: links, joints and masses."""
        self._server.set_layer("description", message.data)

    def _show_moving_parts(self) -> None:
        if self._moving_frames:
            self._server.set_layer("frames", tuple(self._moving_frames.values()))
        if self.wheel_ticks.last is not None:
            self._server.set_layer("joints", wheel_angles(self.wheel_ticks.last, self.robot))
