# SPDX-License-Identifier: BSD-3-Clause
"""ROS names shared by several folders; names that only one folder needs are defined there."""

PACKAGE = 'process_visualizer'
"""Name of the package, and of the window's own node."""

CELL_FRAMES = 'cell_frames'  # as in src/recorder/bag_recorder.cpp
SCENE_WATCH = 'scene_watch'
GHOST = 'ghost'
SENSOR_FIT = 'sensor_fit'
BAG_RECORDER = 'bag_recorder'
BAG_PLAYER = 'bag_player'
VIEW_RELAY = 'view_relay'
RVIZ = 'rviz'
"""Name of the node and its program: src/displays/rviz_main.cpp, which replaces that of RViz."""

ROBOT_PROC = 'robot_proc'
JOINT_PROC = 'joint_proc'
DEPTH_PROC = 'depth_proc'
VARIABLE_PROC = 'variable_proc'
ROI_FILTER = 'roi_filter'
FUSION = 'fusion'
OBJECT_FINDER = 'object_finder'
ROBOT_STATE_PUBLISHER = 'robot_state_publisher'
DEVICE_NODES = (ROBOT_PROC, JOINT_PROC, DEPTH_PROC, VARIABLE_PROC, ROI_FILTER,
                FUSION, OBJECT_FINDER, ROBOT_STATE_PUBLISHER)
"""Nodes in the namespace of a device."""

FINDER_OUTPUTS = OBJECTS, OBJECTS_MARKERS, UNKNOWN_POINTS = (
    'objects', 'objects_markers', 'unknown_points')
"""Topics that object_finder publishes below the name of a depth sensor."""

ROBOT_OUTPUTS = ('joint_states', 'tool_velocity', 'tool_force', 'marker_array')
"""Topics that robot_proc and joint_proc publish below the name of a robot."""

OWN_TOPICS = f'/{PACKAGE}/'  # as in src/recorder/bag_recorder.cpp
"""Prefix of the program's own topics and parameters that belong to no node."""
PLAYBACK_RATE = f'{OWN_TOPICS}playback_rate'
"""Parameter with the speed at which a recording is played."""
COMPARISON_TOPIC = f'{OWN_TOPICS}comparison'
"""Topic for the launcher's comparison of the running cell with good runs, as JSON."""
BANDS_TOPIC = f'{OWN_TOPICS}bands'
"""Topic for the bands of good runs around the running cell's last seconds, as JSON."""
PLAYER_STATE_TOPIC = f'/{BAG_PLAYER}/state'
GHOST_TOPIC = f'/{GHOST}/marker_array'
GHOST_PHASE_TOPIC = f'/{GHOST}/phase'
DISPLAY_STATUS_TOPIC = f'/{RVIZ}/display_status'  # published by src/displays
RVIZ_PLACE_TOPIC = f'/{RVIZ}/place'  # subscribed there
RVIZ_COVERED_TOPIC = f'/{RVIZ}/covered'  # subscribed there
RVIZ_CAMERA_TOPIC = f'/{RVIZ}/camera'  # published there
RVIZ_WINDOW_TOPIC = f'/{RVIZ}/window'  # published there
RVIZ_KEYS_TOPIC = f'/{RVIZ}/keys'  # subscribed there
RVIZ_KEY_TOPIC = f'/{RVIZ}/key_pressed'  # published there

TF_TOPIC, STATIC_TF_TOPIC = '/tf', '/tf_static'
RESTORED_TF_TOPIC = '/tf_restored'  # subscribed by src/objects/object_finder_nodelet.cpp
"""Topic with the poses at the recorded time of restored clouds, with the stamps of these clouds."""

JOINT_STATE = 'sensor_msgs/JointState'
DYNAMIC_JOINT_STATE = 'control_msgs/DynamicJointState'
NAMED_JOINTS = (JOINT_STATE, DYNAMIC_JOINT_STATE)
"""Types with joints by name; a message may have only some of a robot's joints."""
FLOAT_ARRAY = 'std_msgs/Float32MultiArray'
POSE_STAMPED = 'geometry_msgs/PoseStamped'
WRENCH_STAMPED = 'geometry_msgs/WrenchStamped'
TF_MESSAGE = 'tf2_msgs/TFMessage'
TF_TYPES = (TF_MESSAGE, 'tf/tfMessage')
"""The second type is that of the old tf, with the same serialization."""

SENSOR_TYPES = frozenset((
    'sensor_msgs/CameraInfo', 'sensor_msgs/CompressedImage', 'sensor_msgs/Image',
    'sensor_msgs/LaserScan', 'sensor_msgs/MultiEchoLaserScan', 'sensor_msgs/PointCloud',
    'sensor_msgs/PointCloud2', 'stereo_msgs/DisparityImage'))
"""Types of messages that show where things were at the time of their stamp."""

SILENT_NODE_KEY, CONCERNED_KEY = 'silent_node', 'concerned'
"""Keys of a status on /diagnostics about a node that does not answer: the node, and its device (''
for a node of the program itself)."""
STALE_POINTS_KEY = 'stale_points'
"""Key of a status on /diagnostics about a sensor that sends no clouds: its device."""
CONFLICT_KEY = 'several_sources'
"""Key of a status on /diagnostics about nodes that contradict each other: topic and problem."""
LIMIT_KEY, EXCESS_KEY, TIMES_KEY = 'beyond_limit', 'beyond_limit_by', 'times'
"""Keys of a status on /diagnostics about a variable beyond its limits: how far it has been, in
words, and how far beyond the limit that is [in its unit]."""
