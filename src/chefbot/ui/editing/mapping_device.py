"""Base of the web UI's device: mapping from the browser, by exploration or by hand, and maps that are saved."""

from __future__ import annotations

import base64
import queue
from collections.abc import Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

import msgspec

from chefbot.devices.state_files import maps_folder
from chefbot.errors import ChefbotError, UserError
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import ExplorationStatus, LaunchRequest, LaunchStatus, MapFolder
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.std_msgs import Bool, Empty, String
from chefbot.runtime.launch import ArgValue, Launch
from chefbot.runtime.loop import Publication
from chefbot.runtime.node import In, Out, restored, topic
from chefbot.runtime.node_container import LAUNCH_TOPIC
from chefbot.storage.atomic_files import StorageError, make_folder
from chefbot.storage.map_bundle import BUNDLE_SUFFIX
from chefbot.storage.map_files import load_map
from chefbot.storage.map_versions import versions_of
from chefbot.storage.mapped_drives import bundle_path
from chefbot.storage.new_map import NO_MAP, save_map_in_frame
from chefbot.storage.places import places_path, save_places
from chefbot.storage.zones import zones_path
from chefbot.ui import commands as do
from chefbot.ui.display.views import LaunchView, MapBundleView, MappingView, SaveOutcome
from chefbot.ui.missions.model_device import ModelDevice
from chefbot.ui.web_ui_params import WebUiParams

SAVED = "Saved."
DEFAULT_PORT = WebUiParams().port
WRITE_TIMEOUT = 30.0
"""Time in which the map recorder has to adjust and write a map that is saved, s."""
OTHER_FRAME = (
    "The places and zones of the map before do not fit this one; they are kept with that map, and undoing the change"
    " brings them back."
)
SHOWN_OUTCOMES = 8
"""Number of outcomes that a browser gets together: a layer has its latest value only, and several people save."""
NO_DRIVE = "Its drive is not kept, so that it cannot be continued."


class SaveRequest(NamedTuple):
    """A map to be saved: its name, the places and arguments of the launch, and the map whose frame it has.

    arguments: of the launch that uses the map. replace: whether a map of that name is replaced. mapping: whether the
    robot maps, and does not drive on a map that was saved before. id: of the command.
    """

    name: str
    places: Mapping[str, SE2]
    arguments: str
    frame_of: Path | None
    replace: bool
    mapping: bool
    id: str


