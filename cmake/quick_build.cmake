# SPDX-License-Identifier: BSD-3-Clause
# A quicker build of everything: the sources of a target are compiled as one, because most of the time
# goes into the headers of ROS, PCL and RViz. Two sources of a target then cannot have the same name in
# their anonymous namespaces; the compiler says so.

option(PROCESS_VISUALIZER_QUICK_BUILD "Compile the sources of a target as one" OFF)
if(PROCESS_VISUALIZER_QUICK_BUILD)
  set(CMAKE_UNITY_BUILD ON)
  set(CMAKE_UNITY_BUILD_BATCH_SIZE 16)
  file(GLOB files ${PROJECT_SOURCE_DIR}/test/cpp/*.cpp)  # as if they knew nothing of what they test
  set_source_files_properties(${files} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
endif()
