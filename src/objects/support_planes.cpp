// SPDX-License-Identifier: BSD-3-Clause
// Finds level planes (RANSAC), their extent by tiles, and the noise from their residuals.

#include "process_visualizer/objects/support_planes.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <limits>
#include <numeric>
#include <random>
#include <utility>

namespace process_visualizer::objects {
namespace {

using Eigen::Vector3f;
using Plane = Eigen::Hyperplane<float, 3>;

constexpr int kMaxPlanes = 8;               // that are tried
constexpr float kMinNormalZ = 0.985F;       // cosine of 10°
constexpr float kTile = 0.1F;               // m: edge of a tile
constexpr float kGridReach = 15;            // m: from the sensor
constexpr float kMinKnownShare = 0.5F;      // of the minimum area, for an earlier surface
constexpr int kMaxHiddenTiles = 5;          // in a row, over which a surface may continue
constexpr int kMinRaysPast = 2;             // that show that a surface is not in a tile
constexpr std::size_t kPlaneSample = 2500;  // points by which planes are compared
constexpr int kMinHeightPoints = 10;        // that give a surface's height
constexpr double kMaxTrials = 200;
constexpr int kNoiseRounds = 4;
constexpr float kMaxNoise = 0.012F;        // m at 1 m
constexpr float kMinRaySlope = 0.2F;       // sine: flatter rays show little
constexpr float kMedianOfNormal = 0.674F;  // median absolute value, in standard deviations
constexpr std::size_t kMinResiduals = 200;
constexpr double kMissProbability = 0.01;  // of a better plane

/// Offsets from a place to others that may be beyond the same edge, m.
const std::array<Eigen::Vector2f, 4> kEdgeOffsets{
    {{kTile / 2, 0}, {-kTile / 2, 0}, {0, kTile / 2}, {0, -kTile / 2}}};

/// Counts of a tile's points at a height, and in equally thick layers above and below it.
struct Layers {
  int at = 0, above = 0, below = 0;

  /// Counts a point by its height above the middle layer, m. `tolerance` is half of the thickness.
  void add(float height, float tolerance) {
    if (std::abs(height) < tolerance)
      ++at;
    else if (std::abs(height) < 3 * tolerance)
      ++(height > 0 ? above : below);
  }

