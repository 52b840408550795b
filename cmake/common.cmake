# SPDX-License-Identifier: BSD-3-Clause
# What the C++ parts share: how they are compiled, and threads' priorities.

# catkin sets no build type; without optimization the cloud filter is ten times slower.
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE RelWithDebInfo CACHE STRING "Build type" FORCE)
endif()

find_package(Eigen3 REQUIRED)
find_package(EXPAT REQUIRED)
find_package(Threads REQUIRED)

# Headers of dependencies are SYSTEM, so that warnings are errors in this code only.
function(process_visualizer_compile target)
  target_compile_features(${target} PUBLIC cxx_std_17)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Werror)
  target_include_directories(${target} PUBLIC ${PROJECT_SOURCE_DIR}/include)
  target_include_directories(${target} SYSTEM PUBLIC ${catkin_INCLUDE_DIRS} ${EIGEN3_INCLUDE_DIRS})
endfunction()

if(CATKIN_ENABLE_TESTING)
  # Two kinds of sanitizers, which one program cannot have both: for memory and undefined operations,
  # and for threads. Their malloc aligns as glibc's does, which Eigen does not know; PCL's libraries
  # must agree with it.
  set(memory_sanitizers -fsanitize=address,undefined -fno-sanitize-recover=all)
  set(threads_sanitizers -fsanitize=thread)
  set(watched -O1 -g -DEIGEN_MALLOC_ALREADY_ALIGNED=1 ${memory_sanitizers})

  # A program with its sources compiled once more, which takes long: not among the tests, but built by
  # the target `sanitized`, in a folder of its own. KIND: memory or threads.
  add_custom_target(sanitized)
  function(process_visualizer_watch target kind)
    process_visualizer_compile(${target})
    set_target_properties(${target} PROPERTIES RUNTIME_OUTPUT_DIRECTORY
      ${CATKIN_DEVEL_PREFIX}/lib/sanitized)
    target_compile_options(${target} PRIVATE
      -O1 -g -DEIGEN_MALLOC_ALREADY_ALIGNED=1 ${${kind}_sanitizers})
    target_link_libraries(${target} ${${kind}_sanitizers})
    add_dependencies(sanitized ${target})
  endfunction()

  function(process_visualizer_add_watched_gtest target kind)
    catkin_add_executable_with_gtest(${target} ${ARGN} EXCLUDE_FROM_ALL)
    process_visualizer_watch(${target} ${kind})
  endfunction()
endif()

add_library(process_visualizer_common SHARED
  src/common/complaint.cpp src/common/message_bytes.cpp src/common/time_slice.cpp
  src/common/xml_walk.cpp)
process_visualizer_compile(process_visualizer_common)
target_link_libraries(process_visualizer_common Threads::Threads EXPAT::EXPAT)

# What only nodes need: the rest has no roscpp.
add_library(process_visualizer_node SHARED src/common/logger_services.cpp)
process_visualizer_compile(process_visualizer_node)
target_link_libraries(process_visualizer_node process_visualizer_common ${roscpp_LIBRARIES})

install(TARGETS process_visualizer_common process_visualizer_node
  LIBRARY DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION})
install(DIRECTORY include/${PROJECT_NAME}/ DESTINATION ${CATKIN_PACKAGE_INCLUDE_DESTINATION})

if(CATKIN_ENABLE_TESTING)
  catkin_add_gtest(test_claimed_lengths test/cpp/test_claimed_lengths.cpp)
  process_visualizer_compile(test_claimed_lengths)
  target_link_libraries(test_claimed_lengths process_visualizer_common ${roscpp_LIBRARIES})
endif()
