// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/objects/finder_parameters.hpp"

#include <cmath>

#include "process_visualizer/cloud/require.hpp"
#include "process_visualizer/common/frame_name.hpp"

namespace process_visualizer::objects {
namespace {

using cloud::require;
using XmlRpc::XmlRpcValue;

/// Reads values, and says in each problem where they stand.
class Reader {
 public:
  explicit Reader(const ros::NodeHandle& node_handle) : node_handle_(node_handle) {}

  double positive(const std::string& name, double fallback) const {
    double value = fallback;
    const bool is_number = node_handle_.getParam(name, value) || !node_handle_.hasParam(name);
    require(is_number && std::isfinite(value) && value > 0,
            place(name) + " must be a number greater than zero");
    return value;
  }

  std::optional<double> optionalPositive(const std::string& name) const {
    if (!node_handle_.hasParam(name)) return std::nullopt;
    return positive(name, 0);
  }

  std::string frame(const std::string& name) const {
    std::string value;
    require(node_handle_.getParam(name, value) && !value.empty(),
            place(name) + " must be a frame's name");
    return withoutLeadingSlash(value);
  }

  std::vector<std::string> names(const std::string& name) const {
    std::vector<std::string> value;
    require(node_handle_.getParam(name, value) || !node_handle_.hasParam(name),
            place(name) + " must be a list of names of devices");
    return value;
  }

  std::vector<FramedBox> boxes(const std::string& name) const {
    XmlRpcValue value;
    std::vector<FramedBox> boxes;
    if (!node_handle_.getParam(name, value)) return boxes;
    require(value.getType() == XmlRpcValue::TypeArray, place(name) + " must be a list of boxes");
    for (int number = 0; number < value.size(); ++number)
      boxes.push_back(box(value[number], place(name) + "[" + std::to_string(number) + "]"));
    return boxes;
  }

 private:
  std::string place(const std::string& name) const {
    return "parameter " + node_handle_.resolveName(name);
  }

  static FramedBox box(XmlRpcValue& value, const std::string& place) {
    require(value.getType() == XmlRpcValue::TypeStruct && value.hasMember("frame") &&
                value["frame"].getType() == XmlRpcValue::TypeString,
            place + " must have a frame's name, a center and a size");
    try {
      return {withoutLeadingSlash(value["frame"]),
              cloud::Box(vector(value, "center"), vector(value, "size"))};
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(place + ": " + error.what());
    }
  }

  static Eigen::Vector3d vector(XmlRpcValue& box, const std::string& name) {
    const std::string problem = name + " must be three numbers in m";
    require(box.hasMember(name) && box[name].getType() == XmlRpcValue::TypeArray &&
                box[name].size() == 3,
            problem);
    Eigen::Vector3d vector;
    for (int axis = 0; axis < 3; ++axis) {
      XmlRpcValue& number = box[name][axis];
      require(
          number.getType() == XmlRpcValue::TypeInt || number.getType() == XmlRpcValue::TypeDouble,
          problem);
      vector[axis] = number.getType() == XmlRpcValue::TypeInt ? static_cast<int>(number)
                                                              : static_cast<double>(number);
    }
    return vector;
  }

  const ros::NodeHandle& node_handle_;
};

FinderSettings settingsOf(const Reader& reader) {
  FinderSettings settings;
  settings.padding = static_cast<float>(reader.positive("padding", settings.padding));
  settings.gap = static_cast<float>(reader.positive("gap", settings.gap));
  settings.surface = static_cast<float>(reader.positive("surface", settings.surface));
  settings.fewest = static_cast<std::size_t>(
      reader.positive("fewest_points", static_cast<double>(settings.fewest)));
  if (const auto noise = reader.optionalPositive("noise"))
    settings.noise = DepthNoise{static_cast<float>(*noise)};
  return settings;
}

}  // namespace

FinderParameters readFinderParameters(const ros::NodeHandle& node_handle) {
  const Reader reader(node_handle);
  const std::vector<FramedBox> regions = reader.boxes("region");
  require(regions.size() < 2, "parameter " + node_handle.resolveName("region") +
                                  " must be a list of one box, or empty");
  return {reader.frame("frame"),    reader.names("robots"),
          reader.names("others"),   regions.empty() ? std::nullopt : std::optional(regions.front()),
          reader.boxes("expected"), {reader.positive("warn", 0.5), reader.positive("stop", 0.2)},
          settingsOf(reader)};
}

}  // namespace process_visualizer::objects
