"""The sources of marks in a costmap, each of which clears its own marks only."""

from __future__ import annotations

LASER, CAMERA, UPRIGHT, DROP_OFFS = "laser", "camera", "upright", "drop_offs"
"""Sources of marks: obstacles in the planar scan; obstacles in the depth camera that the planar scan may miss;
obstacles in the camera that intersect the scan plane, so that the planar scan clears them once they left; drop-offs
of the floor, which the camera alone clears."""
RANGER, CONTACT, GLASS = "ranger", "contact", "glass"
"""Sources of marks: obstacles of the ranger's echoes, obstacles that the robot has touched, and glass that returned
beams of the lidar."""
LASTING_SOURCES = (RANGER, CONTACT, GLASS)
"""Sources of obstacles that other sensors may not see: beams of the lidar and recovery behaviors leave them."""
CONTACT_TIME = 600.0
"""Time after which a contact is forgotten, s: perhaps somebody has moved what the robot touched."""
PERMANENT_SOURCES = (GLASS, DROP_OFFS)
"""Sources of what belongs to the building as its walls do: no plan counts on its having left."""
