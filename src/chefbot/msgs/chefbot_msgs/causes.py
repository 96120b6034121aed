"""Messages of chefbot_msgs about the causes of stops that hold now."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from chefbot.msgs.idl.message import Message, String, StringArray
from chefbot.msgs.std_msgs import Header

_NONE = np.zeros(0, np.uint32)
_NONE.flags.writeable = False


class PresentCauses(Message, frozen=True, eq=False):
    """What holds now, published each second, so that a cause whose end was lost is ended, too.

    `node`: the node that reports its `checks` that find something; empty in the list of all causes by their `ids`.
    """

    ROS_PACKAGE = "chefbot_msgs"

    header: Header = Header()
    node: String = ""
    checks: StringArray = ()
    ids: Annotated[NDArray[np.uint32], "uint32[]"] = _NONE
