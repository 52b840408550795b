# SPDX-License-Identifier: BSD-3-Clause
# The benchmark of many robots: their drivers and a stopwatch, in C++ so that they cost little.

if(CATKIN_ENABLE_TESTING)
  find_package(tf2_msgs REQUIRED)
  add_executable(robots_driver EXCLUDE_FROM_ALL bench/robots_driver.cpp)
  process_visualizer_compile(robots_driver)
  target_include_directories(robots_driver SYSTEM PRIVATE ${tf2_msgs_INCLUDE_DIRS})
  target_link_libraries(robots_driver process_visualizer_common ${roscpp_LIBRARIES})
  add_dependencies(tests robots_driver)
endif()
