// SPDX-License-Identifier: BSD-3-Clause
// Image of a cloud with or without rows; searches its lines for edges, artifacts and occluders.

#include "process_visualizer/objects/point_image.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <utility>

#include "process_visualizer/cloud/cloud_layout.hpp"

namespace process_visualizer::objects {
namespace {

using Eigen::Array3f;
using Eigen::Isometry3f;
using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr std::int32_t kNoPoint = -1;
constexpr double kMaxPixels = 4e6;  // of an image that is made of points without rows

/// The index of each pixel's point in the cloud, with an empty row or column on each side. There
/// are no pixels if no image can be made of the points.
struct PointImage {
  std::size_t width = 0, height = 0;
  std::vector<std::int32_t> points;
};

PointImage emptyImage(std::size_t width, std::size_t height) {
  return {width + 2, height + 2, std::vector<std::int32_t>((width + 2) * (height + 2), kNoPoint)};
}

PointImage imageOfRows(const Points& points) {
  PointImage image = emptyImage(points.width, points.height);
  for (std::size_t row = 0; row < points.height; ++row) {
    const auto begin = image.points.begin() + static_cast<std::ptrdiff_t>((row + 1) * image.width);
    std::iota(begin + 1, begin + 1 + static_cast<std::ptrdiff_t>(points.width),
              static_cast<std::int32_t>(row * points.width));
  }
  return image;
}

bool isInFront(const Vector3f& point) { return point.allFinite() && point.z() > 0; }

/// Pixel of a point in a camera with a focal length of 1.
Vector2f projected(const Vector3f& point) { return point.head<2>() / point.z(); }

/// Width of the pixels of a camera with a focal length of 1: the median distance of consecutive
/// points from left to right.
std::optional<float> pixelWidth(const std::vector<Vector3f>& places) {
  std::vector<float> steps;
  for (std::size_t index = 1; index < places.size(); ++index) {
    if (!isInFront(places[index - 1]) || !isInFront(places[index])) continue;
    const float step = projected(places[index]).x() - projected(places[index - 1]).x();
    if (step > 1e-5F) steps.push_back(step);
  }
  if (steps.empty()) return std::nullopt;
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

/// Image of points without rows; it has no pixels if there are no consecutive points, or they are
/// too far apart.
PointImage imageOfAny(const Points& points) {
  const std::optional<float> width = pixelWidth(points.places);
  Eigen::AlignedBox<float, 2> range;
  for (const Vector3f& point : points.places)
    if (isInFront(point)) range.extend(projected(point));
  if (!width || range.isEmpty()) return {};
  const Eigen::Vector2d size = (range.sizes() / *width).cast<double>().array() + 1;
  if (!(size.prod() < kMaxPixels)) return {};
  PointImage image =
      emptyImage(static_cast<std::size_t>(size.x()) + 1, static_cast<std::size_t>(size.y()) + 1);
  for (std::size_t index = 0; index < points.places.size(); ++index) {
    if (!isInFront(points.places[index])) continue;
    const Vector2f place =
        ((projected(points.places[index]) - range.min()) / *width).array() + 1.5F;
    image.points[static_cast<std::size_t>(place.y()) * image.width +
                 static_cast<std::size_t>(place.x())] = static_cast<std::int32_t>(index);
  }
  return image;
}

/// Image of a cloud. Points without rows are projected into a camera in whose optical frame (z
/// forward) they are; consecutive points in a row of its image give the width of its pixels.
PointImage imageOf(const Points& points) {
  return points.height > 1 ? imageOfRows(points) : imageOfAny(points);
}

/// Maximum difference in range of two points on one surface at a range (m) from the sensor: 1 cm,
/// and two steps of a Kinect's depth (3 mm at 1 m, growing with the square of the distance).
float toleranceAt(float range) { return 0.01F + 2 * 0.003F * range * range; }

}  // namespace

Points pointsOf(const sensor_msgs::PointCloud2& cloud) {
  const cloud::CoordinateOffsets offsets = cloud::checkedOffsets(cloud);
  Points points;
  points.width = cloud.width;
  points.height = cloud::rowsWithPoints(cloud);
  points.places.reserve(points.width * points.height);
  for (std::size_t row = 0; row < points.height; ++row) {
    const std::uint8_t* point = cloud.data.data() + row * cloud.row_step;
    for (std::size_t column = 0; column < cloud.width; ++column, point += cloud.point_step)
      points.places.push_back(cloud::positionAt(point, offsets));
  }
  return points;
}

sensor_msgs::PointCloud2 freePart(const sensor_msgs::PointCloud2& cloud,
                                  const std::vector<Label>& labels) {
  sensor_msgs::PointCloud2 part;
  part.header = cloud.header;
  part.fields = cloud.fields;
  part.point_step = cloud.point_step;
  part.is_dense = true;
  for (std::size_t index = 0; index < labels.size(); ++index) {
    if (labels[index] != Label::kFree) continue;
    const std::size_t row = index / cloud.width, column = index % cloud.width;
    const std::uint8_t* point =
        cloud.data.data() + row * cloud.row_step + column * cloud.point_step;
    part.data.insert(part.data.end(), point, point + cloud.point_step);
  }
  part.row_step = static_cast<std::uint32_t>(part.data.size());
  part.width = part.row_step / part.point_step;
  part.height = 1;
  return part;
}

// Artifacts of the sensor.

namespace {

constexpr int kMinFreeNeighbors = 4;  // of eight
constexpr int kMinThinNeighbors = 2;  // of eight
constexpr float kMaxSteepStep = 4;    // tolerances: between pixels on a steep surface

/// Distance of each pixel's point from the sensor if it is free; otherwise -infinity, which is like
/// no other.
std::vector<float> freeRanges(const PointImage& image, const Points& points,
                              const std::vector<Label>& labels) {
  std::vector<float> ranges(image.points.size(), -std::numeric_limits<float>::infinity());
  for (std::size_t pixel = 0; pixel < ranges.size(); ++pixel) {
    const std::int32_t point = image.points[pixel];
    if (point != kNoPoint && labels[point] == Label::kFree)
      ranges[pixel] = points.places[point].norm();
  }
  return ranges;
}

}  // namespace

void markStrayPoints(const Points& points, std::vector<Label>& labels) {
  const PointImage image = imageOf(points);
  if (image.points.empty()) return;
  const std::vector<float> ranges = freeRanges(image, points, labels);
  const auto row = static_cast<std::ptrdiff_t>(image.width);
  // A surface is checked for even continuation over two pixels.
  const auto last = static_cast<std::ptrdiff_t>(ranges.size()) - 1;
  const auto rangeAt = [&](std::ptrdiff_t pixel) { return ranges[std::clamp(pixel, {}, last)]; };
  // Direct neighbors first: they are most often alike, and four are enough.
  const std::ptrdiff_t around[] = {-1, 1, -row, row, -row - 1, -row + 1, row - 1, row + 1};
  for (std::size_t pixel = 0; pixel < ranges.size(); ++pixel) {
    if (!(ranges[pixel] >= 0)) continue;
    const float tolerance = toleranceAt(ranges[pixel]);
    int alike = 0, even = 0;
    for (const std::ptrdiff_t step : around) {
      const float rise = ranges[pixel + step] - ranges[pixel];
      if (std::abs(rise) < tolerance) ++alike;
      if (alike == kMinFreeNeighbors) break;
      const float next = rangeAt(static_cast<std::ptrdiff_t>(pixel) + 2 * step);
      if (std::abs(rise) >= tolerance && std::abs(rise) < kMaxSteepStep * tolerance &&
          std::abs(next - ranges[pixel + step] - rise) < tolerance)
        ++even;
    }
    if (alike < kMinFreeNeighbors)
      labels[image.points[pixel]] = alike + even < kMinThinNeighbors ? Label::kStray : Label::kThin;
  }
}

// Occlusions and silhouettes of groups.

namespace {

constexpr std::int32_t kNoGroup = -1;
constexpr std::size_t kPixelStride = 3;    // px: between the rows and columns that are searched
constexpr int kMinLines = 2;               // that show a bridge
constexpr std::size_t kSearchMargin = 24;  // px: around a group, to find its occluders
constexpr float kMaxSurfaceGap = 0.25F;    // m: between surfaces that may be one
constexpr float kMaxSurfaceSlope = 0.5F;   // change of range along such a gap
constexpr float kTouching = 0.03F;         // m
constexpr float kRobotMargin = 0.01F;      // m

/// A pixel with a point.
struct Pixel {
  std::uint32_t point;
  std::int32_t group;
  float range;  ///< from the sensor, m
  bool is_robot, is_outside;
  bool is_last;  ///< of the image, in this direction
};

/// Returns whether one pixel may hide a continuation of the surface at the other one.
bool hides(const Pixel& one, const Pixel& other) {
  if (one.is_robot) return one.range < other.range + kRobotMargin;
  return one.range < other.range - toleranceAt(other.range);
}

class OcclusionSearch {
 public:
  OcclusionSearch(const Points& points, const std::vector<Label>& labels,
                  const std::vector<Indices>& groups)
      : points_(points),
        labels_(labels),
        image_(imageOf(points)),
        is_whole_image_(points.height > 1),
        groups_(points.places.size(), kNoGroup) {
    result_.rims.resize(groups.size());
    for (std::size_t group = 0; group < groups.size(); ++group)
      for (const std::uint32_t point : groups[group])
        groups_[point] = static_cast<std::int32_t>(group);
  }

