# SPDX-License-Identifier: BSD-3-Clause
# The cloud filters (libraries) and the nodelets around them.

# Only message classes and Eigen: no node, no master.
set(cloud_sources
  src/cloud/box.cpp
  src/cloud/cloud_layout.cpp
  src/cloud/fused_clouds.cpp
  src/cloud/pixel_rays.cpp
  src/cloud/registered_crop.cpp
  src/cloud/roi_filter.cpp
  src/cloud/voxel_grid.cpp
)
add_library(roi_filter ${cloud_sources})
process_visualizer_compile(roi_filter)
target_link_libraries(roi_filter ${roscpp_serialization_LIBRARIES} ${rostime_LIBRARIES})

add_library(process_visualizer_nodelets
  src/cloud/cloud_fusion_nodelet.cpp src/cloud/crop_nodelets.cpp)
process_visualizer_compile(process_visualizer_nodelets)
add_dependencies(process_visualizer_nodelets process_visualizer_generate_messages_cpp)
target_link_libraries(process_visualizer_nodelets
  roi_filter process_visualizer_node ${image_transport_LIBRARIES} ${message_filters_LIBRARIES} ${nodelet_LIBRARIES}
  ${roscpp_LIBRARIES} ${tf2_ros_LIBRARIES})

install(TARGETS roi_filter process_visualizer_nodelets
  LIBRARY DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION}
)

if(CATKIN_ENABLE_TESTING)
  # PCL's own box filter is what the test compares with.
  find_package(PCL REQUIRED COMPONENTS common filters)
  catkin_add_gtest(test_roi_filter test/cpp/test_roi_filter.cpp)
  process_visualizer_compile(test_roi_filter)
  target_include_directories(test_roi_filter SYSTEM PRIVATE ${PCL_INCLUDE_DIRS})
  target_link_libraries(test_roi_filter roi_filter ${PCL_LIBRARIES})

  catkin_add_gtest(test_registered_crop test/cpp/test_registered_crop.cpp)
  process_visualizer_compile(test_registered_crop)
  target_link_libraries(test_registered_crop roi_filter)

  catkin_add_gtest(test_cloud_fusion test/cpp/test_cloud_fusion.cpp)
  process_visualizer_compile(test_cloud_fusion)
  target_include_directories(test_cloud_fusion SYSTEM PRIVATE ${PCL_INCLUDE_DIRS})
  target_link_libraries(test_cloud_fusion roi_filter ${PCL_LIBRARIES})

  # The sources once more, watched: every access to a byte that is not there, and every undefined
  # operation, ends the test.
  add_library(roi_filter_watched OBJECT EXCLUDE_FROM_ALL ${cloud_sources})
  process_visualizer_compile(roi_filter_watched)
  target_compile_options(roi_filter_watched PRIVATE ${watched})

  process_visualizer_add_watched_gtest(test_bad_images memory test/cpp/test_bad_images.cpp
    $<TARGET_OBJECTS:roi_filter_watched>)
  target_link_libraries(test_bad_images ${roscpp_serialization_LIBRARIES} ${rostime_LIBRARIES})

  foreach(name roi_filter registered_crop voxel_grid)
    add_executable(${name}_benchmark EXCLUDE_FROM_ALL bench/${name}.cpp)
    process_visualizer_compile(${name}_benchmark)
    target_include_directories(${name}_benchmark SYSTEM PRIVATE ${PCL_INCLUDE_DIRS})
    target_link_libraries(${name}_benchmark roi_filter ${PCL_LIBRARIES})
  endforeach()
endif()
