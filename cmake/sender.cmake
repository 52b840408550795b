# The player's sender: a library without ROS, which Python loads.

find_package(Threads REQUIRED)

add_library(process_visualizer_sender SHARED
  src/sender/agenda.cpp
  src/sender/c_interface.cpp
  src/sender/packet.cpp
  src/sender/subscriber_link.cpp
  src/sender/time_slice.cpp
  src/sender/timed_sender.cpp
  src/sender/transfer.cpp
  src/sender/wakeup.cpp
)
process_visualizer_compile(process_visualizer_sender)
target_link_libraries(process_visualizer_sender Threads::Threads)

install(TARGETS process_visualizer_sender LIBRARY DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION})

if(CATKIN_ENABLE_TESTING)
  catkin_add_gtest(test_sender tests/cpp/test_sender.cpp)
  process_visualizer_compile(test_sender)
  target_link_libraries(test_sender process_visualizer_sender)
endif()
