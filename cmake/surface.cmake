# SPDX-License-Identifier: BSD-3-Clause
# Surfaces of models: shapes and mesh files as triangles, and what is measured on them.

find_package(PCL REQUIRED COMPONENTS common)

# Only Eigen, PCL's points and assimp: no node, no master.
set(surface_sources src/cloud/surface.cpp)
add_library(process_visualizer_surface ${surface_sources})
process_visualizer_compile(process_visualizer_surface)
target_include_directories(process_visualizer_surface SYSTEM PUBLIC ${PCL_INCLUDE_DIRS})
target_link_libraries(process_visualizer_surface process_visualizer_mesh)

install(TARGETS process_visualizer_surface LIBRARY DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION})