  Occlusions run() {
    const auto [rows, columns] = spans();
    for (std::size_t row = 0; row < rows.size(); row += kPixelStride)
      searchLine(row * image_.width, 1, rows[row], image_.width);
    for (std::size_t column = 0; column < columns.size(); column += kPixelStride)
      searchLine(column, image_.width, columns[column], image_.height);
    for (const auto& [groups, votes] : votes_)
      if (votes.all >= kMinLines)
        result_.bridges.push_back({groups.first, groups.second, votes.continuing >= kMinLines});
    return std::move(result_);
  }

 private:
  struct Votes {
    int all = 0, continuing = 0;
  };

  /// First and last pixel of a line that belong to any group.
  struct Span {
    std::size_t first = std::numeric_limits<std::size_t>::max(), last = 0;

    void add(std::size_t place) {
      first = std::min(first, place);
      last = std::max(last, place);
    }
  };

  /// Spans of the rows and of the columns.
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

  /// Searches one line of pixels in both directions, as a bridge to a nearer group is found only
  /// from the farther one.
  void searchLine(std::size_t start, std::size_t step, const Span& span, std::size_t count) {
    if (span.first > span.last) return;
    readLine(start, step, span.first - std::min(span.first, kSearchMargin),
             std::min(span.last + kSearchMargin, count), count);
    if (line_.size() < 2) return;
    addRimAtBorder(line_.front(), line_[1]);
    addRimAtBorder(line_.back(), line_[line_.size() - 2]);
    for (std::size_t place = 1; place < line_.size(); ++place)
      addRimBetween(line_[place - 1], line_[place]);
    findBridges();
    std::reverse(line_.begin(), line_.end());
    findBridges();
  }

