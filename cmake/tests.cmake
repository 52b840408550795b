# SPDX-License-Identifier: BSD-3-Clause
# catkin_make run_tests: the tests in Python, beside the gtests and rostests, by catkin's own target.
# Each file of test/system and test/gui has a process of its own, as a process is a ROS node only once.

function(process_visualizer_add_pytest name)
  set(results ${CATKIN_TEST_RESULTS_DIR}/${PROJECT_NAME}/pytest-${name}.xml)
  string(REPLACE ";" " " paths "${ARGN}")
  catkin_run_tests_target("pytest" ${name} "pytest-${name}.xml"
    COMMAND "${PYTHON_EXECUTABLE} -m pytest --junitxml=${results} ${paths}"
    WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
endfunction()

process_visualizer_add_pytest(unit test/unit sewing_cell/test/unit)
file(GLOB files RELATIVE ${PROJECT_SOURCE_DIR} test/system/test_*.py test/gui/test_*.py)
foreach(file ${files})
  get_filename_component(name ${file} NAME_WE)
  process_visualizer_add_pytest(${name} ${file})
endforeach()

file(GLOB files RELATIVE ${PROJECT_SOURCE_DIR} test/ros/*.test)
foreach(file ${files})
  add_rostest(${file})
endforeach()
