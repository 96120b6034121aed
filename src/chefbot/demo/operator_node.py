"""The demo's operator as a node, so that its messages are bridged between processes."""

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


class OperatorDevice(Device):
    """Declares the operator's topics only: the demo publishes in its name and observes the loop."""

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