  void readLine(std::size_t start, std::size_t step, std::size_t begin, std::size_t end,
                std::size_t count) {
    line_.clear();
    for (std::size_t place = begin; place < end; ++place) {
      const std::int32_t point = image_.points[start + place * step];
      if (point == kNoPoint || labels_[point] == Label::kNowhere ||
          labels_[point] == Label::kStray || labels_[point] == Label::kThin)
        continue;
      line_.push_back({static_cast<std::uint32_t>(point), groups_[point],
                       points_.places[point].norm(), labels_[point] == Label::kRobot,
                       labels_[point] == Label::kOutside,
                       is_whole_image_ && (place <= 1 || place + 2 >= count)});
    }
  }

  /// Adds rim points where groups end between two consecutive pixels.
  void addRimBetween(const Pixel& one, const Pixel& other) {
    if (one.group == other.group) return;
    const bool touch = (one.group != kNoGroup || one.is_outside) &&
                       (other.group != kNoGroup || other.is_outside) &&
                       distance(one, other) < kTouching;
    if (one.group != kNoGroup)
      result_.rims[one.group].push_back(
          {one.point, direction(one, other), touch || hides(other, one)});
    if (other.group != kNoGroup)
      result_.rims[other.group].push_back(
          {other.point, direction(other, one), touch || hides(one, other)});
  }