class MappingDevice(ModelDevice):
    """Passes the operator's orders on to explorer, mapper and launcher, and saves maps."""

    exploration_status: In[ExplorationStatus]
    map_error: In[OccupancyGrid]
    launch_status: In[LaunchStatus]
    scan_notice: In[String] = topic("scan/notice")
    written: In[MapFolder] = topic("map_recorder/written")
    restored_saved: In[String] = restored("saved_map")
    explore: Out[Bool]
    reset_map: Out[Empty]
    write_map: Out[Empty] = topic("map_recorder/write")
    launch_request: Out[LaunchRequest]
    saved_map: Out[String] = topic(latched=True)

    def start(self) -> None:
        """Start without a mapping view, until the explorer publishes its status."""
        super().start()
        self._mapping = MappingView()
        self._launch = LaunchView(mapping=False)
        self._is_reset = False
        """Whether a new map was begun in this launch."""
        self._written: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._disk = ThreadPoolExecutor(1, "maps")

    def stop(self) -> None:
        """Finish the maps that are being saved."""
        self._disk.shutdown()
        super().stop()

    def on_exploration_status(self, status: ExplorationStatus) -> None:
        """Display what the explorer does."""
        self._show_mapping(exploring=not status.done, description=status.description)

    def on_restored_saved(self, name: String) -> None:
        """Offer to drive on the map that was saved before a restart of the web UI."""
        self._mapping = msgspec.structs.replace(self._mapping, saved=name.data)
        if self.exploration_status.last is not None:
            self._show_mapping()

    def on_launch_status(self, status: LaunchStatus) -> None:
        """Offer to map the building, and to continue a map of which the drive is kept beside it."""
        bundle = Path(status.map_file).with_suffix(BUNDLE_SUFFIX) if status.map_file else None
        can_continue = bundle is not None and bundle.is_file() and not status.mapping
        self._launch = LaunchView(mapping=status.mapping, can_continue=can_continue, notice=status.notice)
        self._server.set_layer("launch", self._launch)

    def on_scan_notice(self, notice: String) -> None:
        """Display what the mapper reports, as that it looks for the robot on the map that it continues."""
        self._mapping = msgspec.structs.replace(self._mapping, mapper=notice.data)
        if self.exploration_status.last is not None:  # without an explorer nothing is mapped
            self._show_mapping()

    def on_written(self, message: MapFolder) -> None:
        """Pass on to the thread that saves a map where its drive is kept."""
        self._written.put(message.folder)

    def on_map_error(self, message: OccupancyGrid) -> None:
        """Display the estimated error of the map by region."""
        self._server.set_layer("map_error", message.grid)

    def _execute_mapping(
        self,
        command: do.Explore | do.ResetMap | do.SaveMap | do.SendMap,
        newest: OccupancyGrid | None,
        places: Mapping[str, SE2],
    ) -> None:
        match command:
            case do.Explore(on):
                self.explore.publish(Bool(on))
            case do.ResetMap():
                self._is_reset = True
                self.reset_map.publish(Empty())
                self._server.set_layer("map_error", None)
            case do.SaveMap(name, replace, identifier):
                self._request_drive()
                request = SaveRequest(
                    name,
                    dict(places),
                    launch_arguments(self.context.loop.latched()),
                    self._frame_of(),
                    replace,
                    self._is_mapping(),
                    identifier,
                )
                self._disk.submit(self._save, request, newest)
            case do.SendMap(number):
                self._request_drive()
                self._disk.submit(self._send, number)

    def _check_exploration(self, command: do.OperatorCommand) -> None:
        """Raise UserError for a command that would end the exploration of another person by the way."""
        if self._mapping.exploring and isinstance(command, do.Goal | do.GoPlace | do.Patrol | do.Follow):
            raise UserError("The robot explores the building; end the exploration first")

    def _frame_of(self) -> Path | None:
        """Return the map whose frame the present one has, None if it was begun in this launch."""
        status = self.launch_status.last
        return Path(status.map_file) if status and status.map_file and not self._is_reset else None

    def _is_mapping(self) -> bool:
        status = self.launch_status.last
        return status is not None and status.mapping

    def _request_drive(self) -> None:
        """Have the map recorder write the drive, or note that there is none."""
        while not self._written.empty():
            self._written.get()  # an answer that came too late for the map before
        keeps = argument_values(self.context.loop.latched()).get("keep_map", True)
        if keeps and self._is_mapping():
            self.write_map.publish(Empty())
        else:
            self._written.put("")

    def _request_launch(self, command: do.MapBuilding | do.DriveOnMap) -> None:
        """Have another launch run in place of the present one."""
        status = self.launch_status.last
        if status is None:
            return
        self._server.set_layer("launch", msgspec.structs.replace(self._launch, ends=True))
        if isinstance(command, do.DriveOnMap):
            path = maps_folder() / f"{command.name}.yaml"
            self.launch_request.publish(LaunchRequest("waiter", (f"map_file:={path}",)))
        elif command.continued:
            bundle = Path(status.map_file).with_suffix(BUNDLE_SUFFIX)
            self.launch_request.publish(LaunchRequest("gmapping_demo", (f"continue_map:={bundle}",)))
        else:
            self.launch_request.publish(LaunchRequest("gmapping_demo"))

    def _save(self, request: SaveRequest, newest: OccupancyGrid | None) -> None:
        """Save a map, in the thread: as the map recorder has written it, with its drive, or else as it is shown."""
        bundle = self._written_bundle()
        try:
            if bundle is not None:
                outcome = saved_map(request, load_map(bundle), bundle.read_bytes())
            else:
                outcome = NO_MAP if newest is None else saved_map(request, newest.grid)
        except (ChefbotError, OSError) as error:
            outcome = f"The map was not saved: {error}."
        self.post(lambda: self._end_save(request, outcome))

    def _send(self, number: str) -> None:
        """Send the bundle of the map, in the thread."""
        bundle = self._written_bundle()
        try:
            data = b"" if bundle is None else bundle.read_bytes()
        except OSError:
            data = b""  # the program that asked for it reports that no drive is kept
        view = MapBundleView(id=number, bundle=base64.b64encode(data).decode())
        self.post(lambda: self._server.set_layer("map_bundle", view))

    def _written_bundle(self) -> Path | None:
        """Return the bundle that the map recorder writes now, None if it keeps none on this machine."""
        try:
            folder = self._written.get(timeout=WRITE_TIMEOUT)
        except queue.Empty:
            return None
        bundle = bundle_path(Path(folder))
        return bundle if folder and bundle.is_file() else None

    def _end_save(self, request: SaveRequest, outcome: str) -> None:
        if outcome.startswith(SAVED):
            self._mapping = msgspec.structs.replace(self._mapping, saved=request.name)
            self.saved_map.publish(String(request.name))
        ended = (*self._mapping.outcomes, SaveOutcome(request.id, outcome))
        self._show_mapping(outcomes=ended[-SHOWN_OUTCOMES:])

    def _show_mapping(self, **changes: object) -> None:
        self._mapping = msgspec.structs.replace(self._mapping, **changes)
        self._server.set_layer("mapping", self._mapping)


