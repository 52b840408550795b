// SPDX-License-Identifier: BSD-3-Clause
/// Other sensors, views and speeds than those of bench/objects.cpp: how soon, how large and how
/// near to the robot unmodeled things and people are detected, compared with a plain pipeline
/// (region, planes, clusters).
///
/// usage: watch_benchmark CLOUDS SEED [sensor=NAME] [view=NAME] [rate=HZ] [scene=NAME] [late=S]
///        [plain=1] [verbose=1] [room=1]
/// CLOUDS of each combination; late: the age of the robot's poses relative to the clouds.
#include <pcl/filters/extract_indices.h>
#include <pcl/filters/voxel_grid.h>
#include <pcl/search/kdtree.h>
#include <pcl/segmentation/extract_clusters.h>
#include <pcl/segmentation/sac_segmentation.h>

#include <cstdlib>
#include <ctime>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "process_visualizer/objects/object_tracks.hpp"
#include "process_visualizer/objects/point_image.hpp"
#include "sensed_scenes.hpp"

namespace process_visualizer::objects {
namespace {

using Eigen::Isometry3f;
using Eigen::Vector3f;

constexpr int kTable = 90000;  // may be shown or not, both are right
constexpr int kFloor = 100000, kRobot = 100001, kWall = 100002;
constexpr std::size_t kClearly = 80;  // px of a thing that must be detected
constexpr float kLarge = 0.05F;       // m: two edges of its visible part
const cloud::Box kRegion({0, 0, 1.05}, {3.6, 3.6, 2.3});

/// Counts of the results. Names that begin with `narrow` use the definitions of earlier tables, for
/// comparison.
struct Figures {
  long clouds = 0, false_objects = 0, split = 0, exchanged = 0, due = 0, missed = 0, visits = 0;
  long late_visits = 0;  ///< first detected later than in the second cloud
  long distances = 0, too_large = 0;
  long narrow_false = 0, narrow_exchanged = 0, narrow_late = 0, narrow_visits = 0;
  long narrow_too_large = 0;
  long wrong_in_view = 0;  ///< edges that match neither a thing's nor those of its visible part
  long plain_false = 0, plain_missed = 0;
  float worst_distance = 0, narrow_worst = 0;
  std::vector<float> size_errors;  ///< beyond 1 cm and 1 % of the range, m
  double time_s = 0;

