# SPDX-License-Identifier: BSD-3-Clause
# What feeds the C++ parts with bad input; fuzz/run.py does the same for those in Python.

if(CATKIN_ENABLE_TESTING)
  add_executable(fuzz_readers EXCLUDE_FROM_ALL fuzz/readers.cpp
    src/common/message_bytes.cpp
    src/common/xml_walk.cpp
    src/joints/joint_message.cpp
    src/recorder/message.cpp
    src/recorder/publishers.cpp
    src/recorder/topic_choice.cpp
    src/recorder/topic_statistics.cpp)
  process_visualizer_watch(fuzz_readers memory)
  add_dependencies(fuzz_readers process_visualizer_generate_messages_cpp)
  set_target_properties(fuzz_readers PROPERTIES UNITY_BUILD OFF)  # its sources are of several targets
  target_compile_options(fuzz_readers PRIVATE -Wno-maybe-uninitialized)  # GCC, of its own <regex>
  target_link_libraries(fuzz_readers EXPAT::EXPAT ${roscpp_LIBRARIES} ${roscpp_serialization_LIBRARIES}
    ${rostime_LIBRARIES} ${xmlrpcpp_LIBRARIES})
endif()
