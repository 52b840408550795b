# SPDX-License-Identifier: BSD-3-Clause
# The joint processor: which position belongs to which joint (no node), and the node joint_proc.

add_library(process_visualizer_joints src/joints/joint_board.cpp src/joints/joint_message.cpp)
process_visualizer_compile(process_visualizer_joints)
target_link_libraries(process_visualizer_joints process_visualizer_common)

add_executable(joint_proc src/joints/joint_processor.cpp)
process_visualizer_compile(joint_proc)
target_link_libraries(joint_proc process_visualizer_joints process_visualizer_node
  ${roscpp_LIBRARIES})

install(TARGETS process_visualizer_joints LIBRARY DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION})
install(TARGETS joint_proc RUNTIME DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})

if(CATKIN_ENABLE_TESTING)
  catkin_add_gtest(test_joints test/cpp/test_joints.cpp)
  process_visualizer_compile(test_joints)
  target_link_libraries(test_joints process_visualizer_joints process_visualizer_common)
endif()
