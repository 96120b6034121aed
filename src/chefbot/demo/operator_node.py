"""The person of the demo as a node: what it says and hears has to cross from process to process."""

from __future__ import annotations

from chefbot.msgs.chefbot_msgs import (
    DeliveryStatus,
    ExplorationStatus,
    LocalizationStatus,
    NavigationStatus,
    Order,
)
from chefbot.msgs.geometry_msgs import PoseWithCovarianceStamped
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.std_msgs import Bool, Empty, String
from chefbot.runtime.node import Device, In, NoParams, Out


class PersonDevice(Device):
    """Does nothing itself: the demo speaks in its name, and looks at what reaches the loop."""

    params: NoParams
    map: In[OccupancyGrid]
    exploration_status: In[ExplorationStatus]
    localization_status: In[LocalizationStatus]
    navigation_status: In[NavigationStatus]
    delivery_status: In[DeliveryStatus]
    localized: In[Bool]
    order: Out[Order]
    loaded: Out[Empty]
    taken: Out[Empty]
    initialpose: Out[PoseWithCovarianceStamped]
    reinitialize_global_localization: Out[Empty]
    phase: Out[String]
