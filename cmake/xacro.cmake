# SPDX-License-Identifier: BSD-3-Clause
# Other people's launch files call $(find xacro)/xacro, or xacro. Where ROS has no package of this
# name (Debian), the folder compatibility/xacro is one. It needs xacro from the Python package index.

find_package(xacro QUIET)
if(NOT xacro_FOUND AND NOT DEFINED xacro_SOURCE_DIR)
  catkin_install_python(PROGRAMS compatibility/xacro/xacro DESTINATION lib/xacro)
  catkin_install_python(PROGRAMS compatibility/xacro/xacro
    DESTINATION ${CATKIN_GLOBAL_BIN_DESTINATION})
  install(FILES compatibility/xacro/package.xml
    DESTINATION ${CATKIN_GLOBAL_SHARE_DESTINATION}/xacro)
  catkin_add_env_hooks(50.xacro SHELLS sh DIRECTORY ${PROJECT_SOURCE_DIR}/env-hooks)
endif()
