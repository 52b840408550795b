# SPDX-License-Identifier: BSD-3-Clause
# kinect_roi: the nodelet process_visualizer/RoiFilter in a process of its own.
add_executable(kinect_roi src/kinect_roi.cpp)
target_compile_features(kinect_roi PRIVATE cxx_std_17)
target_compile_options(kinect_roi PRIVATE -Wall -Wextra -Werror)
target_include_directories(kinect_roi SYSTEM PRIVATE ${catkin_INCLUDE_DIRS})
target_link_libraries(kinect_roi ${catkin_LIBRARIES})

install(TARGETS kinect_roi RUNTIME DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
