# The C++ part: the cloud filter (a library), the nodelet around it, and the RViz plugin.

# catkin sets no build type; without optimisation the filter is ten times slower.
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE RelWithDebInfo CACHE STRING "Build type" FORCE)
endif()

find_package(Eigen3 REQUIRED)

# A plugin must have the Qt of its RViz, which says nowhere which one that is: Debian 13 has 6.
set(rviz_library ${rviz_LIBRARIES})
list(FILTER rviz_library INCLUDE REGEX "/librviz\\.so")
execute_process(COMMAND ${CMAKE_OBJDUMP} -p ${rviz_library} OUTPUT_VARIABLE rviz_dependencies)
if(rviz_dependencies MATCHES "libQt([0-9]+)Widgets")
  set(rviz_qt Qt${CMAKE_MATCH_1})
else()
  set(rviz_qt Qt5)
endif()
find_package(${rviz_qt} REQUIRED COMPONENTS Widgets)

# Headers of dependencies are SYSTEM, so that warnings are errors in this code only.
function(process_visualizer_compile target)
  target_compile_features(${target} PUBLIC cxx_std_17)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Werror)
  target_include_directories(${target} PUBLIC ${PROJECT_SOURCE_DIR}/include)
  target_include_directories(${target} SYSTEM PUBLIC ${catkin_INCLUDE_DIRS} ${EIGEN3_INCLUDE_DIRS})
endfunction()

# Only message classes and Eigen: no node, no master.
add_library(roi_filter src/cloud/roi_filter.cpp)
process_visualizer_compile(roi_filter)
target_link_libraries(roi_filter ${roscpp_serialization_LIBRARIES} ${rostime_LIBRARIES})

add_library(process_visualizer_nodelets
  src/cloud/roi_filter_nodelet.cpp
  src/cloud/roi_parameters.cpp
)
process_visualizer_compile(process_visualizer_nodelets)
target_link_libraries(process_visualizer_nodelets
  roi_filter ${nodelet_LIBRARIES} ${roscpp_LIBRARIES} ${tf2_ros_LIBRARIES})

add_library(process_visualizer_rviz
  src/rviz/display_report.cpp
  src/rviz/display_silence.cpp
  src/rviz/display_status.cpp
)
process_visualizer_compile(process_visualizer_rviz)
target_link_libraries(process_visualizer_rviz ${rviz_LIBRARIES} ${rviz_qt}::Widgets)

install(TARGETS roi_filter process_visualizer_nodelets process_visualizer_rviz
  LIBRARY DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION}
)
install(DIRECTORY include/${PROJECT_NAME}/ DESTINATION ${CATKIN_PACKAGE_INCLUDE_DESTINATION})

if(CATKIN_ENABLE_TESTING)
  # PCL's own box filter is what the test compares with.
  find_package(PCL REQUIRED COMPONENTS common filters)
  catkin_add_gtest(test_roi_filter test/cpp/test_roi_filter.cpp)
  process_visualizer_compile(test_roi_filter)
  target_include_directories(test_roi_filter SYSTEM PRIVATE ${PCL_INCLUDE_DIRS})
  target_link_libraries(test_roi_filter roi_filter ${PCL_LIBRARIES})

  add_executable(roi_filter_benchmark EXCLUDE_FROM_ALL bench/roi_filter.cpp)
  process_visualizer_compile(roi_filter_benchmark)
  target_link_libraries(roi_filter_benchmark roi_filter)
endif()