  /// Adds a rim point where a group reaches the border of the image.
  void addRimAtBorder(const Pixel& last, const Pixel& before) {
    if (last.is_last && last.group != kNoGroup)
      result_.rims[last.group].push_back({last.point, -direction(last, before), true});
  }

  /// Direction from one pixel to another, as if both were at the same range.
  Eigen::Vector3f direction(const Pixel& from, const Pixel& to) const {
    const Vector3f& place = points_.places[from.point];
    return (points_.places[to.point] * (from.range / to.range) - place).normalized();
  }

  /// For each pixel, removes its occluders from a stack. The top is then the last pixel before it
  /// that may show the same surface.
  void findBridges() {
    stack_.clear();
    for (const Pixel& it : line_) {
      const std::size_t before = stack_.size();
      while (!stack_.empty() && hides(stack_.back(), it)) stack_.pop_back();
      if (stack_.size() < before && !stack_.empty()) vote(stack_.back(), it);
      stack_.push_back(it);
    }
  }

  void vote(const Pixel& one, const Pixel& other) {
    if (one.group == kNoGroup || other.group == kNoGroup || one.group == other.group) return;
    const auto [smaller, larger] = std::minmax(one.group, other.group);
    Votes& votes = votes_[{smaller, larger}];
    ++votes.all;
    const float gap = distance(one, other);
    if (gap < kMaxSurfaceGap &&
        std::abs(one.range - other.range) < toleranceAt(one.range) + kMaxSurfaceSlope * gap)
      ++votes.continuing;
  }

  float distance(const Pixel& one, const Pixel& other) const {
    return (points_.places[one.point] - points_.places[other.point]).norm();
  }

  const Points& points_;
  const std::vector<Label>& labels_;
  PointImage image_;
  bool is_whole_image_;               ///< the borders of a cloud without rows mean nothing
  std::vector<std::int32_t> groups_;  ///< of each point
  std::vector<Pixel> line_, stack_;   ///< kept to reuse their memory
  std::map<std::pair<std::uint32_t, std::uint32_t>, Votes> votes_;
  Occlusions result_;
};

}  // namespace

Occlusions occlusionsOf(const Points& points, const std::vector<Label>& labels,
                        const std::vector<Indices>& groups) {
  if (groups.empty()) return {};
  return OcclusionSearch(points, labels, groups).run();
}

// Hidden places.

namespace {

constexpr float kInnerShare = 0.8F;  // of the box, whose rim may be visible
constexpr std::size_t kStride = 7;   // between checked points; does not divide common image widths

/// Part of the ray from one place through another that lies in a box around the origin, as
/// multiples of their distance; the second is smaller if the ray misses the box.
std::pair<float, float> intervalInside(const Vector3f& half, const Vector3f& from,
                                       const Vector3f& to) {
  const Array3f way = (to - from).array();
  const Array3f a = (-half - from).array() / way, b = (half - from).array() / way;
  return {a.min(b).maxCoeff(), a.max(b).minCoeff()};
}

}  // namespace

bool isHidden(const UprightBox& box, const Points& points, const std::vector<Label>& labels,
              const Isometry3f& global_from_cloud) {
  const Isometry3f box_from_cloud = Eigen::AngleAxisf(-box.yaw, Vector3f::UnitZ()) *
                                    Eigen::Translation3f(-box.center) * global_from_cloud;
  const Vector3f sensor = box_from_cloud.translation(), half = kInnerShare / 2 * box.size;
  std::size_t hiding = 0, others = 0;
  for (std::size_t index = 0; index < labels.size(); index += kStride) {
    if (labels[index] == Label::kNowhere) continue;
    const auto [begin, end] = intervalInside(half, sensor, box_from_cloud * points.places[index]);
    if (!(begin < end && end > 0)) continue;
    const bool is_hiding = begin > 1 || (end > 1 && labels[index] == Label::kRobot);
    ++(is_hiding ? hiding : others);
  }
  return hiding > others;
}

}  // namespace process_visualizer::objects
