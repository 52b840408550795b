# SPDX-License-Identifier: BSD-3-Clause
# Pluginlib searches the lib folders of workspaces for libraries. Debian 11 has depth_image_proc's
# library elsewhere; so the lib folder of this workspace gets a link to it.

find_package(depth_image_proc QUIET)
find_library(depth_image_proc_library depth_image_proc)
if(depth_image_proc_FOUND AND depth_image_proc_library)
  file(STRINGS "${depth_image_proc_PREFIX}/share/depth_image_proc/nodelet_plugins.xml" plugin
    REGEX "<library path=\"lib/")
  get_filename_component(folder "${depth_image_proc_library}" DIRECTORY)
  if(plugin AND NOT folder MATCHES "/lib$")
    set(link "${CATKIN_DEVEL_PREFIX}/lib/libdepth_image_proc.so")
    file(MAKE_DIRECTORY "${CATKIN_DEVEL_PREFIX}/lib")
    execute_process(
      COMMAND ${CMAKE_COMMAND} -E create_symlink "${depth_image_proc_library}" "${link}")
    install(FILES "${link}" DESTINATION ${CATKIN_GLOBAL_LIB_DESTINATION})
  endif()
endif()
