// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/objects/occlusions.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>
#include <utility>

namespace process_visualizer::objects {
namespace {

constexpr std::int32_t kNoGroup = -1;
constexpr std::size_t kPixelStride = 3;  // px: between the rows and columns that are looked at
constexpr int kFewestLines = 2;          // that show a bridge
constexpr std::size_t kBeside = 24;      // px: so far beyond a group is looked for what hides it
constexpr float kLongestGap = 0.25F;     // m: surfaces farther apart are not taken for one
constexpr float kSteepest = 0.5F;        // of a surface across the line of sight
constexpr float kTouching = 0.03F;       // m
constexpr float kRobotMargin = 0.01F;    // m

/// A pixel that shows something.
struct Sight {
  std::uint32_t point;
  std::int32_t group;
  float range;  ///< from the sensor, m
  bool is_robot;
};

/// Whether a pixel may hide what continues the surface that the other one shows.
bool hides(const Sight& one, const Sight& other) {
  if (one.is_robot) return one.range < other.range + kRobotMargin;
  return one.range < other.range - toleranceAt(other.range);
}

class Search {
 public:
  Search(const Points& points, const std::vector<Label>& labels, const std::vector<Indices>& groups)
      : points_(points),
        labels_(labels),
        image_(imageOf(points)),
        groups_(points.places.size(), kNoGroup) {
    result_.rims.resize(groups.size());
    for (std::size_t group = 0; group < groups.size(); ++group)
      for (const std::uint32_t point : groups[group])
        groups_[point] = static_cast<std::int32_t>(group);
  }

  Occlusions run() {
    const auto [rows, columns] = spans();
    for (std::size_t row = 0; row < rows.size(); row += kPixelStride)
      lookAlong(row * image_.width, 1, rows[row], image_.width);
    for (std::size_t column = 0; column < columns.size(); column += kPixelStride)
      lookAlong(column, image_.width, columns[column], image_.height);
    for (const auto& [groups, votes] : votes_)
      if (votes.all >= kFewestLines)
        result_.bridges.push_back({groups.first, groups.second, votes.continuing >= kFewestLines});
    return std::move(result_);
  }

 private:
  struct Votes {
    int all = 0, continuing = 0;
  };

  /// From the first to the last pixel of any group.
  struct Span {
    std::size_t first = std::numeric_limits<std::size_t>::max(), last = 0;

    void add(std::size_t place) {
      first = std::min(first, place);
      last = std::max(last, place);
    }
  };

  /// Of the rows and the columns.
  std::pair<std::vector<Span>, std::vector<Span>> spans() const {
    std::vector<Span> rows(image_.height), columns(image_.width);
    for (std::size_t row = 0; row < image_.height; ++row) {
      for (std::size_t column = 0; column < image_.width; ++column) {
        const std::int32_t point = image_.points[row * image_.width + column];
        if (point == kNoPoint || groups_[point] == kNoGroup) continue;
        rows[row].add(column);
        columns[column].add(row);
      }
    }
    return {std::move(rows), std::move(columns)};
  }

  /// Looks along one line of pixels, in both directions: what is nearer at its end is a bridge only
  /// if it is reached from the other one.
  void lookAlong(std::size_t start, std::size_t step, const Span& span, std::size_t count) {
    if (span.first > span.last) return;
    readLine(start, step, span.first - std::min(span.first, kBeside),
             std::min(span.last + kBeside, count));
    for (std::size_t place = 1; place < line_.size(); ++place)
      endBetween(line_[place - 1], line_[place]);
    findBridges();
    std::reverse(line_.begin(), line_.end());
    findBridges();
  }

  void readLine(std::size_t start, std::size_t step, std::size_t begin, std::size_t end) {
    line_.clear();
    for (std::size_t place = begin; place < end; ++place) {
      const std::int32_t point = image_.points[start + place * step];
      if (point == kNoPoint || labels_[point] == Label::kNowhere || labels_[point] == Label::kStray)
        continue;
      line_.push_back({static_cast<std::uint32_t>(point), groups_[point],
                       points_.places[point].norm(), labels_[point] == Label::kRobot});
    }
  }

  /// Notes where groups end between two pixels that follow each other.
  void endBetween(const Sight& one, const Sight& other) {
    if (one.group == other.group) return;
    const bool touch =
        one.group != kNoGroup && other.group != kNoGroup && distance(one, other) < kTouching;
    if (one.group != kNoGroup)
      result_.rims[one.group].push_back({one.point, other.point, touch || hides(other, one)});
    if (other.group != kNoGroup)
      result_.rims[other.group].push_back({other.point, one.point, touch || hides(one, other)});
  }

  /// For each pixel, the last one before it that does not hide what continues it is on top of a
  /// stack.
  void findBridges() {
    stack_.clear();
    for (const Sight& it : line_) {
      const std::size_t before = stack_.size();
      while (!stack_.empty() && hides(stack_.back(), it)) stack_.pop_back();
      if (stack_.size() < before && !stack_.empty()) vote(stack_.back(), it);
      stack_.push_back(it);
    }
  }

  void vote(const Sight& one, const Sight& other) {
    if (one.group == kNoGroup || other.group == kNoGroup || one.group == other.group) return;
    const auto [least, most] = std::minmax(one.group, other.group);
    Votes& votes = votes_[{least, most}];
    ++votes.all;
    const float gap = distance(one, other);
    if (gap < kLongestGap &&
        std::abs(one.range - other.range) < toleranceAt(one.range) + kSteepest * gap)
      ++votes.continuing;
  }

  float distance(const Sight& one, const Sight& other) const {
    return (points_.places[one.point] - points_.places[other.point]).norm();
  }

  const Points& points_;
  const std::vector<Label>& labels_;
  PointImage image_;
  std::vector<std::int32_t> groups_;  ///< of each point
  std::vector<Sight> line_, stack_;   ///< memory that is kept
  std::map<std::pair<std::uint32_t, std::uint32_t>, Votes> votes_;
  Occlusions result_;
};

}  // namespace

Occlusions occlusionsOf(const Points& points, const std::vector<Label>& labels,
                        const std::vector<Indices>& groups) {
  if (groups.empty()) return {};
  return Search(points, labels, groups).run();
}

}  // namespace process_visualizer::objects
