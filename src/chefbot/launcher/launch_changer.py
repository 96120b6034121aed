"""The node by which a person in the web UI has another launch run in place of the present one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta

from chefbot.devices.state_files import StateFileParams, store_state
from chefbot.devices.stored_pose import PoseFile, map_identity, pose_path
from chefbot.errors import ChefbotError, UserError
from chefbot.msgs.chefbot_msgs import LaunchRequest, LaunchStatus
from chefbot.msgs.std_msgs import String
from chefbot.runtime.launch import ArgValue, Launch, NodeEntry, load_launch
from chefbot.runtime.node import Device, In, Out, every, topic
from chefbot.runtime.node_container import NodeContainer
from chefbot.runtime.transform_buffer import TransformError
from chefbot.storage.map_files import load_map
from chefbot.storage.mapped_drives import bundle_path

NAME = "launch_changer"
KIND = "chefbot.launcher.launch_changer:LaunchChangerDevice"
MAPPING_LAUNCHES = ("gmapping_demo", "explore")
LAUNCHES = (*MAPPING_LAUNCHES, "amcl_demo", "waiter")
"""The launches of a robot that maps or drives on a map: each can be replaced by another one of them."""

REPLACED = (
    "map_file",
    "continue_map",
    "zones",
    "record",
    "initial_pose_x",
    "initial_pose_y",
    "initial_pose_a",
)
"""Arguments that belong to the map, the pose or the recording of one launch."""
STATUS_RATE = 0.5
"""Rate at which the status is published, Hz."""
ROBOT = ("robot", "built")
"""Arguments on which it depends what other arguments a launch has."""


class LaunchChangerParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of the launch changer."""

    launch: Annotated[str, Meta(description="name of the launch")]
    map_file: Annotated[str, Meta(description="map that the launch drives on or continues")] = ""
    notice: Annotated[str, Meta(description="why the launch runs, for the operator")] = ""
    built: Annotated[bool, Meta(description="whether the robot is a built one, and stays where it is")] = (
        False
    )
    namespace: Annotated[str, Meta(description="the robot's; empty where there is none")] = ""


class LaunchChangerDevice(Device):
    """Ends the launch on a request that another one can run; the launcher then runs that one."""

    params: LaunchChangerParams
    launch_request: In[LaunchRequest]
    launch_status: Out[LaunchStatus] = topic(latched=True)
    notice: Out[String] = topic("launch_changer/notice")

    def start(self) -> None:
        """Begin without a request of the operator."""
        self.request: LaunchRequest | None = None

    def on_launch_request(self, request: LaunchRequest) -> None:
        """End the launch, unless the other one is unknown or has no such argument."""
        try:
            check_request(request)
        except ChefbotError as error:
            self.notice.publish(String(f"The request for another launch is refused: {error}."))
            return
        if self.params.built:
            self._keep_pose(request)
        self.request = request
        self.context.loop.stop()

    def _keep_pose(self, request: LaunchRequest) -> None:
        """Keep the pose on the map that was made, if the other launch begins on that; without it, it searches."""
        map_file = parse_arguments(request.arguments).get("map_file", "")
        if not map_file or self.params.launch not in MAPPING_LAUNCHES:
            return
        files = StateFileParams(namespace=self.params.namespace)
        try:
            pose = self.tf.lookup("map", "base_link")
            stored = PoseFile(map=map_identity(load_map(Path(map_file))), x=pose.x, y=pose.y, yaw=pose.yaw)
            store_state(pose_path(files.file_name(self.robot.name)), stored)
        except (TransformError, ChefbotError) as error:
            self.notice.publish(String(f"Warning: the robot's pose is not kept: {error}"))

    @every(hz=STATUS_RATE)
    def publish_status(self) -> None:
        """Publish which launch runs; other processes reject it until they know the publisher."""
        p = self.params
        self.launch_status.publish(LaunchStatus(p.launch, p.launch in MAPPING_LAUNCHES, p.map_file, p.notice))


def parse_arguments(texts: Sequence[str]) -> dict[str, str]:
    """Parse texts of the form `key:=value`. Raises UserError for anything else."""
    arguments: dict[str, str] = {}
    for text in texts:
        key, separator, value = text.partition(":=")
        if not separator or not key:
            raise UserError(f"{text!r} is not an argument of a launch; write key:=value")
        arguments[key] = value
    return arguments


def check_request(request: LaunchRequest) -> None:
    """Raise UserError unless the launch is one of LAUNCHES and accepts the arguments."""
    if request.launch not in LAUNCHES:
        raise UserError(f"{request.launch!r} is none of {', '.join(LAUNCHES)}")
    load_launch(request.launch, parse_arguments(request.arguments))


def with_changer(launch: Launch, notice: str = "") -> Launch:
    """Return a launch with the node by which it can be replaced, if it is one of LAUNCHES."""
    if launch.name not in LAUNCHES:
        return launch
    args = launch.args
    params: dict[str, ArgValue] = {
        "launch": launch.name,
        "map_file": _map_file(args),
        "notice": notice,
        "built": bool(args.get("built", False)),
        "namespace": str(args.get("namespace", "")),
    }
    nodes = {**launch.nodes, NAME: NodeEntry(kind=KIND, params=params)}
    return msgspec.structs.replace(launch, nodes=nodes)


def _map_file(args: Mapping[str, ArgValue]) -> str:
    """Return the map that a launch drives on or continues, empty for none."""
    if continued := str(args.get("continue_map", "")):
        return str(bundle_path(Path(continued)).with_suffix(".yaml"))
    return str(args.get("map_file", ""))


def requested_launch(system: NodeContainer) -> LaunchRequest | None:
    """Return the request for which a launch has ended, None if it has ended for another reason."""
    changer = system.nodes.get(NAME)
    return changer.request if isinstance(changer, LaunchChangerDevice) else None


def withdraw_request(system: NodeContainer) -> None:
    """Forget the request: a signal has ended the launch as well, and so ends the program."""
    changer = system.nodes.get(NAME)
    if isinstance(changer, LaunchChangerDevice):
        changer.request = None


def changed_arguments(present: Mapping[str, str], request: LaunchRequest) -> dict[str, str]:
    """Return what is given to the requested launch: its own arguments, and those of all launches before it that are
    not of one map."""
    kept = {key: value for key, value in present.items() if key not in REPLACED}
    return {**kept, **parse_arguments(request.arguments)}


def accepted_arguments(launch: str, given: Mapping[str, str]) -> dict[str, str]:
    """Return the given arguments that a launch has."""
    robot = {key: given[key] for key in ROBOT if key in given}  # a built robot has other arguments
    accepted = load_launch(launch, robot).args
    return {key: value for key, value in given.items() if key in accepted}