  void add(const Figures& it) {
    clouds += it.clouds, false_objects += it.false_objects, split += it.split;
    exchanged += it.exchanged, due += it.due, missed += it.missed, visits += it.visits;
    late_visits += it.late_visits, distances += it.distances, too_large += it.too_large;
    narrow_false += it.narrow_false, narrow_exchanged += it.narrow_exchanged;
    narrow_late += it.narrow_late, narrow_visits += it.narrow_visits;
    narrow_too_large += it.narrow_too_large, wrong_in_view += it.wrong_in_view;
    plain_false += it.plain_false, plain_missed += it.plain_missed;
    worst_distance = std::max(worst_distance, it.worst_distance);
    narrow_worst = std::max(narrow_worst, it.narrow_worst), time_s += it.time_s;
    size_errors.insert(size_errors.end(), it.size_errors.begin(), it.size_errors.end());
  }
};

struct Case {
  SensorModel sensor;
  View view;
  double rate;  ///< Hz
  SceneKind scene;
  double late;  ///< s
  bool is_in_room;
};

/// Two walls, 10 cm outside of the region, and a table in front of them.
std::vector<std::pair<Solid, int>> room() {
  const auto block = [](const Vector3f& least, const Vector3f& most) {
    return Solid{Solid::Kind::kBox, most - least,
                 Isometry3f(Eigen::Translation3f((least + most) / 2))};
  };
  return {{block({-2, -4, 0}, {-1.9F, 4, 2.8F}), kWall},
          {block({-4, -2, 0}, {4, -1.9F, 2.8F}), kWall},
          {block({-1.85F, -1.85F, 0.7F}, {-1.3F, -0.75F, 0.75F}), kTable}};
}

Eigen::AlignedBox3f boundsOf(const Thing& thing) {
  Eigen::AlignedBox3f bounds;
  for (const Solid& solid : thing.solids) {
    const Vector3f half = solids::halfExtents(solid), middle = solid.pose.translation();
    bounds.extend(Eigen::AlignedBox3f(middle - half, middle + half));
  }
  return bounds;
}

/// The pipeline of any textbook: the region, at a resolution of a centimeter, without the largest
/// planes, in clusters.
std::vector<Vector3f> plainCenters(const Points& points, const Isometry3f& pose,
                                   const cloud::InsideBox& region) {
  using Cloud = pcl::PointCloud<pcl::PointXYZ>;
  Cloud::Ptr cloud(new Cloud), thin(new Cloud);
  for (const Vector3f& place : points.places) {
    if (!place.allFinite() || !region(place)) continue;
    const Vector3f it = pose * place;
    cloud->push_back({it.x(), it.y(), it.z()});
  }
  if (cloud->empty()) return {};
  pcl::VoxelGrid<pcl::PointXYZ> grid;
  grid.setInputCloud(cloud);
  grid.setLeafSize(0.01F, 0.01F, 0.01F);
  grid.filter(*thin);
  pcl::SACSegmentation<pcl::PointXYZ> planes;
  planes.setOptimizeCoefficients(true);
  planes.setModelType(pcl::SACMODEL_PLANE);
  planes.setMethodType(pcl::SAC_RANSAC);
  planes.setMaxIterations(100);
  planes.setDistanceThreshold(0.02);
  const std::size_t all = thin->size();
  while (thin->size() > 0.3 * static_cast<double>(all)) {
    pcl::PointIndices::Ptr inliers(new pcl::PointIndices);
    pcl::ModelCoefficients coefficients;
    planes.setInputCloud(thin);
    planes.segment(*inliers, coefficients);
    if (inliers->indices.empty()) break;
    pcl::ExtractIndices<pcl::PointXYZ> extract;
    extract.setInputCloud(thin);
    extract.setIndices(inliers);
    extract.setNegative(true);
    Cloud::Ptr rest(new Cloud);
    extract.filter(*rest);
    thin = rest;
  }
  if (thin->empty()) return {};
  pcl::search::KdTree<pcl::PointXYZ>::Ptr tree(new pcl::search::KdTree<pcl::PointXYZ>);
  tree->setInputCloud(thin);
  std::vector<pcl::PointIndices> clusters;
  pcl::EuclideanClusterExtraction<pcl::PointXYZ> extraction;
  extraction.setClusterTolerance(0.03);
  extraction.setMinClusterSize(40);
  extraction.setSearchMethod(tree);
  extraction.setInputCloud(thin);
  extraction.extract(clusters);
  std::vector<Vector3f> centers;
  for (const pcl::PointIndices& cluster : clusters) {
    Vector3f sum = Vector3f::Zero();
    for (const int index : cluster.indices) sum += (*thin)[index].getVector3fMap();
    centers.emplace_back(sum / static_cast<float>(cluster.indices.size()));
  }
  return centers;
}

std::vector<std::uint8_t> readNothing(const std::string& /*name*/) { return {}; }

/// The links of the robot. Their distance fields take a second.
std::vector<KnownBody> bodies() {
  std::vector<KnownBody> result;
  for (const LinkGeometry& link : linkGeometries(sixJointRobot(), readNothing))
    result.emplace_back(link.frame, link.mesh, FinderSettings().padding + 0.01F, true);
  return result;
}

class Watch {
 public:
  Watch(const Case& it, const std::vector<KnownBody>& bodies, unsigned seed, bool is_plain,
        bool is_verbose)
      : case_(it),
        scene_(it.scene, seed),
        world_(it.sensor, seed + 1),
        robot_(sixJointRobot(), readNothing, Isometry3f::Identity()),
        finder_(bodies, {}),
        is_plain_(is_plain),
        is_verbose_(is_verbose) {
    std::mt19937 random(seed);
    robot_.drawPhases(random);
    std::uniform_real_distribution<float> any(0, 1);
    turn_ = it.is_in_room ? 0.3F + any(random) : 6.28F * any(random);
    begin_ = 10 * any(random);
  }

  Figures run(int clouds) {
    for (int number = 0; number < clouds; ++number) step(begin_ + number / case_.rate);
    return figures_;
  }

 private:
  /// Counts clouds in which a thing must be detected, by one of two definitions.
  struct Due {
    int clouds = 0;
    bool is_late = false;
  };

  struct Visit {
    Due due, narrow_due;
    bool is_seen = false;
    std::set<std::uint32_t> numbers;  ///< all that it has had
    std::uint32_t last = 0;           ///< its own number when it was last detected
    Cluster shown = {};               ///< its surface when it was last clearly visible
    Cluster measured = {};            ///< of `shown`, without mixed pixels
  };

