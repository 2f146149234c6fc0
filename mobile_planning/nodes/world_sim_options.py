"""Parameters of the node ``world_sim``."""
from __future__ import annotations

from dataclasses import dataclass

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.scene import MAX_ROBOTS
from mobile_planning.nodes.parameters import option


@dataclass(frozen=True)
class WorldSimOptions:
    """Parameters of the node."""

    scene: str = option('', 'YAML file of the scene', read_only=True)
    scene_robots: int = option(0, 'robots the scene is to have, 0 for as many as it says', low=0, high=MAX_ROBOTS,
                               read_only=True)
    out: str = option('', 'folder for report.json and mission.png, empty for none', read_only=True)
    autostart: bool = option(True, 'start as soon as every robot hears every other; else on ~/start', read_only=True)
    discovery_timeout: float = option(60.0, 'robots that are not ready so long after the start was wanted fail the '
                                      'mission [s]', low=0.1, high=3600.0, read_only=True)
    frame_id: str = option('map', 'frame of all poses', read_only=True)

    def __post_init__(self):
        if not self.scene:
            raise InvalidInput('world_sim needs the parameter scene: the YAML file of a scene')
