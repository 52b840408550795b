# SPDX-License-Identifier: BSD-3-Clause
# The RViz display that reports on all displays.

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
  src/displays/display_report.cpp
  src/displays/display_silence.cpp
  src/displays/display_status.cpp
)
process_visualizer_compile(process_visualizer_rviz)
target_link_libraries(process_visualizer_rviz ${rviz_LIBRARIES} ${rviz_qt}::Widgets)

install(TARGETS process_visualizer_rviz LIBRARY DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION})
