// SPDX-License-Identifier: BSD-3-Clause
// Joins the text markers at one place into a label, and finds the arrow of each line.

#include "label_store.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <set>
#include <sstream>
#include <tuple>

namespace process_visualizer::displays {
namespace {

using visualization_msgs::Marker;
using Lines = std::vector<std::pair<int, LabelLine>>;

constexpr double kSamePlace = 1e-4;   ///< m
constexpr double kMaxDistance = 1e9;  ///< m
constexpr std::size_t kMaxLines = 24;
const char* const kBlank = " \t\n\v\f\r";

ros::Time endOf(const Marker& marker, ros::Time now) {
  return marker.lifetime.isZero() ? ros::Time() : now + marker.lifetime;
}

bool isOver(ros::Time end, ros::Time now) { return !end.isZero() && now >= end; }

Place placeOf(const Marker& marker) {
  const ros::Time stamp = marker.frame_locked ? ros::Time() : marker.header.stamp;
  return {marker.header.frame_id, stamp, marker.pose.position};
}

geometry_msgs::Point sum(const geometry_msgs::Point& point, double x, double y, double z) {
  geometry_msgs::Point result;
  result.x = point.x + x;
  result.y = point.y + y;
  result.z = point.z + z;
  return result;
}

/// An arrow along its pose's x axis; our nodes draw no quantities as arrows between two points.
LabelArrow arrowOf(const Marker& marker) {
  LabelArrow arrow{placeOf(marker), placeOf(marker)};
  const auto& q = marker.pose.orientation;
  const double length = marker.scale.x;
  arrow.tip.position =
      sum(marker.pose.position, length * (1 - 2 * (q.y * q.y + q.z * q.z)),
          length * 2 * (q.x * q.y + q.w * q.z), length * 2 * (q.x * q.z - q.w * q.y));
  return arrow;
}

std::string trimmed(const std::string& text) {
  const std::size_t begin = text.find_first_not_of(kBlank);
  if (begin == std::string::npos) return "";
  return text.substr(begin, text.find_last_not_of(kBlank) - begin + 1);
}

/// Orders lines by row if each text fills a row of its own, as in a block (line_of_block in our
/// nodes); otherwise the lines of a text stay together.
void orderByRow(Lines& lines) {
  std::set<int> rows;
  for (const auto& line : lines) {
    if (!rows.insert(line.first).second) return;
  }
  std::sort(lines.begin(), lines.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
}

using Spot = std::tuple<std::string, ros::Time, std::int64_t, std::int64_t, std::int64_t>;

Spot spotOf(const Place& place) {
  const auto rounded = [](double value) {
    return static_cast<std::int64_t>(std::llround(value / kSamePlace));
  };
  return {place.frame, place.stamp, rounded(place.position.x), rounded(place.position.y),
          rounded(place.position.z)};
}

}  // namespace

bool isInReach(const geometry_msgs::Point& point) {
  return std::abs(point.x) < kMaxDistance && std::abs(point.y) < kMaxDistance &&
         std::abs(point.z) < kMaxDistance;
}

bool isLabel(const Marker& marker) {
  return marker.action == Marker::ADD && marker.type == Marker::TEXT_VIEW_FACING &&
         isInReach(marker.pose.position) && std::isfinite(marker.scale.z) && marker.scale.z > 0 &&
         marker.color.a > 0 && marker.text.find_first_not_of(kBlank) != std::string::npos;
}

void LabelStore::take(const Marker& marker, ros::Time now) {
  if (marker.action == Marker::DELETEALL) {
    clear();
  } else if (marker.action == Marker::ADD) {
    add(marker, now);
  } else {
    remove({marker.ns, marker.id});
  }
}

void LabelStore::add(const Marker& marker, ros::Time now) {
  const Id id{marker.ns, marker.id};
  if (isLabel(marker)) {
    texts_[id] = {marker, endOf(marker, now)};
    has_changed_ = true;
  } else if (marker.type == Marker::ARROW && marker.points.empty() &&
             isInReach(marker.pose.position) && std::isfinite(marker.scale.x)) {
    arrows_[id] = {displays::arrowOf(marker), endOf(marker, now)};
    has_changed_ = true;
  } else {
    remove(id);
  }
}

void LabelStore::remove(const Id& id) {
  arrows_.erase(id);
  texts_.erase(id);
  has_changed_ = true;
}

void LabelStore::expire(ros::Time now) {
  for (auto it = texts_.begin(); it != texts_.end();) {
    const bool is_over = isOver(it->second.end, now);
    has_changed_ = has_changed_ || is_over;
    it = is_over ? texts_.erase(it) : std::next(it);
  }
  for (auto it = arrows_.begin(); it != arrows_.end();) {
    const bool is_over = isOver(it->second.end, now);
    has_changed_ = has_changed_ || is_over;
    it = is_over ? arrows_.erase(it) : std::next(it);
  }
}

void LabelStore::clear() {
  texts_.clear();
  arrows_.clear();
  has_changed_ = true;
}

const std::vector<Label>& LabelStore::labels() {
  if (has_changed_) collect();
  has_changed_ = false;
  return labels_;
}

void LabelStore::collect() {
  std::map<Spot, std::vector<Id>> spots;
  for (const auto& [id, text] : texts_) spots[spotOf(placeOf(text.marker))].push_back(id);
  labels_.clear();
  for (const auto& [spot, ids] : spots) labels_.push_back(label(ids));
  std::sort(labels_.begin(), labels_.end(),
            [](const Label& a, const Label& b) { return a.key < b.key; });
}

Label LabelStore::label(const std::vector<Id>& ids) const {
  const Marker& first = texts_.at(ids.front()).marker;
  Label label{ids.front().first + '\n' + std::to_string(ids.front().second),
              placeOf(first),
              first.scale.z,
              {}};
  Lines lines;
  for (const Id& id : ids) appendLines(texts_.at(id).marker, lines);
  orderByRow(lines);
  if (lines.size() > kMaxLines) lines.resize(kMaxLines);
  for (auto& line : lines) label.lines.push_back(std::move(line.second));
  return label;
}

void LabelStore::appendLines(const Marker& marker, Lines& lines) const {
  std::istringstream rows(marker.text);
  std::string row;
  for (int number = 0; std::getline(rows, row); ++number) {
    const std::string text = trimmed(row);
    if (!text.empty())
      lines.emplace_back(number, LabelLine{marker.ns, text, marker.color, arrowOf(marker.ns)});
  }
}

/// The only arrow of a namespace; nothing if there are several, as any could belong to the text.
std::optional<LabelArrow> LabelStore::arrowOf(const std::string& marker_namespace) const {
  const auto first = arrows_.lower_bound({marker_namespace, INT32_MIN});
  if (first == arrows_.end() || first->first.first != marker_namespace) return {};
  const auto next = std::next(first);
  if (next != arrows_.end() && next->first.first == marker_namespace) return {};
  return first->second.arrow;
}

}  // namespace process_visualizer::displays
