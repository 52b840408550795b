# SPDX-License-Identifier: BSD-3-Clause
# Finding the pose of a sensor: the fit of a cloud to surfaces (no node), and the node sensor_fit.

find_package(PCL REQUIRED COMPONENTS common filters kdtree registration search)

add_library(process_visualizer_fit src/cloud/line_of_sight.cpp src/cloud/pose_fit.cpp)
process_visualizer_compile(process_visualizer_fit)
target_include_directories(process_visualizer_fit SYSTEM PUBLIC ${PCL_INCLUDE_DIRS})
target_link_libraries(process_visualizer_fit process_visualizer_surface ${PCL_LIBRARIES})

add_executable(sensor_fit src/cloud/sensor_fit.cpp)
process_visualizer_compile(sensor_fit)
add_dependencies(sensor_fit ${${PROJECT_NAME}_EXPORTED_TARGETS})
target_link_libraries(sensor_fit process_visualizer_fit process_visualizer_mesh_address
  process_visualizer_node roi_filter ${roscpp_LIBRARIES} ${tf2_ros_LIBRARIES})

install(TARGETS process_visualizer_fit LIBRARY DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION})
install(TARGETS sensor_fit RUNTIME DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})

if(CATKIN_ENABLE_TESTING)
  catkin_add_gtest(test_pose_fit test/cpp/test_pose_fit.cpp)
  process_visualizer_compile(test_pose_fit)
  target_link_libraries(test_pose_fit process_visualizer_fit)
endif()
