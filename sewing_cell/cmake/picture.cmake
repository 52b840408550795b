# SPDX-License-Identifier: BSD-3-Clause
# The pictures of meshes for the simulated Kinects: a library without ROS, which Python loads.
add_library(sewing_cell_picture SHARED
  src/picture/c_interface.cpp
  src/picture/depth_errors.cpp
  src/picture/picture.cpp
)
target_compile_features(sewing_cell_picture PRIVATE cxx_std_17)
target_compile_options(sewing_cell_picture PRIVATE -Wall -Wextra -Werror)

install(TARGETS sewing_cell_picture LIBRARY DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION})
