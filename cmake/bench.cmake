# SPDX-License-Identifier: BSD-3-Clause
# The benchmarks' subscriber: bench/arrival_recorder.py builds it when a benchmark runs.

add_executable(bench_arrivals EXCLUDE_FROM_ALL bench/arrivals.cpp)
process_visualizer_compile(bench_arrivals)
add_dependencies(bench_arrivals ${${PROJECT_NAME}_EXPORTED_TARGETS})
target_include_directories(bench_arrivals SYSTEM PRIVATE
  ${CATKIN_DEVEL_PREFIX}/${CATKIN_GLOBAL_INCLUDE_DESTINATION})
target_link_libraries(bench_arrivals ${roscpp_LIBRARIES})
