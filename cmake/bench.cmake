# SPDX-License-Identifier: BSD-3-Clause
# Programs that benchmarks build when they run: the subscriber of bench/arrival_recorder.py.

add_executable(bench_arrivals EXCLUDE_FROM_ALL bench/arrivals.cpp)
process_visualizer_compile(bench_arrivals)
add_dependencies(bench_arrivals ${${PROJECT_NAME}_EXPORTED_TARGETS})
target_include_directories(bench_arrivals SYSTEM PRIVATE
  ${CATKIN_DEVEL_PREFIX}/${CATKIN_GLOBAL_INCLUDE_DESTINATION})
target_link_libraries(bench_arrivals ${roscpp_LIBRARIES})

# A camera in a nodelet manager: bench/depth.py builds it.
add_executable(bench_camera_manager EXCLUDE_FROM_ALL bench/camera_manager.cpp)
process_visualizer_compile(bench_camera_manager)
target_link_libraries(bench_camera_manager ${nodelet_LIBRARIES} ${roscpp_LIBRARIES})
