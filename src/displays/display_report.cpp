// SPDX-License-Identifier: BSD-3-Clause
#include "display_report.hpp"

#include <rviz/display.h>
#include <rviz/display_group.h>
#include <rviz/properties/status_list.h>

#include <algorithm>

#include "display_silence.hpp"

namespace process_visualizer::displays {
namespace {

using diagnostic_msgs::DiagnosticStatus;
using diagnostic_msgs::KeyValue;

KeyValue keyValue(const std::string& key, const std::string& value) {
  KeyValue entry;
  entry.key = key;
  entry.value = value;
  return entry;
}

/// Adds one line of a display's status; the report's level becomes the worst of its lines.
void addLine(const std::string& name, rviz::StatusProperty::Level level, const std::string& text,
             DiagnosticStatus& report) {
  report.values.push_back(
      keyValue(name, rviz::StatusProperty::statusWord(level).toStdString() + ": " + text));
  if (level == rviz::StatusProperty::Ok) return;
  report.level = std::max<int>(report.level, level);
  report.message += (report.message.empty() ? "" : "; ") + name + ": " + text;
}

/// Adds the lines that RViz shows, but for our own: what it shows of that may be an update old.
void addLines(const rviz::StatusList& list, DiagnosticStatus& report) {
  for (int i = 0; i < list.numChildren(); ++i) {
    const auto* line = dynamic_cast<const rviz::StatusProperty*>(list.childAt(i));
    if (!line || line->getNameStd() == kSilenceName) continue;
    addLine(line->getNameStd(), line->getLevel(), line->getValue().toString().toStdString(),
            report);
  }
}

}  // namespace

DiagnosticStatus reportDisplay(const rviz::Display& display, const std::string& name) {
  DiagnosticStatus report;
  report.name = name;
  report.hardware_id = display.getClassId().toStdString();
  report.values.push_back(keyValue("enabled", display.isEnabled() ? "true" : "false"));
  if (!display.isEnabled()) return report;
  for (int i = 0; i < display.numChildren(); ++i) {
    const auto* list = dynamic_cast<const rviz::StatusList*>(display.childAt(i));
    if (list) addLines(*list, report);
  }
  const std::string text = silence(display);
  if (!text.empty()) addLine(kSilenceName, rviz::StatusProperty::Warn, text, report);
  return report;
}

std::vector<DiagnosticStatus> reportDisplays(const rviz::DisplayGroup& group,
                                             const std::string& prefix) {
  std::vector<DiagnosticStatus> reports;
  for (int i = 0; i < group.numDisplays(); ++i) {
    const rviz::Display& display = *group.getDisplayAt(i);
    const std::string name = prefix + display.getNameStd();
    reports.push_back(reportDisplay(display, name));
    if (const auto* subgroup = dynamic_cast<const rviz::DisplayGroup*>(&display)) {
      const auto children = reportDisplays(*subgroup, name + "/");
      reports.insert(reports.end(), children.begin(), children.end());
    }
  }
  return reports;
}

}  // namespace process_visualizer::displays
