// SPDX-License-Identifier: BSD-3-Clause
// Saves and loads RViz's camera as YAML; refuses unknown classes.

#include "camera.hpp"

#include <rviz/view_controller.h>
#include <rviz/view_manager.h>
#include <rviz/yaml_config_reader.h>
#include <rviz/yaml_config_writer.h>

#include <memory>

namespace process_visualizer::displays {

std::string cameraText(const rviz::ViewManager& views) {
  const rviz::ViewController* camera = views.getCurrent();
  if (!camera) return "";
  const rviz::Config config;
  camera->save(config);
  return rviz::YamlConfigWriter().writeString(config).toStdString();
}

QString adoptCamera(const std::string& text, rviz::ViewManager& views) {
  rviz::Config config;
  rviz::YamlConfigReader reader;
  reader.readString(config, QString::fromStdString(text));
  if (reader.error()) return reader.errorMessage();
  QString type;
  if (!config.mapGetString("Class", &type)) return "it has no class";
  // For an unknown class RViz would create a camera that only shows an error window.
  if (!views.getFactory()->getDeclaredClassIds().contains(type)) return "no class " + type;
  const std::unique_ptr<rviz::ViewController> camera(views.create(type));
  camera->load(config);
  views.setCurrentFrom(camera.get());
  return "";
}

}  // namespace process_visualizer::displays
