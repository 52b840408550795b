# SPDX-License-Identifier: BSD-3-Clause
# Debian 11 has a rospy that its own Python is too new for; compatibility/rospy says how.

execute_process(
  COMMAND ${PYTHON_EXECUTABLE} -c "import pathlib, threading, rospy.core
calls = 'isAlive()' in pathlib.Path(rospy.core.__file__).read_text()
print(int(calls and not hasattr(threading.Thread, 'isAlive')))"
  OUTPUT_VARIABLE rospy_is_too_old OUTPUT_STRIP_TRAILING_WHITESPACE)
if(rospy_is_too_old EQUAL 1)
  install(FILES compatibility/rospy/sitecustomize.py
    DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION}/rospy)
  catkin_add_env_hooks(50.rospy SHELLS sh DIRECTORY ${PROJECT_SOURCE_DIR}/env-hooks)
endif()
