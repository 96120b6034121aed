"""The web UI as a device: subscribes the robot's topics for display and publishes the operator's commands."""

from __future__ import annotations

import msgspec
import numpy as np

from chefbot.causes.statuses import NO_FAILURE
from chefbot.errors import UserError
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import (
    DeliveryStatus,
    EmergencyStopStatus,
    Errand,
    LocalizationStatus,
    NavigationStatus,
    ObstacleScan,
    Order,
    RoundForecast,
)
from chefbot.msgs.chefbot_msgs.people import TrackedPeople
from chefbot.msgs.diagnostic_msgs import DiagnosticArray
from chefbot.msgs.geometry_msgs import PoseStamped, PoseWithCovarianceStamped, Twist
from chefbot.msgs.nav2_msgs import ParticleCloud
from chefbot.msgs.nav_msgs import OccupancyGrid, Odometry, Path
from chefbot.msgs.sensor_msgs import BatteryState, Image, JointState, LaserScan
from chefbot.msgs.std_msgs import Bool, Empty, String
from chefbot.robot.motion_limits import max_speed, max_turn
from chefbot.runtime.node import In, Out, every, topic
from chefbot.safety.stop_latch import PRESSED
from chefbot.scan.color_image import rgb_pixels
from chefbot.storage.delivery_history import RecordedRound
from chefbot.ui import commands as do
from chefbot.ui.access.invitations import Invitations
from chefbot.ui.access.page_access import announcement
from chefbot.ui.access.served_address import keep_address
from chefbot.ui.access.tls import load_tls
from chefbot.ui.access.visitors import is_person
from chefbot.ui.delivery_view import activity, delivery_view, forecast_views, is_errand, validate_command
from chefbot.ui.display import views
from chefbot.ui.display.message_conversion import (
    RecentDiagnostics,
    clicked_pose,
    cost_image,
    door_views,
    path_points,
    people_views,
)
from chefbot.ui.display.robot_view import make_glb, robot_view, shape_view
from chefbot.ui.display.scan_display import ScanDisplay
from chefbot.ui.inspect.navigation_device import NavigationDevice
from chefbot.ui.missions.history_device import history_path
from chefbot.ui.missions.incident_device import incident_folder
from chefbot.ui.pending_requests import PendingRequests
from chefbot.ui.qr import qr_code
from chefbot.ui.real_time_factor import RealTimeFactor
from chefbot.ui.server import WebUiServer
from chefbot.ui.web_ui_params import WebUiParams

REPEAT_HZ = 5
"""Rate at which unconfirmed requests are repeated, Hz."""


