# SPDX-License-Identifier: BSD-3-Clause
# Mesh files, which somebody else wrote: a library without ROS, which Python loads for triangles with
# colors. And where the meshes of models and markers are, for nodes.

find_package(PkgConfig REQUIRED)
pkg_check_modules(assimp REQUIRED IMPORTED_TARGET assimp)

set(mesh_sources src/mesh/mesh_file.cpp)
add_library(process_visualizer_mesh SHARED ${mesh_sources} src/mesh/colored_mesh.cpp)
process_visualizer_compile(process_visualizer_mesh)
target_link_libraries(process_visualizer_mesh process_visualizer_common PkgConfig::assimp)

add_library(process_visualizer_mesh_address src/mesh/mesh_address.cpp)
process_visualizer_compile(process_visualizer_mesh_address)
target_link_libraries(process_visualizer_mesh_address process_visualizer_mesh ${roslib_LIBRARIES})

install(TARGETS process_visualizer_mesh process_visualizer_mesh_address LIBRARY DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION})

if(CATKIN_ENABLE_TESTING)
  catkin_add_gtest(test_mesh_file test/cpp/test_mesh_file.cpp)
  process_visualizer_compile(test_mesh_file)
  target_link_libraries(test_mesh_file process_visualizer_mesh_address)
endif()