  /// A level surface is at one height, an upright one at all heights.
  bool isLevel() const { return at > 0 && 2 * above <= at && 2 * below <= at; }
  bool isCrossed() const { return 4 * std::min(above, below) > at; }
};

/// Calls a function with the up to eight tiles around one.
template <typename Look>
void forNeighbors(std::size_t tile, std::size_t columns, std::size_t rows, const Look& look) {
  const std::size_t x = tile % columns, y = tile / columns;
  for (std::size_t row = y == 0 ? 0 : y - 1; row <= y + 1 && row < rows; ++row)
    for (std::size_t column = x == 0 ? 0 : x - 1; column <= x + 1 && column < columns; ++column)
      if (row != y || column != x) look(row * columns + column);
}

/// Least-squares plane, with its normal upwards.
Plane fitted(const std::vector<Vector3f>& points) {
  Eigen::Matrix3Xf matrix(3, points.size());
  for (std::size_t index = 0; index < points.size(); ++index)
    matrix.col(static_cast<Eigen::Index>(index)) = points[index];
  const Vector3f center = matrix.rowwise().mean();
  matrix.colwise() -= center;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> solver(matrix * matrix.transpose());
  const Vector3f normal = solver.eigenvectors().col(0);
  return {normal.z() < 0 ? Vector3f(-normal) : normal, center};
}

/// Mean height of the points of a surface around a place, if there are more than a few.
std::optional<float> heightAround(const std::vector<Vector3f>& surface, const Vector3f& place,
                                  float radius) {
  float sum = 0;
  int count = 0;
  for (const Vector3f& point : surface) {
    if ((point - place).head<2>().squaredNorm() > radius * radius) continue;
    sum += point.z();
    ++count;
  }
  if (count < kMinHeightPoints) return std::nullopt;
  return sum / static_cast<float>(count);
}

/// Number of trials that find a plane with a share of the points (Fischler and Bolles 1981).
double trialsFor(double share) {
  const double hit = share * share * share;
  return hit >= 1 ? 1 : std::log(kMissProbability) / std::log(1 - hit);
}

}  // namespace

std::optional<std::size_t> SupportPlanes::Grid::tileAt(const Vector3f& place) const {
  const Eigen::Vector2f away = (place.head<2>() - corner) / kTile;
  if (!(away.minCoeff() >= 0)) return std::nullopt;
  const auto column = static_cast<std::size_t>(away.x()), row = static_cast<std::size_t>(away.y());
  if (column >= columns || row >= rows) return std::nullopt;
  return row * columns + column;
}

SupportPlanes::SupportPlanes(const std::vector<Vector3f>& points, Vector3f sensor, float min_area,
                             std::optional<DepthNoise> noise, const SupportPlanes* before,
                             std::vector<Vector3f> upright)
    : sensor_(std::move(sensor)), min_area_(min_area), upright_(std::move(upright)) {
  const Eigen::Vector2f reach = Eigen::Vector2f::Constant(kGridReach);
  const Eigen::AlignedBox2f range(sensor_.head<2>() - reach, sensor_.head<2>() + reach);
  Eigen::AlignedBox2f seen;
  for (const std::vector<Vector3f>* places : {&points, &std::as_const(upright_)})
    for (const Vector3f& point : *places)
      if (range.contains(Eigen::Vector2f(point.head<2>()))) seen.extend(point.head<2>());
  if (!seen.isEmpty()) {
    grid_.corner = seen.min();
    grid_.columns = static_cast<std::size_t>(seen.sizes().x() / kTile) + 1;
    grid_.rows = static_cast<std::size_t>(seen.sizes().y() / kTile) + 1;
  }
  samples_.reserve(points.size());
  for (const Vector3f& point : points)
    if (const auto tile = grid_.tileAt(point)) samples_.push_back({point, *tile});
  if (noise)
    setNoise(*noise);
  else
    estimateNoise();
  std::vector<Sample> level = levelSamples();
  for (int trial = 0; trial < kMaxPlanes && findNext(level, before); ++trial) {
  }
  const auto height = [](const Surface& surface) {
    float sum = 0;
    for (const Vector3f& point : surface.points) sum += point.z();
    return sum / static_cast<float>(surface.points.size());
  };
  const auto lowest = std::min_element(
      surfaces_.begin(), surfaces_.end(),
      [&](const Surface& one, const Surface& other) { return height(one) < height(other); });
  if (lowest != surfaces_.end()) std::iter_swap(surfaces_.begin(), lowest);
  samples_.clear();
  upright_.clear();
}

void SupportPlanes::setNoise(const DepthNoise& noise) {
  noise_ = noise;
  for (Sample& sample : samples_) sample.tolerance = tolerance(sample.place);
}

/// Points that may be on a level surface: those with few others in their tile right above or below.
/// Otherwise a wall, seen by a noisy sensor, would have a surface at every height.
std::vector<SupportPlanes::Sample> SupportPlanes::levelSamples() const {
  std::vector<std::size_t> begins(grid_.size() + 1);
  for (const Sample& sample : samples_) ++begins[sample.tile + 1];
  std::partial_sum(begins.begin(), begins.end(), begins.begin());
  std::vector<std::size_t> ends(begins.begin(), begins.end());
  std::vector<float> heights(samples_.size());
  for (const Sample& sample : samples_) heights[ends[sample.tile]++] = sample.place.z();
  std::vector<Sample> level;
  for (const Sample& sample : samples_) {
    Layers layers;
    for (std::size_t place = begins[sample.tile]; place < begins[sample.tile + 1]; ++place)
      layers.add(heights[place] - sample.place.z(), sample.tolerance);
    if (layers.isLevel()) level.push_back(sample);
  }
  return level;
}

/// Removes the points of the largest plane from `level`, and keeps the plane if it is a surface.
/// \return true if another plane may be found
bool SupportPlanes::findNext(std::vector<Sample>& level, const SupportPlanes* before) {
  if (level.empty()) return false;
  const auto on = [](const Plane& plane) {
    return [plane](const Sample& it) { return plane.absDistance(it.place) < it.tolerance; };
  };
  const auto end = std::partition(level.begin(), level.end(), on(largest(level)));
  std::vector<Vector3f> places;
  std::transform(level.begin(), end, std::back_inserter(places),
                 [](const Sample& it) { return it.place; });
  std::vector<bool> is_covered(grid_.size());
  std::for_each(level.begin(), end, [&](const Sample& it) { is_covered[it.tile] = true; });
  if (static_cast<float>(std::count(is_covered.begin(), is_covered.end(), true)) * kTile * kTile <
      (before ? kMinKnownShare : 1) * min_area_)
    return false;
  Surface surface{fitted(places), {}, {}};
  surface.extent = extentOf(surface.plane, before);
  const auto begin_rest = std::partition(level.begin(), level.end(), [&](const Sample& it) {
    return on(surface.plane)(it) && surface.extent[it.tile] == Extent::kThere;
  });
  if (begin_rest == level.begin()) {
    level.erase(level.begin(), end);
    return true;
  }
  std::transform(level.begin(), begin_rest, std::back_inserter(surface.points),
                 [](const Sample& it) { return it.place; });
  level.erase(level.begin(), begin_rest);
  surfaces_.push_back(std::move(surface));
  return true;
}

/// Classifies each tile by its points at the height of a plane.
std::vector<SupportPlanes::Kind> SupportPlanes::kindsOf(const Plane& plane) const {
  const float sensor_height = plane.signedDistance(sensor_);
  std::vector<Layers> layers(grid_.size());
  std::vector<int> rays_past(grid_.size());
  const auto castRay = [&](const Vector3f& place, float height, float tolerance) {
    if (std::abs(height) < tolerance || height * sensor_height > 0) return;
    const float way = sensor_height / (sensor_height - height);
    if (const auto tile = grid_.tileAt(sensor_ + way * (place - sensor_))) ++rays_past[*tile];
  };
  for (const Sample& sample : samples_) {
    const float height = plane.signedDistance(sample.place);
    layers[sample.tile].add(height, sample.tolerance);
    castRay(sample.place, height, sample.tolerance);
  }
  for (const Vector3f& place : upright_)
    castRay(place, plane.signedDistance(place), tolerance(place));
  std::vector<Kind> kinds;
  kinds.reserve(grid_.size());
  for (std::size_t tile = 0; tile < grid_.size(); ++tile) {
    const Layers& seen = layers[tile];
    if (seen.at == 0)
      kinds.push_back(rays_past[tile] < kMinRaysPast ? Kind::kUnseen : Kind::kPassed);
    else if (seen.isCrossed())
      kinds.push_back(Kind::kCrossed);
    else
      kinds.push_back(seen.isLevel() ? Kind::kLevel : Kind::kSteep);
  }
  return kinds;
}

/// Tiles in which a plane is visible, and hidden tiles around them: it may continue over a few, up
/// to where the sensor looks past it. A steep tile next to a level one shows an object on the
/// surface, or the edge of the surface.
std::vector<std::size_t> SupportPlanes::reached(const std::vector<Kind>& kinds) const {
  std::vector<int> hidden(grid_.size(), kMaxHiddenTiles + 1);  // tiles to the nearest visible one
  std::vector<std::size_t> tiles;
  for (std::size_t tile = 0; tile < kinds.size(); ++tile) {
    bool is_seen = kinds[tile] == Kind::kLevel;
    if (kinds[tile] == Kind::kSteep)
      forNeighbors(tile, grid_.columns, grid_.rows,
                   [&](std::size_t it) { is_seen = is_seen || kinds[it] == Kind::kLevel; });
    if (!is_seen) continue;
    hidden[tile] = 0;
    tiles.push_back(tile);
  }
  for (std::size_t next = 0; next < tiles.size(); ++next) {
    const std::size_t tile = tiles[next];
    if (hidden[tile] == kMaxHiddenTiles) continue;
    forNeighbors(tile, grid_.columns, grid_.rows, [&](std::size_t it) {
      if (kinds[it] != Kind::kUnseen || hidden[it] <= kMaxHiddenTiles) return;
      hidden[it] = hidden[tile] + 1;
      tiles.push_back(it);
    });
  }
  return tiles;
}

/// Extent of the surface in a plane: connected tiles with a visible area that is large enough.
std::vector<SupportPlanes::Extent> SupportPlanes::extentOf(const Plane& plane,
                                                           const SupportPlanes* before) const {
  const std::vector<Kind> kinds = kindsOf(plane);
  std::vector<Extent> extent(grid_.size(), Extent::kUnknown);
  for (std::size_t tile = 0; tile < kinds.size(); ++tile) {
    if (kinds[tile] == Kind::kPassed) extent[tile] = Extent::kPassed;
    if (kinds[tile] == Kind::kCrossed) extent[tile] = Extent::kNotThere;
  }
  std::vector<bool> is_open(grid_.size());
  const std::vector<std::size_t> tiles = reached(kinds);
  for (const std::size_t tile : tiles) is_open[tile] = true;
  for (const std::size_t first : tiles) {
    if (!is_open[first]) continue;
    is_open[first] = false;
    std::vector<std::size_t> part{first};
    float area = 0, known = 0;  // in tiles; half of one on an edge is beyond it
    for (std::size_t next = 0; next < part.size(); ++next) {
      bool is_edge = false;
      forNeighbors(part[next], grid_.columns, grid_.rows, [&](std::size_t it) {
        is_edge = is_edge || kinds[it] == Kind::kPassed || kinds[it] == Kind::kCrossed;
        if (!is_open[it]) return;
        is_open[it] = false;
        part.push_back(it);
      });
      if (kinds[part[next]] != Kind::kLevel) continue;
      area += is_edge ? 0.5F : 1;
      if (before && before->contain(middleOf(part[next], plane))) known += is_edge ? 0.5F : 1;
    }
    const float share = 2 * known > area ? kMinKnownShare : 1;
    if (area * kTile * kTile < share * min_area_) continue;
    for (const std::size_t tile : part) extent[tile] = Extent::kThere;
  }
  return extent;
}

Vector3f SupportPlanes::middleOf(std::size_t tile, const Plane& plane) const {
  const auto along = [](std::size_t number) { return (static_cast<float>(number) + 0.5F) * kTile; };
  const float x = grid_.corner.x() + along(tile % grid_.columns);
  const float y = grid_.corner.y() + along(tile / grid_.columns);
  const Vector3f& normal = plane.normal();
  return {x, y, -(plane.offset() + normal.x() * x + normal.y() * y) / normal.z()};
}

/// Level plane through three of the points that contains the most points (RANSAC). PCL's search is
/// not used, as it writes an error into the log whenever it draws three points in a line.
Plane SupportPlanes::largest(const std::vector<Sample>& samples) {
  std::mt19937 random(1);  // fixed seed: the result depends on this cloud alone
  const auto any = [&] { return samples[random() % samples.size()].place; };
  const std::size_t stride = samples.size() / kPlaneSample + 1;
  Plane best(Vector3f::UnitZ(), samples.front().place);
  std::size_t most = 0;
  double trials = kMaxTrials;
  for (int trial = 0; trial < trials; ++trial) {
    const Vector3f a = any(), b = any(), c = any();
    const Vector3f normal = (b - a).cross(c - a).normalized();
    if (!(std::abs(normal.z()) > kMinNormalZ)) continue;
    const Plane plane(normal.z() < 0 ? Vector3f(-normal) : normal, a);
    std::size_t count = 0;
    for (std::size_t index = 0; index < samples.size(); index += stride)
      if (plane.absDistance(samples[index].place) < samples[index].tolerance) ++count;
    if (count <= most) continue;
    most = count;
    best = plane;
    trials = std::min(kMaxTrials, trialsFor(static_cast<double>(most * stride) /
                                            static_cast<double>(samples.size())));
  }
  return best;
}

/// Estimates the noise from the residuals of the largest plane. With a noisy sensor, that plane is
/// roughly right, but fewer of its points are within the tolerance, and it is tilted like the three
/// points that define it. So it is fitted to the points near it, the noise is estimated from their
/// residuals along the line of sight, and both are repeated with the points within that noise. Only
/// level tiles count: beside walls and among people, less than half of the points near the floor
/// may belong to it, and the median would be wrong.
void SupportPlanes::estimateNoise() {
  setNoise({kMaxNoise});
  std::vector<Sample> level = levelSamples();
  if (level.empty()) return setNoise(DepthNoise());
  for (Sample& sample : level) sample.tolerance = toleranceAt(sample.place, DepthNoise());
  Plane plane = largest(level);
  for (int round = 0; round < kNoiseRounds; ++round) {
    const std::vector<Kind> kinds = kindsOf(plane);
    std::vector<Vector3f> near;
    for (const Sample& sample : samples_)
      if (kinds[sample.tile] == Kind::kLevel &&
          alongRay(plane, sample.place) < noise_.reachAt((sample.place - sensor_).norm()))
        near.push_back(sample.place);
    if (near.size() < kMinResiduals) return setNoise(DepthNoise());
    plane = fitted(near);
    std::vector<float> residuals;
    residuals.reserve(near.size());
    for (const Vector3f& point : near)
      residuals.push_back(alongRay(plane, point) / (point - sensor_).squaredNorm());
    const auto middle = residuals.begin() + static_cast<std::ptrdiff_t>(residuals.size() / 2);
    std::nth_element(residuals.begin(), middle, residuals.end());
    setNoise({std::clamp(*middle / kMedianOfNormal, DepthNoise::kKinect, kMaxNoise)});
  }
}

/// Distance of a point from a plane along the line of sight, m; infinite for flat rays.
float SupportPlanes::alongRay(const Plane& plane, const Vector3f& point) const {
  const float slope = std::abs(plane.normal().dot((point - sensor_).normalized()));
  return slope < kMinRaySlope ? std::numeric_limits<float>::infinity()
                              : plane.absDistance(point) / slope;
}

float SupportPlanes::tolerance(const Vector3f& point) const { return toleranceAt(point, noise_); }

float SupportPlanes::toleranceAt(const Vector3f& point, const DepthNoise& noise) const {
  const Vector3f ray = point - sensor_;
  const float range = ray.norm();
  return noise.toleranceAt(range, range > 0 ? std::abs(ray.z()) / range : 1);
}

/// Returns whether a surface exists at a place. The last strip of a table is narrower than a tile,
/// so that the sensor also looks past the table there: neighboring places count as well.
bool SupportPlanes::isThere(const Surface& surface, const Vector3f& place) const {
  const auto extentAt = [&](const Vector3f& at) {
    const auto tile = grid_.tileAt(at);
    return tile ? surface.extent[*tile] : Extent::kUnknown;
  };
  const Extent extent = extentAt(place);
  if (extent == Extent::kThere || extent == Extent::kNotThere) return extent == Extent::kThere;
  if (extent == Extent::kUnknown && &surface == &surfaces_.front()) return true;
  return std::any_of(kEdgeOffsets.begin(), kEdgeOffsets.end(), [&](const Eigen::Vector2f& offset) {
    return extentAt(place + Vector3f(offset.x(), offset.y(), 0)) == Extent::kThere;
  });
}

bool SupportPlanes::contain(const Vector3f& point) const {
  const float tolerance = this->tolerance(point);
  return std::any_of(surfaces_.begin(), surfaces_.end(), [&](const Surface& surface) {
    return surface.plane.absDistance(point) < tolerance && isThere(surface, point);
  });
}

/// Surfaces with visible points around the place take precedence over those that may continue
/// there.
std::optional<float> SupportPlanes::heightBelow(const Vector3f& place, float radius) const {
  std::optional<float> seen, continued;
  const auto raise = [&](std::optional<float>& height, float here) {
    if (here <= place.z() && (!height || here > *height)) height = here;
  };
  for (const Surface& surface : surfaces_) {
    const Vector3f& normal = surface.plane.normal();
    if (isThere(surface, place))
      raise(continued,
            -(surface.plane.offset() + normal.head<2>().dot(place.head<2>())) / normal.z());
    if (const auto around = heightAround(surface.points, place, radius)) raise(seen, *around);
  }
  return seen ? seen : continued;
}

}  // namespace process_visualizer::objects
