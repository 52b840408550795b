# SPDX-License-Identifier: BSD-3-Clause
# Mesh files as triangles with colors: a library without ROS, which Python loads.

add_library(process_visualizer_mesh SHARED src/mesh/colored_mesh.cpp)
process_visualizer_compile(process_visualizer_mesh)
target_link_libraries(process_visualizer_mesh PkgConfig::assimp)

install(TARGETS process_visualizer_mesh LIBRARY DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION})
