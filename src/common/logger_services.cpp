// SPDX-License-Identifier: BSD-3-Clause
// Services ~get_loggers and ~set_logger_level, with a limited number of loggers.

#include "process_visualizer/common/logger_services.hpp"

#include <ros/console.h>
#include <ros/console_impl.h>
#include <ros/names.h>
#include <ros/node_handle.h>
#include <ros/service_manager.h>
#include <roscpp/GetLoggers.h>
#include <roscpp/SetLoggerLevel.h>

#include <cctype>
#include <cstddef>
#include <map>
#include <mutex>
#include <set>
#include <stdexcept>
#include <string>

#include "process_visualizer/common/checked_service.hpp"
#include "process_visualizer/common/required_name.hpp"

namespace process_visualizer {
namespace {

using ros::console::levels::Level;

constexpr std::size_t kMaxLoggers = 100;

const std::map<std::string, Level>& levels() {
  static const std::map<std::string, Level> levels = {{"debug", ros::console::levels::Debug},
                                                      {"info", ros::console::levels::Info},
                                                      {"warn", ros::console::levels::Warn},
                                                      {"error", ros::console::levels::Error},
                                                      {"fatal", ros::console::levels::Fatal}};
  return levels;
}

/// The services for the levels of loggers.
class LoggerServices {
 public:
  LoggerServices() {
    for (const char* name : {"~get_loggers", "~set_logger_level"})
      ros::ServiceManager::instance()->unadvertiseService(ros::names::resolve(name));
    get_ = advertiseChecked<roscpp::GetLoggers>(
        node_, "get_loggers", [this](auto&, auto& response) { return tell(response); });
    set_ = advertiseChecked<roscpp::SetLoggerLevel>(
        node_, "set_logger_level", [this](auto& request, auto&) { return set(request); });
  }

 private:
  bool tell(roscpp::GetLoggers::Response& response) {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (const std::string& name : names_) {
      roscpp::Logger logger;
      logger.name = name;
      logger.level = levelOf(name);
      response.loggers.push_back(logger);
    }
    return true;
  }

  /// The lowest level that a logger writes.
  static std::string levelOf(const std::string& name) {
    void* const handle = ros::console::impl::getHandle(name);
    std::string lowest = "fatal";
    Level found = ros::console::levels::Fatal;
    for (const auto& [word, level] : levels()) {
      if (level >= found || !ros::console::impl::isEnabledFor(handle, level)) continue;
      lowest = word;
      found = level;
    }
    return lowest;
  }

  /// Throws std::invalid_argument, which roscpp logs and turns into an error for the caller.
  bool set(const roscpp::SetLoggerLevel::Request& request) {
    std::string word = request.level.substr(0, kMaxNameCharacters);
    for (char& letter : word)
      letter = static_cast<char>(std::tolower(static_cast<unsigned char>(letter)));
    const auto level = levels().find(word);
    if (level == levels().end())
      throw std::invalid_argument("the level must be debug, info, warn, error or fatal");
    requiredName(request.logger);
    const std::lock_guard<std::mutex> lock(mutex_);
    if (names_.size() >= kMaxLoggers && names_.count(request.logger) == 0)
      throw std::invalid_argument("the levels of " + std::to_string(kMaxLoggers) +
                                  " loggers are set; no other can be");
    if (!ros::console::set_logger_level(request.logger, level->second)) return false;
    names_.insert(request.logger);
    ros::console::notifyLoggerLevelsChanged();
    return true;
  }

  ros::NodeHandle node_{"~"};
  std::mutex mutex_;
  std::set<std::string> names_ = {"ros", "ros.process_visualizer", "ros.roscpp",
                                  "ros.roscpp.superdebug"};
  ros::ServiceServer get_, set_;
};

}  // namespace

void replaceLoggerServices() {
  static const auto* const services = new LoggerServices;  // removed by roscpp at its shutdown
  static_cast<void>(services);
}

}  // namespace process_visualizer
