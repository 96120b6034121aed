"""`chefbot_msgs` as ROS 2 would build it: an independent library reads the files and finds our hashes."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET

import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from chefbot.design.export.ros2.workspace import message_package
from chefbot.msgs.chefbot_msgs import Deliver
from chefbot.msgs.idl.definition import type_hash
from chefbot.msgs.idl.registry import message_type

FILES = {path: data.decode() for path, data in message_package().items()}
MESSAGES = {path.removeprefix("msg/").removesuffix(".msg"): path for path in FILES if path.startswith("msg/")}


def test_an_independent_library_computes_the_same_hashes() -> None:
    store = get_typestore(Stores.ROS2_JAZZY)
    known: dict = {}
    for name, path in MESSAGES.items():
        known |= get_types_from_msg(FILES[path], f"chefbot_msgs/msg/{name}")
    store.register(known)
    assert len(MESSAGES) >= 12
    for name in MESSAGES:
        full = f"chefbot_msgs/msg/{name}"
        assert store.hash_rihs01(full) == type_hash(message_type(full)), name


def test_action_parts_have_the_fields_of_our_messages() -> None:
    parts = FILES["action/Deliver.action"].split("---\n")
    for text, kind in zip(parts, (Deliver.goal, Deliver.result, Deliver.feedback), strict=True):
        lines = [line for line in text.splitlines() if not line.startswith("#")]
        assert [line.split()[1] for line in lines] == list(kind.__struct_fields__)


@pytest.mark.parametrize("paper", ["package.xml", "CMakeLists.txt"])
def test_package_metadata_names_every_dependency(paper: str) -> None:
    used = {one for path in MESSAGES.values() for one in re.findall(r"^(\w+)/", FILES[path], re.MULTILINE)}
    used = (used - {"chefbot_msgs"}) | {"action_msgs"}
    if paper == "package.xml":
        root = ET.fromstring(FILES[paper])
        assert {one.text for one in root.iterfind("depend")} == used
        assert root.findtext("member_of_group") == "rosidl_interface_packages"
    else:
        assert set(re.findall(r'^  "(.+)"$', FILES[paper], re.MULTILINE)) == {
            path for path in FILES if path.startswith(("msg/", "action/"))
        }
        (listed,) = re.findall(r"DEPENDENCIES (.+)", FILES[paper])
        assert set(listed.split()) == used
