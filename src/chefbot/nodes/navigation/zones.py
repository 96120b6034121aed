"""Zones of the map: the speed limit of slow zones, and the filter masks of all."""

from __future__ import annotations

import math

from chefbot.causes.reports import SLOW, make_report
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import Quantity
from chefbot.msgs.chefbot_msgs.maps import SLOW_ZONE, MapZones
from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.nav2_msgs import CostmapFilterInfo, SpeedLimit
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.std_msgs import Header
from chefbot.nodes.causes.reports import CauseReportsNode
from chefbot.robot.motion_limits import Limits
from chefbot.runtime.node import In, NoParams, Out, every, topic
from chefbot.runtime.transform_buffer import TransformError
from chefbot.zones.filter_masks import FilterMask, keep_out_mask, speed_mask
from chefbot.zones.speed_limits import ZoneLimit, zone_limit

RATE = 10.0
"""Rate at which the speed limit is calculated, Hz."""
NOTABLE_RATIO = 1.02
"""Ratio of the commanded speed to the limit from which the slow zone is what slows the robot down."""
KEEP_OUT_MASK, SPEED_MASK = "keepout_filter_mask", "speed_filter_mask"
"""Topics of the masks, as in Nav2's tutorials."""


class ZonesNode(CauseReportsNode):
    """Publishes the speed limit where the robot is, as Nav2's SpeedFilter does, and Nav2's filter masks.

    The limit falls before a slow zone begins, so that the robot enters it at its speed. It is published when it
    changes; without localization there is none.
    """

    params: NoParams
    zones: In[MapZones]
    map: In[OccupancyGrid]
    cmd_vel: In[Twist]
    cmd_vel_nav: In[Twist]
    speed_limit: Out[SpeedLimit] = topic(latched=True)
    keep_out_mask: Out[OccupancyGrid] = topic(KEEP_OUT_MASK, latched=True)
    keep_out_info: Out[CostmapFilterInfo] = topic("keepout_costmap_filter_info", latched=True)
    speed_mask: Out[OccupancyGrid] = topic(SPEED_MASK, latched=True)
    speed_info: Out[CostmapFilterInfo] = topic("speed_costmap_filter_info", latched=True)

    def start(self) -> None:
        """Start without a published speed limit; read the robot's own limits."""
        self._limits, self._published = Limits.of(self.robot), 0.0

    def on_map(self, _: OccupancyGrid) -> None:
        """Publish the masks, which have the size of the map."""
        self._publish_masks()

    def on_zones(self, _: MapZones) -> None:
        """Publish the masks of new zones."""
        self._publish_masks()

    def _publish_masks(self) -> None:
        zones, grid = self.zones.last, self.map.last
        if zones is None or grid is None or not zones.zones:
            return
        header = Header.of(self.now_ns, "map")
        masks: tuple[tuple[FilterMask, Out[OccupancyGrid], Out[CostmapFilterInfo], str], ...] = (
            (keep_out_mask(zones, grid.grid), self.keep_out_mask, self.keep_out_info, KEEP_OUT_MASK),
            (speed_mask(zones, grid.grid), self.speed_mask, self.speed_info, SPEED_MASK),
        )
        for mask, out, info, name in masks:
            info.publish(CostmapFilterInfo(header, mask.type, name, 0.0, mask.multiplier))
            out.publish(OccupancyGrid.of(header, mask.grid))

    @every(hz=RATE)
    def limit_speed(self) -> None:
        """Publish the limit if it has changed, and report a zone that slows the robot down."""
        limit = self._limit()
        speed = 0.0 if limit is None else limit.speed
        if speed != self._published:
            self._published = speed
            self.speed_limit.publish(SpeedLimit(Header.of(self.now_ns, "map"), False, speed))
        commanded = abs(self.cmd_vel_nav.last.linear.x) if self.cmd_vel_nav.last is not None else 0.0
        slows = limit is not None and commanded > NOTABLE_RATIO * speed
        self._report_zone(limit if slows else None)

    def _limit(self) -> ZoneLimit | None:
        slow = self.zones.last.of_kind(SLOW_ZONE) if self.zones.last is not None else ()
        if not slow:
            return None
        try:
            pose = self.tf.lookup("map", "base_link")
        except TransformError:
            return None
        backward = self.cmd_vel.last is not None and self.cmd_vel.last.linear.x < 0.0
        heading = pose.yaw + math.pi if backward else pose.yaw
        return zone_limit(slow, SE2(pose.x, pose.y, heading), self._limits)

    def _report_zone(self, limit: ZoneLimit | None) -> None:
        if limit is None:
            self.report("motion", None)
            return
        title = limit.zone.title
        sentence = f"{title[0].upper()}{title[1:]} limits the speed to {limit.zone.speed:.2f} m/s."
        numbers = (Quantity("speed limit", limit.zone.speed, "m/s"),)
        self.report("motion", make_report(SLOW, title, sentence, numbers=numbers))
