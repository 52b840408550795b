# SPDX-License-Identifier: BSD-3-Clause
# The player's sender: a library without ROS, which Python loads.

set(sender_sources
  src/sender/subscriber_link.cpp src/sender/timed_sender.cpp src/sender/wakeup.cpp)
add_library(process_visualizer_sender SHARED ${sender_sources})
process_visualizer_compile(process_visualizer_sender)
target_link_libraries(process_visualizer_sender process_visualizer_common Threads::Threads)

install(TARGETS process_visualizer_sender LIBRARY DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION})

if(CATKIN_ENABLE_TESTING)
  foreach(name test_sender test_transfer)
    catkin_add_gtest(${name} test/cpp/${name}.cpp)
    process_visualizer_compile(${name})
    target_link_libraries(${name} process_visualizer_sender)

    process_visualizer_add_watched_gtest(${name}_threads threads test/cpp/${name}.cpp
      ${sender_sources} src/common/message_bytes.cpp src/common/time_slice.cpp)
  endforeach()
endif()

# A benchmark: cmake --build build --target bench_sender_load
add_executable(bench_sender_load EXCLUDE_FROM_ALL bench/sender_load.cpp)
process_visualizer_compile(bench_sender_load)
target_link_libraries(bench_sender_load process_visualizer_sender)
