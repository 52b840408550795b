# SPDX-License-Identifier: BSD-3-Clause
# What the C++ parts share: how they are compiled, and threads' priorities.

# catkin sets no build type; without optimisation the cloud filter is ten times slower.
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE RelWithDebInfo CACHE STRING "Build type" FORCE)
endif()

find_package(Eigen3 REQUIRED)
find_package(Threads REQUIRED)

# Headers of dependencies are SYSTEM, so that warnings are errors in this code only.
function(process_visualizer_compile target)
  target_compile_features(${target} PUBLIC cxx_std_17)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Werror)
  target_include_directories(${target} PUBLIC ${PROJECT_SOURCE_DIR}/include)
  target_include_directories(${target} SYSTEM PUBLIC ${catkin_INCLUDE_DIRS} ${EIGEN3_INCLUDE_DIRS})
endfunction()

add_library(process_visualizer_common SHARED
  src/common/complaint.cpp
  src/common/complaint_status.cpp
  src/common/time_slice.cpp
)
process_visualizer_compile(process_visualizer_common)
target_link_libraries(process_visualizer_common Threads::Threads)

install(TARGETS process_visualizer_common LIBRARY DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION})
install(DIRECTORY include/${PROJECT_NAME}/ DESTINATION ${CATKIN_PACKAGE_INCLUDE_DESTINATION})