def launch_arguments(latched: Iterable[Publication]) -> str:
    """Return the arguments of the present launch that another one on its map needs, with a space behind each."""
    args = argument_values(latched)
    names = ["built" if args.get("built") else "world", "robot"]
    if args.get("port") != DEFAULT_PORT:
        names.append("port")
    return "".join(
        f"{name}:={str(args[name]).lower() if name == 'built' else args[name]} "
        for name in names
        if name in args
    )


def argument_values(latched: Iterable[Publication]) -> dict[str, ArgValue]:
    """Return the arguments of the present launch by name."""
    texts = [
        one.message.data for one in latched if one.topic == LAUNCH_TOPIC and isinstance(one.message, String)
    ]
    return Launch.from_json(texts[-1]).args if texts else {}


def saved_map(request: SaveRequest, grid: Grid, drive: bytes = b"") -> str:
    """Save a map with the places of its launch if it has no others, and return how that ended.

    drive: bundle of the map with its drive, empty if there is none.
    """
    path = maps_folder() / f"{request.name}.yaml"
    if path.exists() and not request.replace:
        return f"There is a map called {request.name} already."
    try:
        make_folder(maps_folder())
        bundle = path.with_suffix(BUNDLE_SUFFIX)
        foreign = save_map_in_frame(path, grid, [(bundle, drive)] if drive else [], request.frame_of)
        if not drive:
            bundle.unlink(missing_ok=True)  # of a map before
        if request.places and not places_path(path).exists():  # a person may have edited it
            save_places(places_path(path), request.places)
        versions = versions_of(path, zones_path(path))
        if len(versions):
            versions.seal()  # bundle and places belong to the change that can be undone
    except UserError as error:
        return str(error)
    except (StorageError, OSError) as error:
        return f"The map was not saved: {error}."
    notes = [OTHER_FRAME] * foreign + [NO_DRIVE] * (request.mapping and not drive)
    use = f"To use it: chefbot launch waiter {request.arguments}map_file:={path}"
    return " ".join([SAVED, *notes, use])
