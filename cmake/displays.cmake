# SPDX-License-Identifier: BSD-3-Clause
# The RViz displays: one reports on all displays, one draws markers with readable texts, one says that
# a scene is a replay; and RViz itself, started so that it does not end while it starts.

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

add_library(process_visualizer_rviz
  src/displays/camera.cpp
  src/displays/display_status.cpp
  src/displays/key_report.cpp
  src/displays/label_layer.cpp
  src/displays/label_layout.cpp
  src/displays/label_plate.cpp
  src/displays/label_store.cpp
  src/displays/labeled_markers.cpp
  src/displays/overlay.cpp
  src/displays/placed_robot_model.cpp
  src/displays/replay_band.cpp
  src/displays/replay_text.cpp
  src/displays/replay_window.cpp
)
process_visualizer_compile(process_visualizer_rviz)
add_dependencies(process_visualizer_rviz process_visualizer_generate_messages_cpp)
target_link_libraries(process_visualizer_rviz
  ${rviz_LIBRARIES} ${rviz_DEFAULT_PLUGIN_LIBRARIES} ${rviz_qt}::Widgets)

install(TARGETS process_visualizer_rviz LIBRARY DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION})

find_package(OpenGL REQUIRED)
find_package(X11 REQUIRED)
add_executable(process_visualizer_rviz_main src/displays/rviz_main.cpp)
set_target_properties(process_visualizer_rviz_main PROPERTIES OUTPUT_NAME rviz)
process_visualizer_compile(process_visualizer_rviz_main)
target_link_libraries(process_visualizer_rviz_main
  process_visualizer_node ${rviz_LIBRARIES} ${rviz_qt}::Widgets ${OPENGL_gl_LIBRARY} ${X11_X11_LIB})

install(TARGETS process_visualizer_rviz_main RUNTIME DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})

if(CATKIN_ENABLE_TESTING)
  catkin_add_gtest(test_labels test/cpp/test_labels.cpp
    src/displays/label_layout.cpp src/displays/label_plate.cpp src/displays/label_store.cpp)
  process_visualizer_compile(test_labels)
  target_include_directories(test_labels PRIVATE ${PROJECT_SOURCE_DIR}/src/displays)
  target_link_libraries(test_labels ${rviz_qt}::Widgets ${roscpp_LIBRARIES})

  catkin_add_gtest(test_key_names test/cpp/test_key_names.cpp src/displays/key_report.cpp)
  process_visualizer_compile(test_key_names)
  target_include_directories(test_key_names PRIVATE ${PROJECT_SOURCE_DIR}/src/displays)
  target_link_libraries(test_key_names ${rviz_qt}::Widgets ${roscpp_LIBRARIES})

  catkin_add_gtest(test_replay_text test/cpp/test_replay_text.cpp src/displays/replay_text.cpp)
  process_visualizer_compile(test_replay_text)
  target_include_directories(test_replay_text PRIVATE ${PROJECT_SOURCE_DIR}/src/displays)
endif()

# A benchmark: cmake --build build --target bench_labels
add_executable(bench_labels EXCLUDE_FROM_ALL bench/labels.cpp
  src/displays/label_layout.cpp src/displays/label_plate.cpp)
process_visualizer_compile(bench_labels)
target_include_directories(bench_labels PRIVATE ${PROJECT_SOURCE_DIR}/src/displays)
target_link_libraries(bench_labels ${rviz_qt}::Widgets)
