# SPDX-License-Identifier: BSD-3-Clause
# What nobody modeled: models taken out of clouds, objects in what remains, and the nodelet.

find_package(PCL REQUIRED COMPONENTS common kdtree)

# Only message classes, PCL and Eigen: no node, no master.
set(objects_sources
  src/objects/assignment.cpp
  src/objects/clusters.cpp
  src/objects/distance_field.cpp
  src/objects/known_bodies.cpp
  src/objects/motion.cpp
  src/objects/object_finder.cpp
  src/objects/object_messages.cpp
  src/objects/object_tracks.cpp
  src/objects/point_image.cpp
  src/objects/support_planes.cpp
  src/objects/walls.cpp
)
set(objects_libraries
  ${PCL_LIBRARIES} ${urdf_LIBRARIES} ${roscpp_serialization_LIBRARIES}
  ${rostime_LIBRARIES})

add_library(process_visualizer_objects ${objects_sources})
process_visualizer_compile(process_visualizer_objects)
target_include_directories(process_visualizer_objects SYSTEM PUBLIC ${PCL_INCLUDE_DIRS})
target_link_libraries(process_visualizer_objects
  process_visualizer_surface roi_filter ${objects_libraries})
add_dependencies(process_visualizer_objects process_visualizer_generate_messages_cpp)

target_sources(process_visualizer_nodelets PRIVATE
  src/objects/object_finder_nodelet.cpp
)
target_link_libraries(process_visualizer_nodelets
  process_visualizer_objects process_visualizer_mesh_address)

install(TARGETS process_visualizer_objects
  LIBRARY DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION}
)

if(CATKIN_ENABLE_TESTING)
  foreach(test test_object_finder test_object_geometry test_object_occlusions test_object_tracks)
    catkin_add_gtest(${test} test/cpp/${test}.cpp)
    process_visualizer_compile(${test})
    target_link_libraries(${test} process_visualizer_objects)
  endforeach()

  # Bad clouds where every access to a byte that is not there, and every undefined operation, ends
  # the test. The sources are compiled into it, so that they are watched as well.
  process_visualizer_add_watched_gtest(test_bad_objects memory test/cpp/test_bad_objects.cpp
    src/common/xml_walk.cpp ${mesh_sources} ${surface_sources} ${objects_sources}
    $<TARGET_OBJECTS:roi_filter_watched>)
  target_include_directories(test_bad_objects SYSTEM PRIVATE ${PCL_INCLUDE_DIRS})
  target_link_libraries(test_bad_objects EXPAT::EXPAT PkgConfig::assimp ${objects_libraries})
  add_dependencies(test_bad_objects process_visualizer_generate_messages_cpp)
endif()

# A benchmark: cmake --build build --target objects_benchmark
add_executable(objects_benchmark EXCLUDE_FROM_ALL bench/objects.cpp)
process_visualizer_compile(objects_benchmark)
target_link_libraries(objects_benchmark process_visualizer_objects)

# Another one, with the scenes and sensors of bench/sensed_world.hpp; bench/watch.py builds it.
# The plain pipeline beside it needs more of PCL.
add_executable(watch_benchmark EXCLUDE_FROM_ALL bench/watch.cpp)
process_visualizer_compile(watch_benchmark)
target_link_libraries(watch_benchmark
  process_visualizer_objects pcl_segmentation pcl_filters pcl_search pcl_sample_consensus)

# The clouds for scripts/take_objects_film, which builds it.
add_executable(walk_in_clouds EXCLUDE_FROM_ALL bench/walk_in.cpp)
process_visualizer_compile(walk_in_clouds)
target_link_libraries(walk_in_clouds process_visualizer_objects)

# A renderer that shares nothing with bench/sensed_world.hpp, so that neither proves itself.
add_executable(other_scenes_benchmark EXCLUDE_FROM_ALL bench/other_scenes.cpp)
process_visualizer_compile(other_scenes_benchmark)
target_link_libraries(other_scenes_benchmark process_visualizer_objects)