  Isometry3f poseOf(const std::string& link, double time) const {
    return robot_.poseOf(link, (case_.view == View::kLink ? 0.3 : 0.8) * time);
  }

  Isometry3f sensorAt(double time) const {
    const float c = std::cos(turn_), s = std::sin(turn_);
    switch (case_.view) {
      case View::kAbove:
        return lookingFrom({0.1F, 0, 3.2F}, {0.1F, 0, 0});
      case View::kSlanted:
        return lookingFrom({2.1F * c, 2.1F * s, 2.4F}, {0, 0, 0.4F});
      case View::kLow:
        return lookingFrom({2.6F * c, 2.6F * s, 0.9F}, {0, 0, 0.6F});
      case View::kLink: {
        // It looks outwards from the second link, a little downwards.
        const Isometry3f link = poseOf("l1", time);
        return link * lookingFrom({0.16F, 0, 0.25F}, {1.2F, 0, -0.1F});
      }
    }
    return Isometry3f::Identity();
  }

  void draw(double time, const std::vector<Thing>& things) {
    world_.begin(sensorAt(time));
    world_.draw({Solid::Kind::kBox, {9, 9, 0.1F}, Isometry3f(Eigen::Translation3f(0, 0, -0.05F))},
                kFloor);
    if (case_.is_in_room)
      for (const auto& [solid, number] : room()) world_.draw(solid, number);
    for (const LinkGeometry& link : robot_.links())
      world_.draw(link.mesh, poseOf(link.frame, time), kRobot);
    for (const Thing& thing : things)
      for (const Solid& solid : thing.solids) world_.draw(solid, thing.number);
  }

  Scene sceneAt(double time) const {
    Scene scene;
    scene.global_from_cloud = sensorAt(time);
    for (const LinkGeometry& link : robot_.links())
      scene.cloud_from_body.push_back(sensorAt(time).inverse() *
                                      poseOf(link.frame, time - case_.late));
    scene.region.emplace(sensorAt(time).cast<double>(), kRegion);
    return scene;
  }

  std::vector<Isometry3f> trueBodies(double time) const {
    std::vector<Isometry3f> poses;
    for (const LinkGeometry& link : robot_.links()) poses.push_back(poseOf(link.frame, time));
    return poses;
  }

  void step(double time) {
    const std::vector<Thing> things = scene_.at(time);
    draw(time, things);
    const std::map<int, Cluster> pixels = placesInRegion();
    for (const auto& [number, places] : pixels)
      if (places.size() >= kClearly) visits_[number].shown = places;
    const Points points = world_.points();
    for (const auto& [number, places] : measuredIn(points))
      if (pixels.count(number) > 0 && pixels.at(number).size() >= kClearly)
        visits_[number].measured = places;
    const Scene scene = sceneAt(time);
    const std::clock_t begin = std::clock();
    const std::vector<Label> labels = finder_.label(points, scene);
    const auto found = finder_.find(points, labels, scene, tracks_.predictedAt(time));
    const auto tracked = tracks_.update(
        time, found,
        [&](const UprightBox& box) {
          return isHidden(box, points, labels, scene.global_from_cloud);
        },
        [&](const Cluster& places) { return finder_.distanceTo(places, scene); });
    figures_.time_s += static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    ++figures_.clouds;
    score(time, things, pixels, tracked);
    if (is_plain_) scorePlain(things, pixels, plainCenters(points, sensorAt(time), *scene.region));
  }

  std::map<int, Cluster> placesInRegion() const {
    return placesIf([](std::size_t /*pixel*/) { return true; });
  }

  /// Returns the points that the sensor measures up to its noise. A pixel on an edge may have any
  /// depth between a thing and its background, or none.
  std::map<int, Cluster> measuredIn(const Points& points) const {
    return placesIf([&](std::size_t pixel) {
      const Vector3f measured = world_.pose() * points.places[pixel];
      const float noise = noiseOf(case_.sensor, points.places[pixel].z());
      return (measured - world_.place(pixel)).norm() < 3 * noise + 0.005F;
    });
  }