class WebUiDevice(NavigationDevice):
    """One web UI for everything; its publications are recorded, so a replay executes the same clicks."""

    # A flood may delay the web UI; remote driving ends by the base's own command timeout, which is shorter.
    max_silence = 0.5
    params: WebUiParams
    costmap: In[OccupancyGrid] = topic("global_costmap/costmap")
    scan: In[LaserScan]
    obstacles: In[ObstacleScan]
    particle_cloud: In[ParticleCloud]
    tracked_people: In[TrackedPeople]
    plan: In[Path]
    local_plan: In[Path]
    goal: In[PoseStamped] = topic("navigation_goal")
    odom: In[Odometry]
    ground_truth: In[Odometry]
    battery_state: In[BatteryState]
    localization_status: In[LocalizationStatus]
    round_forecast: In[RoundForecast]
    phase: In[String]
    delivery_notice: In[String] = topic("delivery/notice")
    diagnostics: In[DiagnosticArray]
    emergency_stop: In[Bool]
    stop_status: In[EmergencyStopStatus]
    doors: In[JointState] = topic("simulation/doors")

    goal_pose: Out[PoseStamped]
    initialpose: Out[PoseWithCovarianceStamped]
    order: Out[Order]
    loaded: Out[Empty]
    taken: Out[Empty]
    not_taken: Out[Empty]
    round_queue: Out[Order]
    errand: Out[Errand]
    cancel: Out[Empty]
    stop_request: Out[Bool]
    cmd_vel_teleop: Out[Twist]

    def start(self) -> None:
        """Start the server of the web UI."""
        super().start()
        self._stopped = False
        self._stopped_by = ""
        self._last_status = views.StatusView()
        self._last_stop = views.StopView()
        self._shown_robot: views.RobotView | None = None
        self._failures = self._notices = 0
        self._pending = PendingRequests(self.name, self.stop_request.publish, self.order.publish)
        self._real_time_factor = RealTimeFactor(self.now_ns)
        self._diagnostics = RecentDiagnostics()
        tls = load_tls(self.params.certificate)
        p = self.params
        invitations = Invitations(self.robot.name, self._warn)
        self._server = WebUiServer(
            p.port,
            p.host,
            self._receive,
            lambda: make_glb(self.robot),
            self.audit,
            tls,
            p.kiosk_pin,
            incident_folder(),
            history_path(self.robot.name),
            invitations,
            p.names,
        )
        self._saves_failures = p.save_failures and not p.simulation
        self._scans = ScanDisplay(self._server.set_layer)
        self._server.set_layer("shape", shape_view(self.robot))
        self._server.set_layer("forecast", ())
        self._show_incidents(self._incidents)
        self._server.set_layer("history", self._open_history(simulated=p.simulation))
        self._server.set_layer("causes", self._open_causes(simulated=p.simulation))
        self.url = self._server.start()
        self.announcement = announcement(self._server, self.params, self.url, invitations)
        if self._server.requires_token:
            keep_address(self.robot.name, self.url, self._warn)
        self.qr_code = qr_code(self.url) if self._server.requires_token else ""

    def stop(self) -> None:
        """Stop the server and free its port."""
        self._server.stop()
        super().stop()

    def on_emergency_stop(self, stopped: Bool) -> None:
        """Update the state of the emergency stop as the drive base reports it, no matter who requested it."""
        self._stopped = stopped.data
        if stopped.data:
            self._pending.confirm_stop()
        else:
            self._stopped_by = ""
        self._show_stop()

    def on_stop_status(self, _: EmergencyStopStatus) -> None:
        """Update the time of the last press of the emergency stop."""
        self._show_stop()

    def on_navigation_status(self, message: NavigationStatus) -> None:
        """Clear the goal when the navigator is idle, and count it if it failed, so that the operator notices."""
        if message.state == "idle":
            self._failures += message.reason not in NO_FAILURE
            for layer in ("goal", "path", "local_path", "local_costmap", "candidates"):
                self._server.set_layer(layer, None)

    @every(hz=REPEAT_HZ)
    def repeat_unconfirmed(self) -> None:
        """Repeat the requests that the robot has not confirmed."""
        self._pending.repeat_unconfirmed(self.now_ns)
        if self._pending.order_warning(self.now_ns):
            self._show_delivery(self._round)

    # -- display

    def show_progress(self, progress: views.ProgressView) -> None:
        """Display a long job of the computer, not of the robot. Thread-safe."""
        self._server.set_layer("progress", progress)

    def on_map(self, message: OccupancyGrid) -> None:
        """Display the map of SLAM or of the map server."""
        self._server.set_layer("map", message.grid)

    def on_costmap(self, message: OccupancyGrid) -> None:
        """Display the global costmap of the planner."""
        self._server.set_layer("costmap", cost_image(message.grid))

    def on_scan(self, message: LaserScan) -> None:
        """Display the end points of a scan in the map frame."""
        self._scans.show("scan", self._lookup("map", message.header.frame_id), message)

    def on_obstacles(self, message: ObstacleScan) -> None:
        """Display the obstacles detected by the camera."""
        self._scans.show("obstacles", self._lookup("map", message.header.frame_id), message)

    def on_particle_cloud(self, message: ParticleCloud) -> None:
        """Display the particles of the localization."""
        poses = np.array([particle.pose.se2 for particle in message.particles]).reshape(-1, 3)
        self._server.set_layer("particles", poses)

    def on_tracked_people(self, message: TrackedPeople) -> None:
        """Display the tracked people in the map frame."""
        pose = self._lookup("map", message.header.frame_id)
        if pose is not None:
            self._server.set_layer("people", people_views(message, pose))

    def on_plan(self, message: Path) -> None:
        """Display the global plan to the goal."""
        self._server.set_layer("path", path_points(message, SE2(0, 0, 0)))

    def on_local_plan(self, message: Path) -> None:
        """Display the controller's local plan, which is in the odom frame."""
        pose = self._lookup("map", message.header.frame_id)
        if pose is not None:
            self._server.set_layer("local_path", path_points(message, pose))

    def on_goal(self, message: PoseStamped) -> None:
        """Display the goal of the navigation."""
        self._server.set_layer("goal", message.pose.se2)

    def on_ground_truth(self, message: Odometry) -> None:
        """Display the ground truth pose of the simulation."""
        self._server.set_layer("truth", message.pose.pose.se2)

    def on_picture(self, message: Image) -> None:
        """Display the latest colour image of the camera."""
        self._server.set_layer("camera", rgb_pixels(message))

    def on_diagnostics(self, message: DiagnosticArray) -> None:
        """Store diagnostics that are not OK, with the time of reception."""
        self._diagnostics.update(message, self.now_ns)

    def _show_causes(self, causes: tuple[views.CauseView, ...]) -> None:
        self._server.set_layer("causes", causes)

    def _show_history(self, rounds: tuple[RecordedRound, ...]) -> None:
        self._server.set_layer("history", rounds)

    def _show_incidents(self, view: views.IncidentsView) -> None:
        self._server.set_layer("incidents", view)

    def on_delivery_status(self, message: DeliveryStatus) -> None:
        """Update the state of the deliveries and confirm accepted orders."""
        self._pending.confirm_orders(message.accepted, self.now_ns)
        if self._record_round(message):
            self._server.set_layer("forecast", ())
        self._show_history(self._newest_rounds())
        self._show_delivery(message)

    def on_delivery_notice(self, _: String) -> None:
        """Count what the delivery has refused, so that the operator notices."""
        self._notices += 1

    def on_round_forecast(self, message: RoundForecast) -> None:
        """Display when the stops of the round are reached."""
        self._server.set_layer("forecast", forecast_views(message))

    def _show_delivery(self, message: DeliveryStatus) -> None:
        self._server.set_layer("delivery", delivery_view(message, self._pending.order_warning(self.now_ns)))

    @property
    def _round(self) -> DeliveryStatus:
        return self.delivery_status.last or DeliveryStatus()

    @every(hz=10)
    def show_robot(self) -> None:
        """Display pose, status, moving frames and wheel joints."""
        pose = self._lookup("map", "base_link") or self._lookup("odom", "base_link")
        if pose is not None:
            twist = self.odom.last.twist.twist if self.odom.last else Twist()
            self._shown_robot = robot_view(pose, twist, self._shown_robot)
            self._server.set_layer("robot", self._shown_robot)
        self._last_status = self._status(pose)
        self._server.set_layer("status", self._last_status)
        self._show_moving_parts()

    def _show_stop(self) -> None:
        status, pending = self.stop_status.last, self._pending
        presses, pressed = pending.presses.confirmed, str(status.pressed_at.ns) if status else ""
        self._last_stop = views.StopView(
            stopped=self._stopped, requested=pending.stop, confirmed=presses, pressed=pressed
        )
        self._server.set_layer("stop", self._last_stop)

    def _status(self, pose: SE2 | None) -> views.StatusView:
        battery, truth = self.battery_state.last, self.ground_truth.last
        localization, navigation = self.localization_status.last, self.navigation_status.last
        error = truth.pose.pose.se2.distance(pose) if truth and pose else None
        reason = self._why_stopped() or self._causes.sentence
        unanswered = self._pending.order_warning(self.now_ns)
        return views.StatusView(
            phase=activity(self.phase.last, self._round, unanswered, self._mapping),
            clock=float(self.now_ns // 1_000_000_000),
            real_time_factor=views.rounded(self._real_time_factor.factor(self.now_ns), 1),
            battery=views.rounded(100.0 * battery.percentage, 0) if battery else None,
            volts=views.rounded(battery.voltage, 1) if battery else None,
            pose_probability=views.rounded(localization.probability, 2) if localization else None,
            localization=localization.description if localization else "",
            localization_error=views.rounded(error, 3),
            navigation=navigation.state if navigation else "",
            reason=reason or self._navigation_reason(exploring=self._mapping.exploring),
            stopped=self._stopped,
            stop_pending=self._pending.stop,
            failures=self._failures,
            notice=self.delivery_notice.last.data if self.delivery_notice.last else "",
            notices=self._notices,
            simulation=self.params.simulation,
            warnings=(*self.own_warnings, *self._diagnostics.warnings(self.now_ns)),
            doors=door_views(self.doors.last),
        )

    def _why_stopped(self) -> str:
        status = self.stop_status.last
        description = status.description if self._stopped and status else ""
        if description == PRESSED and self._stopped_by:
            description = f"{self._stopped_by} pressed the emergency stop."
        return self._pending.stop_warning(self.now_ns) or description

    # -- commands of the operator

    def _receive(self, command: do.OperatorCommand, who: str) -> None:
        if isinstance(command, do.Playback):
            raise UserError("This is a robot, not a recording; there is nothing to play")
        if isinstance(command, do.Inspect | do.SetParameter):
            self._inspect(command, who)
            return
        validate_command(command, self._places, self._round)
        self._check_exploration(command)
        if isinstance(command, do.ReleaseStop) and command.pressed not in ("", self._last_stop.pressed):
            raise UserError(
                "Emergency stop was pressed again in the meantime; check the robot, then release STOP again"
            )
        if isinstance(command, do.Stop) and not self._last_status.stopped:
            # Display the press at once: the event loop may be late, or simulated time may be paused.
            self._server.set_layer("status", msgspec.structs.replace(self._last_status, stop_pending=True))
            self._server.set_layer("stop", msgspec.structs.replace(self._last_stop, requested=True))
        self.post(lambda: self._execute(command, who))

    def _execute(self, command: do.OperatorCommand, who: str) -> None:
        match command:
            case do.Goal(x, y, yaw, when):
                self._publish_goal(SE2(x, y, yaw), "", when)
            case do.GoPlace(name, when):
                self._publish_goal(self._places[name], name, when)
            case do.InitialPose(x, y, yaw):
                self.initialpose.publish(clicked_pose(self._stamped(SE2(x, y, yaw))))
            case do.Deliver(tables):
                self._pending.deliver(tables, self.now_ns, who)
            case do.Loaded():
                self.loaded.publish(Empty())
            case do.Taken():
                self.taken.publish(Empty())
            case do.NotTaken():
                self.not_taken.publish(Empty())
            case do.Choose(choice):
                self.round_choice.publish(String(choice))
            case do.ChangeQueue(tables=tables, order=order):
                self.round_queue.publish(Order(tuple(tables), order))
            case do.Patrol() | do.Follow() | do.ShortestOrder():
                self._execute_mission(command)
            case do.Cancel():
                self._pending.cancel()
                self.cancel.publish(Empty())
            case do.Stop(key):
                self._stopped_by = self._stopped_by or (who if is_person(who) else "")
                self._pending.press(self.now_ns, stopped=self._stopped, key=key)
                self._show_stop()
            case do.Withdraw(key):
                self._pending.presses.withdraw(key)
                self._stopped_by = self._stopped_by if self._stopped else ""
                self._show_stop()
            case do.ReleaseStop():
                self._pending.release()
                self._show_stop()
            case do.Drive(v, w):
                self.cmd_vel_teleop.publish(Twist.of(v * max_speed(self.robot), w * max_turn(self.robot)))
            case do.InspectCell(x, y):
                self._inspect_cell(x, y)
            case do.SaveIncident(note):
                self._save_incident(note or self._why_stopped() or self._causes.sentence, who)
            case do.Record(on, note):
                self._record(note, who, on=on)
            case do.DropBox() | do.Kidnap() | do.OpenDoor() | do.CloseDoor():
                self._execute_in_simulation(command)
            case do.PutPlace() | do.DeletePlace() | do.PutZone() | do.DeleteZone() | do.UndoMapEdit():
                self._execute_map_edit(command, who)
            case do.DrawOnMap() | do.CropMap() | do.RotateMap():
                self._execute_map_change(command, who)
            case do.Explore() | do.ResetMap() | do.SaveMap() | do.SendMap():
                self._execute_mapping(command, self.map.last, self._places)
            case do.MapBuilding() | do.DriveOnMap():
                self._request_launch(command)

    def _publish_goal(self, pose: SE2, name: str, when: str) -> None:
        if is_errand(when, self._round):
            self.errand.publish(Errand(name, self._stamped(pose), when))
        else:
            self.goal_pose.publish(self._stamped(pose))
