"""The node ``map_server``: reads a map in Nav2's format, publishes it, and loads and saves others on request."""
from __future__ import annotations

import time
from dataclasses import dataclass

from mobile_planning_msgs.srv import SaveMap
from nav_msgs.msg import MapMetaData
from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage
from nav_msgs.srv import GetMap, LoadMap
from rclpy.callback_groups import ReentrantCallbackGroup

from mobile_planning.errors import InvalidInput, MapError, NoMap
from mobile_planning.nodes import qos
from mobile_planning.nodes.convert_map import map_message, occupancy_grid
from mobile_planning.nodes.latched import latched_message
from mobile_planning.nodes.managed import ManagedNode
from mobile_planning.nodes.map_paths import check_allowed, load_allowed, local_path
from mobile_planning.nodes.parameters import option
from mobile_planning.world.map_io import IMAGE_FORMATS, save_map
from mobile_planning.world.map_metadata import MapMode


@dataclass(frozen=True)
class MapServerOptions:
    """The parameters of the node."""

    autostart: bool = option(True, 'whether the node configures and activates itself', read_only=True)
    yaml_filename: str = option('', 'YAML file of the map to start with; empty: start without a map')
    topic_name: str = option('map', 'topic of the map; its metadata go to <topic_name>_metadata', read_only=True)
    frame_id: str = option('map', 'frame that maps are published in', read_only=True)
    map_roots: tuple[str, ...] = option((), 'folders of the maps that may be read and written; empty: any',
                                        read_only=True)
    save_map_timeout: float = option(2.0, 'how long save_map waits for the map of another topic [s]',
                                     low=0.01, high=60.0)
    free_thresh_default: float = option(0.25, 'share up to which a saved cell is free', low=0.0, high=1.0)
    occupied_thresh_default: float = option(0.65, 'share from which a saved cell is occupied', low=0.0, high=1.0)

    def __post_init__(self):
        if not self.free_thresh_default < self.occupied_thresh_default:
            raise InvalidInput(f'free_thresh_default {self.free_thresh_default:g} must be below '
                               f'occupied_thresh_default {self.occupied_thresh_default:g}')
        if not (self.topic_name and self.frame_id):
            raise InvalidInput('topic_name and frame_id must not be empty')


class MapServer(ManagedNode):
    """Holds one map and publishes it, latched, on activation and whenever another is loaded."""

    def __init__(self, **kwargs):
        super().__init__('map_server', MapServerOptions, **kwargs)
        self._message = self._publisher = self._metadata_publisher = None
        serve, guard = self.create_service, self.guard.service
        serve(GetMap, '~/map', guard(self._on_get_map, lambda response, error: None))
        serve(LoadMap, '~/load_map', guard(self._on_load_map, _load_failed))
        # Waits for a map without holding up the other callbacks.
        serve(SaveMap, '~/save_map', guard(self._on_save_map, lambda response, error: None),
              callback_group=ReentrantCallbackGroup())
        self.start()

    def configure(self) -> None:
        """Load the first map."""
        name, topic = self.options.yaml_filename, self.options.topic_name
        if name:
            self._hold(load_allowed(name, self.options.map_roots), name)
        self._publisher = self.create_lifecycle_publisher(OccupancyGridMessage, topic, qos.MAP)
        self._metadata_publisher = self.create_lifecycle_publisher(MapMetaData, f'{topic}_metadata', qos.MAP)

    def activate(self) -> None:
        """Publish the map."""
        self._publish()

    def cleanup(self) -> None:
        """Forget the map; nobody who comes later gets it."""
        for publisher in filter(None, (self._publisher, self._metadata_publisher)):
            self.destroy_lifecycle_publisher(publisher)
        self._message = self._publisher = self._metadata_publisher = None

    def facts(self) -> dict[str, object]:
        """Return the size of the map."""
        if self._message is None:
            return {'map': 'none'}
        info = self._message.info
        return {'map': f'{info.width} x {info.height} cells', 'resolution': info.resolution}

    def _hold(self, grid, name):
        """Make the grid the map of this node; its message is built once, since that is what costs."""
        self._message = map_message(grid, self.options.frame_id, self.get_clock().now().to_msg())
        self.get_logger().info(f'loaded {name}: {grid}')

    def _publish(self):
        """Publish the map that is held."""
        if self._message is None:
            self.get_logger().warning('there is no map to publish yet: load one with ~/load_map')
            return
        self._publisher.publish(self._message)
        self._metadata_publisher.publish(self._message.info)
        self.get_logger().info(f'published the map on {self._publisher.topic_name}, reliable and transient local')

    def _held(self):
        """Return the message of the map."""
        self.require_active()
        if self._message is None:
            raise NoMap('the map server has no map yet')
        return self._message

    def _on_get_map(self, request, response):
        """Answer with the map; with an empty one where there is none."""
        response.map = self._held()
        return response

    def _on_load_map(self, request, response):
        """Load another map and publish it; the old one stays where that fails."""
        self.require_active()
        grid = load_allowed(request.map_url, self.options.map_roots)
        self._hold(grid, request.map_url)
        self._publish()
        response.map, response.result = self._message, LoadMap.Response.RESULT_SUCCESS
        return response

    async def _on_save_map(self, request, response):
        """Write the map of this node, or the one that a topic has, to files."""
        path = local_path(request.map_url) or f'map_{int(time.time())}'
        check_allowed(path, self.options.map_roots)
        mode = self._known(request.map_mode, [mode.value for mode in MapMode], 'trinary', 'map mode')
        image_format = self._known(request.image_format, IMAGE_FORMATS, 'png' if mode == 'scale' else 'pgm',
                                   'image format')
        free = request.free_thresh or self.options.free_thresh_default
        occupied = request.occupied_thresh or self.options.occupied_thresh_default
        if request.map_topic:
            patience = self.options.save_map_timeout
            message = await latched_message(self, OccupancyGridMessage, request.map_topic, patience)
        else:
            message = self._held()
        written = save_map(occupancy_grid(message), path, image_format, mode,
                           free_thresh=round(free, 6), occupied_thresh=round(occupied, 6))  # 32 bits
        self.get_logger().info(f'saved the map as {written}')
        response.result = True
        return response

    def _known(self, word, words, default, name):
        """Return the word if it is known, else the default, as Nav2 does."""
        if word and word.lower() not in words:
            self.get_logger().warning(f'{name} {word!r} is none of {", ".join(words)}: taking {default}')
        return word.lower() if word.lower() in words else default


def _load_failed(response, error):
    """Answer with Nav2's result code."""
    response.result = error.code if isinstance(error, MapError) else LoadMap.Response.RESULT_UNDEFINED_FAILURE