  template <typename Counts>
  std::map<int, Cluster> placesIf(const Counts& counts) const {
    std::map<int, Cluster> places;
    const Vector3f middle = kRegion.center().cast<float>();
    const Eigen::Array3f half = kRegion.halfExtents().cast<float>();
    for (std::size_t pixel = 0; pixel < world_.things().size(); ++pixel) {
      const int thing = world_.things()[pixel];
      if (thing < 0 || thing >= kFloor || !counts(pixel)) continue;
      const Vector3f place = world_.place(pixel);
      if (((place - middle).cwiseAbs().array() < half).all()) places[thing].push_back(place);
    }
    return places;
  }

  const Thing* thingAt(const std::vector<Thing>& things, const Vector3f& center) const {
    const Thing* best = nullptr;
    float least = 0.05F + 0.02F * (center - sensor()).norm();
    for (const Thing& thing : things) {
      const float away = std::sqrt(boundsOf(thing).squaredExteriorDistance(center));
      if (away >= least) continue;
      least = away;
      best = &thing;
    }
    return best;
  }

  Vector3f sensor() const { return sensor_; }

  void score(double time, const std::vector<Thing>& things, const std::map<int, Cluster>& pixels,
             const std::vector<TrackedObject>& tracked) {
    sensor_ = sensorAt(time).translation();
    std::map<int, int> times;
    std::map<int, const TrackedObject*> nearest;
    std::set<int> seen;
    std::map<int, std::map<std::uint32_t, std::size_t>> numbers;  // and points
    for (const TrackedObject& it : tracked) {
      const Thing* thing = thingAt(things, it.object.box.center);
      if (!thing) {
        if (it.is_seen) falseObject(time, it, pixels);
        continue;
      }
      const TrackedObject*& known = nearest[thing->number];
      if (it.object.robot && (!known || it.object.robot->distance < known->object.robot->distance))
        known = &it;
      if (!it.is_seen) continue;
      seen.insert(thing->number);
      ++times[thing->number];
      numbers[thing->number][it.number] = it.object.points;
      scoreNumber(time, *thing, it);
      scoreSize(time, *thing, it, pixels);
    }
    for (const auto& [number, now] : numbers) scoreNumbers(time, number, now);
    for (const Thing& thing : things)
      if (nearest.count(thing.number) > 0 && nearest[thing.number])
        scoreDistance(time, thing, *nearest[thing.number], tracked,
                      pixels.count(thing.number) > 0 && pixels.at(thing.number).size() >= kClearly);
    for (const auto& [number, count] : times) figures_.split += count > 1 ? 1 : 0;
    for (const Thing& thing : things) {
      const auto shown = pixels.find(thing.number);
      const bool is_due = shown != pixels.end() && shown->second.size() >= kClearly;
      Visit& visit = visits_[thing.number];
      visit.is_seen = visit.is_seen || seen.count(thing.number) > 0;
      if (!is_due || isNearRobot(time, thing)) continue;
      ++figures_.due;
      count(visit.narrow_due, visit.is_seen, figures_.narrow_visits, figures_.narrow_late);
      if (isLarge(shown->second) && !isEntered(thing, things)) {
        count(visit.due, visit.is_seen, figures_.visits, figures_.late_visits);
        if (is_verbose_ && visit.due.clouds == 2 && visit.due.is_late)
          std::printf("%.2f s: thing %d is late\n", time, thing.number);
      }
      if (seen.count(thing.number) == 0 && visit.narrow_due.clouds > 1) {
        ++figures_.missed;
        if (is_verbose_)
          std::printf("%.2f s: thing %d (%zu px) is not seen\n", time, thing.number,
                      shown->second.size());
      }
    }
  }

  static void count(Due& due, bool is_seen, long& visits, long& late) {
    ++due.clouds;
    visits += due.clouds == 1 ? 1 : 0;
    due.is_late = due.clouds == 2 && !is_seen;
    late += due.is_late ? 1 : 0;
  }

  /// Returns true if the visible part of a thing is larger than 5 cm in two directions.
  static bool isLarge(const Cluster& shown) {
    const Vector3f size = boxAround(shown).size;
    return size.sum() - size.maxCoeff() - size.minCoeff() > kLarge;
  }

  /// Returns true if another thing passes through it, as people do in these scenes.
  static bool isEntered(const Thing& thing, const std::vector<Thing>& things) {
    return std::any_of(things.begin(), things.end(), [&](const Thing& other) {
      return other.number != thing.number &&
             std::any_of(other.solids.begin(), other.solids.end(), [&](const Solid& solid) {
               return boundsOf({0, {solid}}).intersects(boundsOf(thing));
             });
    });
  }

