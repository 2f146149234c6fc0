# The environment of everything that runs from .venv; to be sourced: `. launch/environment.sh`.

mobile_planning_root=$(CDPATH='' cd "$(dirname "${BASH_SOURCE[0]:-$0}")/.." && pwd -P)

# Another ROS or another virtual environment of this shell must not be mixed in: the start-up hook of the ROS wheels
# looks for its libraries only where the last variable is not set, and children inherit it.
unset PYTHONPATH PYTHONHOME LD_LIBRARY_PATH _ROS_WHEELS_BOOTSTRAP_COMPLETE

export PATH="$mobile_planning_root/.venv/bin:$PATH"
export AMENT_PREFIX_PATH="$mobile_planning_root/.venv"
export ROS_LOG_DIR="${ROS_LOG_DIR:-$mobile_planning_root/.venv/log/ros}"

# Who can talk to the nodes: `host`, as they do when nothing is said, is nobody outside this host, and a node that finds
# itself within reach of others refuses to start; `subnet` is every host around, which is to have the same domain.
export MOBILE_PLANNING_REACH="${MOBILE_PLANNING_REACH:-host}"
if [ "$MOBILE_PLANNING_REACH" = subnet ]; then
    export ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET
    export FASTDDS_DEFAULT_PROFILES_FILE="$mobile_planning_root/launch/hosts.xml"
else
    export ROS_AUTOMATIC_DISCOVERY_RANGE=SYSTEM_DEFAULT
    export FASTDDS_DEFAULT_PROFILES_FILE="$mobile_planning_root/launch/loopback.xml"
fi
# The field of a way to a goal takes some hundred kilobytes, for as long as the goal. glibc would by and by keep that much
# in each thread for the next one, and the memory of a robot go up and down by 20 MB.
export MALLOC_MMAP_THRESHOLD_="${MALLOC_MMAP_THRESHOLD_:-262144}"

# Two sessions on one host seldom meet.
export ROS_DOMAIN_ID="${ROS_DOMAIN_ID:-$(($$ % 100 + 1))}"

unset mobile_planning_root
