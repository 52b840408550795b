# SPDX-License-Identifier: BSD-3-Clause
"""Names in ROS that several folders share; a name that one folder alone needs stands there."""

PACKAGE = 'process_visualizer'
"""Of the window's own node, too."""

CELL_FRAMES = 'cell_frames'  # as in src/recorder/bag_recorder.cpp
SCENE_WATCH = 'scene_watch'
GHOST = 'ghost'
SENSOR_FIT = 'sensor_fit'
BAG_RECORDER = 'bag_recorder'
BAG_PLAYER = 'bag_player'
VIEW_RELAY = 'view_relay'
RVIZ = 'rviz'
"""The node and its program: src/displays/rviz_main.cpp, in place of the one of the package rviz."""

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
"""In the namespace of a device."""

FINDER_OUTPUTS = OBJECTS, OBJECTS_MARKERS, UNKNOWN_POINTS = (
    'objects', 'objects_markers', 'unknown_points')
"""Topics that object_finder publishes below the name of a depth sensor."""

ROBOT_OUTPUTS = ('joint_states', 'tool_velocity', 'tool_force', 'marker_array')
"""Topics that robot_proc and joint_proc publish below the name of a robot."""

OWN_TOPICS = f'/{PACKAGE}/'  # as in src/recorder/bag_recorder.cpp
"""What the names of our topics and parameters begin with that belong to no node."""
PLAYBACK_RATE = f'{OWN_TOPICS}playback_rate'
"""The parameter that says how fast a recording is played."""
COMPARISON_TOPIC = f'{OWN_TOPICS}comparison'
"""On which the launcher says how the running cell compares with good runs, as JSON."""
PLAYER_STATE_TOPIC = f'/{BAG_PLAYER}/state'
GHOST_TOPIC = f'/{GHOST}/marker_array'
GHOST_PHASE_TOPIC = f'/{GHOST}/phase'
DISPLAY_STATUS_TOPIC = f'/{RVIZ}/display_status'  # published by src/displays
RVIZ_PLACE_TOPIC = f'/{RVIZ}/place'  # subscribed there
RVIZ_CAMERA_TOPIC = f'/{RVIZ}/camera'  # published there
RVIZ_WINDOW_TOPIC = f'/{RVIZ}/window'  # published there
RVIZ_KEYS_TOPIC = f'/{RVIZ}/keys'  # subscribed there
RVIZ_KEY_TOPIC = f'/{RVIZ}/key_pressed'  # published there

TF_TOPIC, STATIC_TF_TOPIC = '/tf', '/tf_static'
RESTORED_TF_TOPIC = '/tf_restored'  # subscribed by src/objects/object_finder_nodelet.cpp
"""Poses with the stamps of what a played sensor has sent, which is older than its stamp says."""

JOINT_STATE = 'sensor_msgs/JointState'
DYNAMIC_JOINT_STATE = 'control_msgs/DynamicJointState'
NAMED_JOINTS = (JOINT_STATE, DYNAMIC_JOINT_STATE)
"""Joints by their names: a message may have only some of a robot's."""
FLOAT_ARRAY = 'std_msgs/Float32MultiArray'
POSE_STAMPED = 'geometry_msgs/PoseStamped'
WRENCH_STAMPED = 'geometry_msgs/WrenchStamped'
TF_MESSAGE = 'tf2_msgs/TFMessage'
TF_TYPES = (TF_MESSAGE, 'tf/tfMessage')
"""The second one is that of the old tf, with the same bytes."""

SENSOR_TYPES = frozenset((
    'sensor_msgs/CameraInfo', 'sensor_msgs/CompressedImage', 'sensor_msgs/Image',
    'sensor_msgs/LaserScan', 'sensor_msgs/MultiEchoLaserScan', 'sensor_msgs/PointCloud',
    'sensor_msgs/PointCloud2', 'stereo_msgs/DisparityImage'))
"""Of messages that show what was at which place at their stamp."""

SILENT_NODE_KEY, CONCERNED_KEY = 'silent_node', 'concerned'
"""Of a status on /diagnostics about a node that does not answer: its name, and that of its device
('' for a node of the program itself)."""
OLD_POINTS_KEY = 'old_points'
"""Of a status on /diagnostics about a sensor of which no cloud comes: its device."""
CONFLICT_KEY = 'several_sources'
"""Of a status on /diagnostics about nodes that contradict each other on one topic: which."""
LIMIT_KEY = 'beyond_limit'
"""Of a status on /diagnostics about a variable beyond its limits: how far it went."""