  /// Returns the number of pixels of each thing that are in the box of an object.
  std::map<int, std::size_t> contents(const TrackedObject& it,
                                      const std::map<int, Cluster>& pixels) const {
    std::map<int, std::size_t> contents;
    const float margin = marginAt(it.object.box.center);
    for (const auto& [number, places] : pixels)
      for (const Vector3f& place : places)
        if (distanceTo(it.object.box, place) < margin) ++contents[number];
    return contents;
  }

  /// Returns the permitted distance of a thing's box beyond its pixels, m.
  float marginAt(const Vector3f& place) const {
    return 0.02F + 3 * noiseOf(case_.sensor, (place - sensor()).norm());
  }

  /// Handles an object whose center is at no thing. It is false unless most of its points are on
  /// things: a pole and an arm that are merged into one object have their center between both.
  void falseObject(double time, const TrackedObject& it, const std::map<int, Cluster>& pixels) {
    ++figures_.narrow_false;
    std::size_t real = 0;
    for (const auto& [number, count] : contents(it, pixels)) {
      real += count;
      if (is_verbose_) std::printf("%.2f s: %zu px of thing %d are in:\n", time, count, number);
    }
    figures_.false_objects += 2 * real < it.object.points ? 1 : 0;
    if (is_verbose_)
      std::printf("%.2f s: false object %u at %.2f %.2f %.2f, %.2f x %.2f x %.2f, %zu points\n",
                  time, it.number, it.object.box.center.x(), it.object.box.center.y(),
                  it.object.box.center.z(), it.object.box.size.x(), it.object.box.size.y(),
                  it.object.box.size.z(), it.object.points);
  }

  bool isNearRobot(double time, const Thing& thing) const {
    const Cluster& shown = visits_.at(thing.number).shown;
    const auto way = distanceToRobots(shown, finder_.bodies(), trueBodies(time));
    return way && way->distance < 0.08F;
  }

  /// Scores the distance of a thing as the sensor sees it, or saw it last if it is static. The
  /// shown distance is the least of all objects whose box contains the thing's nearest point.
  void scoreDistance(double time, const Thing& thing, const TrackedObject& nearest,
                     const std::vector<TrackedObject>& tracked, bool is_shown) {
    const auto visit = visits_.find(thing.number);
    if (visit == visits_.end() || visit->second.shown.empty()) return;
    if (!is_shown && !thing.stands) return;
    const auto way = distanceToRobots(visit->second.shown, finder_.bodies(), trueBodies(time));
    if (!way) return;
    const Vector3f middle = nearest.object.box.center;
    const float noise = 3 * noiseOf(case_.sensor, (middle - sensor()).norm());
    const float narrow = nearest.object.robot->distance - way->distance - noise;
    float wrong = 0, shown = nearest.object.robot->distance;
    const Cluster& measured = visit->second.measured;
    if (!measured.empty()) {
      const auto clear = distanceToRobots(measured, finder_.bodies(), trueBodies(time));
      for (const TrackedObject& it : tracked)
        if (it.object.robot &&
            objects::distanceTo(it.object.box, clear->on_object) < marginAt(it.object.box.center))
          shown = std::min(shown, it.object.robot->distance);
      wrong = shown - clear->distance - noise;
    }
    ++figures_.distances;
    figures_.narrow_worst = std::max(figures_.narrow_worst, narrow);
    figures_.worst_distance = std::max(figures_.worst_distance, wrong);
    figures_.too_large += wrong < 0.02F ? 0 : 1;
    figures_.narrow_too_large += narrow < 0.02F ? 0 : 1;
    if (is_verbose_ && narrow >= 0.02F)
      std::printf(
          "%.2f s: thing %d is %.3f m away, not %.3f (%s %u); in a box with less: %.3f, wrong by "
          "%.3f; %.2f %.2f %.2f\n",
          time, thing.number, way->distance, nearest.object.robot->distance,
          nearest.is_seen ? "seen" : "hidden", nearest.number, shown, wrong, way->on_object.x(),
          way->on_object.y(), way->on_object.z());
  }

