# SPDX-License-Identifier: BSD-3-Clause
# The recorder: a library without a master, and the node bag_recorder.

find_package(xmlrpcpp REQUIRED)

set(recorder_sources
  src/recorder/bag_file.cpp
  src/recorder/intake.cpp
  src/recorder/message.cpp
  src/recorder/publishers.cpp
  src/recorder/recent_messages.cpp
  src/recorder/recording.cpp
  src/recorder/recording_request.cpp
  src/recorder/topic_choice.cpp
  src/recorder/topic_statistics.cpp
)
set(recorder_libraries
  ${roscpp_LIBRARIES} ${roscpp_serialization_LIBRARIES} ${roslz4_LIBRARIES} ${rostime_LIBRARIES}
  ${xmlrpcpp_LIBRARIES} Threads::Threads)
add_library(process_visualizer_recorder ${recorder_sources})
process_visualizer_compile(process_visualizer_recorder)
target_link_libraries(process_visualizer_recorder ${recorder_libraries})
add_dependencies(process_visualizer_recorder process_visualizer_generate_messages_cpp)

add_executable(bag_recorder src/recorder/bag_recorder.cpp src/recorder/subscriptions.cpp)
process_visualizer_compile(bag_recorder)
target_link_libraries(bag_recorder process_visualizer_recorder process_visualizer_node ${roscpp_LIBRARIES})

install(TARGETS process_visualizer_recorder LIBRARY DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION})
install(TARGETS bag_recorder RUNTIME DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})

add_executable(record_load EXCLUDE_FROM_ALL bench/record_load.cpp)
process_visualizer_compile(record_load)
target_link_libraries(record_load ${roscpp_LIBRARIES})

if(CATKIN_ENABLE_TESTING)
  # What rosbag's own library reads in the recorder's bags, and adds to them.
  find_package(rosbag_storage REQUIRED)

  foreach(test test_recorder test_recorder_figures test_recorder_intake test_recorder_limits test_recorder_memory
          test_recorder_publishers)
    catkin_add_gtest(${test} test/cpp/${test}.cpp)
    process_visualizer_compile(${test})
    target_include_directories(${test} SYSTEM PRIVATE ${rosbag_storage_INCLUDE_DIRS})
    target_link_libraries(${test} process_visualizer_recorder ${rosbag_storage_LIBRARIES})

    process_visualizer_add_watched_gtest(${test}_threads threads test/cpp/${test}.cpp
      ${recorder_sources})
    target_include_directories(${test}_threads SYSTEM PRIVATE ${rosbag_storage_INCLUDE_DIRS})
    target_link_libraries(${test}_threads ${recorder_libraries} ${rosbag_storage_LIBRARIES})
    add_dependencies(${test}_threads process_visualizer_generate_messages_cpp)
  endforeach()

  add_executable(append_to_bag EXCLUDE_FROM_ALL test/cpp/append_to_bag.cpp)
  process_visualizer_compile(append_to_bag)
  target_link_libraries(append_to_bag ${rosbag_storage_LIBRARIES} ${roscpp_LIBRARIES})
  add_dependencies(tests append_to_bag)

  add_executable(copy_recent_benchmark EXCLUDE_FROM_ALL bench/copy_recent.cpp)
  process_visualizer_compile(copy_recent_benchmark)
  target_link_libraries(copy_recent_benchmark
    process_visualizer_recorder ${rosbag_storage_LIBRARIES} ${roscpp_LIBRARIES})
endif()