  /// The number of a thing is the one it had when it was last detected, as long as an object with
  /// it shows the thing, else that of the largest object: then it is exchanged (the mismatch of
  /// Bernardin and Stiefelhagen 2008). A person with two numbers at once counts as `split`.
  void scoreNumbers(double time, int thing, const std::map<std::uint32_t, std::size_t>& now) {
    Visit& visit = visits_[thing];
    if (now.count(visit.last) > 0) return;
    const std::uint32_t number =
        std::max_element(now.begin(), now.end(), [](const auto& one, const auto& other) {
          return one.second < other.second;
        })->first;
    const bool is_exchanged = visit.last != 0;
    figures_.exchanged += is_exchanged ? 1 : 0;
    if (is_exchanged && is_verbose_)
      std::printf("%.2f s: thing %d: %u exchanged for %u\n", time, thing, visit.last, number);
    visit.last = number;
  }

  void scoreNumber(double time, const Thing& thing, const TrackedObject& it) {
    Visit& visit = visits_[thing.number];
    const std::uint32_t number = it.number;
    const bool is_new = !visit.numbers.empty() && visit.numbers.count(number) == 0;
    figures_.narrow_exchanged += is_new ? 1 : 0;
    if (is_verbose_)
      std::printf(
          "%.2f s: thing %d has number %u%s at %.2f %.2f %.2f, %.2f x %.2f x %.2f, %zu points\n",
          time, thing.number, number, is_new ? ", new," : "", it.object.box.center.x(),
          it.object.box.center.y(), it.object.box.center.z(), it.object.box.size.x(),
          it.object.box.size.y(), it.object.box.size.z(), it.object.points);
    visit.numbers.insert(number);
  }

  /// Compares edges in the order of a box with those of a thing's visible part along them.
  void scoreSize(double time, const Thing& thing, const TrackedObject& it,
                 const std::map<int, Cluster>& pixels) {
    if (!thing.stands || it.object.isTruncated()) return;
    const UprightBox& box = it.object.box;
    Vector3f size = box.size, expected = thing.solids[0].size, in_view = Vector3f::Zero();
    if (pixels.count(thing.number) > 0) {
      Eigen::AlignedBox3f bounds;
      for (const Vector3f& place : pixels.at(thing.number)) bounds.extend(inBox(box, place));
      in_view = bounds.sizes();
    }
    if (size.x() > size.y()) {
      std::swap(size.x(), size.y());
      std::swap(in_view.x(), in_view.y());
    }
    std::sort(expected.data(), expected.data() + 2);
    const float allowed = 0.01F + 0.01F * (box.center - sensor()).norm();
    for (int axis = 0; axis < 3; ++axis) {
      const float error = std::abs(size[axis] - expected[axis]) - allowed;
      figures_.size_errors.push_back(error);
      if (error <= 0) continue;
      const bool is_as_seen = std::abs(size[axis] - in_view[axis]) < allowed;
      figures_.wrong_in_view += is_as_seen ? 0 : 1;
      if (is_verbose_)
        std::printf("%.2f s: thing %d: edge %d is %.3f m, not %.3f, of which %.3f are in view\n",
                    time, thing.number, axis, size[axis], expected[axis], in_view[axis]);
    }
  }

  void scorePlain(const std::vector<Thing>& things, const std::map<int, Cluster>& pixels,
                  const std::vector<Vector3f>& centers) {
    std::set<int> seen;
    for (const Vector3f& center : centers) {
      const Thing* thing = thingAt(things, center);
      if (thing) seen.insert(thing->number);
      figures_.plain_false += thing ? 0 : 1;
    }
    for (const auto& [number, count] : pixels)
      figures_.plain_missed += count.size() >= kClearly && seen.count(number) == 0 ? 1 : 0;
  }

  Case case_;
  SensedScene scene_;
  SensedWorld world_;
  MovingRobot robot_;
  ObjectFinder finder_;
  ObjectTracks tracks_;
  bool is_plain_, is_verbose_;
  float turn_ = 0;
  double begin_ = 0;
  Vector3f sensor_ = Vector3f::Zero();
  std::map<int, Visit> visits_;
  Figures figures_;
};

void printRow(const std::string& name, const Figures& it, bool is_plain) {
  const double thousand = 1000.0 / static_cast<double>(std::max(it.clouds, 1L));
  const auto wrong = std::count_if(it.size_errors.begin(), it.size_errors.end(),
                                   [](float error) { return error > 0; });
  std::printf(
      "| %s | %ld | %.1f | %.1f | %.1f | %ld of %ld | %ld of %ld | %.1f %% | %.1f %% | %.2f %% | "
      "%.0f mm | %.1f ms | %.1f | %.1f | %ld of %ld | %.2f %% | %.0f mm |",
      name.c_str(), it.clouds, thousand * static_cast<double>(it.false_objects),
      thousand * static_cast<double>(it.exchanged), thousand * static_cast<double>(it.split),
      it.late_visits, it.visits, it.missed, it.due,
      100.0 * static_cast<double>(wrong) /
          static_cast<double>(std::max<std::size_t>(it.size_errors.size(), 1)),
      100.0 * static_cast<double>(it.wrong_in_view) /
          static_cast<double>(std::max<std::size_t>(it.size_errors.size(), 1)),
      100.0 * static_cast<double>(it.too_large) / static_cast<double>(std::max(it.distances, 1L)),
      1000 * it.worst_distance, 1000 * it.time_s / static_cast<double>(it.clouds),
      thousand * static_cast<double>(it.narrow_false),
      thousand * static_cast<double>(it.narrow_exchanged), it.narrow_late, it.narrow_visits,
      100.0 * static_cast<double>(it.narrow_too_large) /
          static_cast<double>(std::max(it.distances, 1L)),
      1000 * it.narrow_worst);
  if (is_plain)
    std::printf(" %.1f | %ld |", static_cast<double>(it.plain_false) * thousand, it.plain_missed);
  std::printf("\n");
  std::fflush(stdout);
}

std::map<std::string, std::string> optionsOf(int argc, char** argv) {
  std::map<std::string, std::string> options;
  for (int number = 3; number < argc; ++number) {
    const std::string text = argv[number];
    const std::size_t end = text.find('=');
    if (end != std::string::npos) options[text.substr(0, end)] = text.substr(end + 1);
  }
  return options;
}

}  // namespace
}  // namespace process_visualizer::objects

int main(int argc, char** argv) {
  using namespace process_visualizer::objects;
  if (argc < 3) return 1;
  auto options = optionsOf(argc, argv);
  const auto isAsked = [&](const char* option, const std::string& name) {
    return options.count(option) == 0 || options[option] == name;
  };
  const double late = options.count("late") > 0 ? std::atof(options["late"].c_str()) : 0;
  const bool is_plain = options.count("plain") > 0, is_verbose = options.count("verbose") > 0;
  const bool is_in_room = options.count("room") > 0;
  std::printf(
      "| | clouds | false objects in 1,000 | exchanged numbers | seen as several | seen "
      "late | not seen | sizes wrong | also of what is in view | distance too large | by | time | "
      "as counted before: false | "
      "exchanged | late | too large | by |%s\n",
      is_plain ? " plain: false | not seen |" : "");
  std::map<std::string, Figures> groups;
  Figures all;
  const std::vector<KnownBody> known = bodies();
  unsigned seed = static_cast<unsigned>(std::atoi(argv[2])) * 1000;
  for (const SensorModel& sensor : {kinect(), realsense(), timeOfFlight()})
    for (const View view : {View::kAbove, View::kSlanted, View::kLow, View::kLink})
      for (const double rate : {5.0, 10.0, 30.0})
        for (const SceneKind scene : {SceneKind::kThings, SceneKind::kPerson, SceneKind::kFast}) {
          ++seed;
          if (!isAsked("sensor", sensor.name) || !isAsked("view", nameOf(view)) ||
              !isAsked("rate", std::to_string(static_cast<int>(rate))) ||
              !isAsked("scene", nameOf(scene)))
            continue;
          const Figures it = Watch({sensor, view, rate, scene, late, is_in_room}, known, seed,
                                   is_plain, is_verbose)
                                 .run(std::atoi(argv[1]));
          const std::string hertz = std::to_string(static_cast<int>(rate)) + " Hz";
          if (is_verbose)
            printRow(sensor.name + " " + nameOf(view) + " " + hertz + " " + nameOf(scene), it,
                     is_plain);
          for (const std::string& name : {"1 " + sensor.name, "2 " + std::string(nameOf(view)),
                                          "3 " + std::string(rate < 10 ? " " : "") + hertz,
                                          "4 " + std::string(nameOf(scene))})
            groups[name].add(it);
          all.add(it);
        }
  for (const auto& [name, it] : groups) printRow(name.substr(2), it, is_plain);
  printRow("all", all, is_plain);
  return 0;
}
