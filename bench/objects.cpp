// SPDX-License-Identifier: BSD-3-Clause
/// Measures how well, and how fast, moving robots are removed from the clouds of a depth camera,
/// and objects are found in the rest.
///
/// usage: objects_benchmark FRAMES SCENES SPEED_RAD_PER_S DELAY_S URDF...
/// DELAY_S is the age of the robots' poses relative to the clouds. The first scene is always the
/// same; sizes, positions, speeds and phases of the others are drawn from their numbers.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <iostream>
#include <iterator>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "objects_scene.hpp"
#include "process_visualizer/objects/object_tracks.hpp"
#include "process_visualizer/objects/point_image.hpp"

namespace process_visualizer::objects {
namespace {

using Eigen::Isometry3f;
using Eigen::Vector3f;

constexpr std::int8_t kTable = 0, kRobot = 1, kObject = 2;
constexpr double kRate = 30;  // Hz

std::vector<std::uint8_t> readFile(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

/// Number, time and state of a real object when it was last seen.
struct Sight {
  std::uint32_t number;
  double time;  ///< s
};

struct Figures {
  long robot = 0, missed = 0, others = 0, taken = 0, false_objects = 0, seen = 0, frames = 0;
  long twice = 0;      ///< cases in which one object had two numbers at once
  long exchanged = 0;  ///< cases in which one had another number than when it was last seen
  long exchanged_late = 0, occlusions = 0;  ///< of 0.5 s or more
  double label_s = 0, find_s = 0, track_s = 0;
  std::vector<float> size_errors;  ///< of edges of objects that stand on the table, m
};

/// Processor time, s, which other programs do not change.
double since(std::clock_t begin) {
  return static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
}

void count(Figures& figures, const DepthCamera& camera, const std::vector<Label>& labels) {
  for (std::size_t pixel = 0; pixel < labels.size(); ++pixel) {
    const std::int8_t thing = camera.things()[pixel];
    if (thing < 0) continue;  // nothing, or an artifact
    const bool is_free = labels[pixel] == Label::kFree;
    if (thing == kRobot) {
      ++figures.robot;
      figures.missed += is_free ? 1 : 0;
    } else {
      ++figures.others;
      figures.taken += is_free ? 0 : 1;
    }
  }
}

void compareSize(Figures& figures, const MovingObject& object, Vector3f size) {
  if (!object.stands()) return;  // it hovers: its lower side is not visible
  Vector3f expected = object.size;
  std::sort(size.data(), size.data() + 2);
  std::sort(expected.data(), expected.data() + 2);
  for (int axis = 0; axis < 3; ++axis)
    figures.size_errors.push_back(std::abs(size[axis] - expected[axis]));
}

/// Compares tracked objects with the real ones of one scene.
class Comparison {
 public:
  explicit Comparison(std::vector<MovingObject> objects) : objects_(std::move(objects)) {}

  void compare(Figures& figures, const std::vector<TrackedObject>& tracked, double time) {
    for (const TrackedObject& it : tracked) {
      if (!it.is_seen) continue;
      const std::size_t object = nearestTo(it.object.box.center, time);
      if (beside(object, it.object.box.center, time) > kBeside) {
        ++figures.false_objects;
        continue;
      }
      ++figures.seen;
      compareSize(figures, objects_[object], it.object.box.size);
      compareNumber(figures, object, {it.number, time});
    }
  }

 private:
  static constexpr float kBeside = 0.05F;  // m: a farther point belongs to another object

  /// Returns the distance of a point from an object, seen from above, m.
  float beside(std::size_t object, const Vector3f& place, double time) const {
    const Vector3f inside = objects_[object].poseAt(time).inverse() * place;
    return (inside.cwiseAbs() - objects_[object].size / 2).cwiseMax(0).head<2>().norm();
  }

  std::size_t nearestTo(const Vector3f& place, double time) const {
    std::size_t nearest = 0;
    for (std::size_t object = 1; object < objects_.size(); ++object)
      if (beside(object, place, time) < beside(nearest, place, time)) nearest = object;
    return nearest;
  }

  void compareNumber(Figures& figures, std::size_t object, const Sight& sight) {
    const auto [known, is_new] = last_.emplace(object, sight);
    if (is_new) return;
    const bool is_late = sight.time - known->second.time > 0.5;
    figures.occlusions += is_late ? 1 : 0;
    if (known->second.time == sight.time) ++figures.twice;
    if (known->second.number != sight.number)
      ++(is_late ? figures.exchanged_late : figures.exchanged);
    known->second = sight;
  }

  std::vector<MovingObject> objects_;
  std::map<std::size_t, Sight> last_;
};

void print(const Figures& it) {
  const auto percent = [](long part, long whole) { return 100.0 * part / std::max(whole, 1L); };
  const auto frames = static_cast<double>(it.frames);
  std::printf("| points on robots left, of all | %ld of %ld: %.4f %% |\n", it.missed, it.robot,
              percent(it.missed, it.robot));
  std::printf("| other points taken out | %ld of %ld: %.3f %% |\n", it.taken, it.others,
              percent(it.taken, it.others));
  std::printf("| objects seen of 5, mean | %.2f |\n", static_cast<double>(it.seen) / frames);
  std::printf("| objects that are none | %ld |\n", it.false_objects);
  std::printf("| objects seen as two at once | %ld |\n", it.twice);
  std::vector<float> errors = it.size_errors;
  std::sort(errors.begin(), errors.end());
  std::printf("| error of sizes, 99 of 100 | %.1f mm |\n", 1000 * errors[errors.size() * 99 / 100]);
  std::printf("| exchanged numbers in %ld clouds | %ld |\n", it.frames, it.exchanged);
  std::printf("| more of them after occlusions of more than 0.5 s | %ld of %ld |\n",
              it.exchanged_late, it.occlusions);
  std::printf("| per cloud: models taken out | %.1f ms |\n", 1000 * it.label_s / frames);
  std::printf("| per cloud: planes, objects, distances | %.1f ms |\n", 1000 * it.find_s / frames);
  std::printf("| per cloud: numbers | %.2f ms |\n", 1000 * it.track_s / frames);
}

std::vector<KnownBody> bodiesOf(const std::vector<MovingRobot>& robots) {
  const std::clock_t begin = std::clock();
  std::vector<KnownBody> bodies;
  for (const MovingRobot& robot : robots)
    for (const LinkGeometry& link : robot.links())
      bodies.emplace_back(link.frame, link.mesh, FinderSettings().padding + 0.01F, true);
  bodies.emplace_back("board", cloud::boxSurface(Board().size), FinderSettings().padding + 0.01F,
                      true);
  std::printf("| %zu links prepared in | %.1f s |\n", bodies.size(), since(begin));
  return bodies;
}

/// The cell, frame by frame.
class Benchmark {
 public:
  /// \param speed  of all joints, rad/s
  /// \param delay  age of the robots' poses relative to the clouds, s
  Benchmark(std::vector<MovingRobot> robots, double speed, double delay)
      : robots_(std::move(robots)), finder_(bodiesOf(robots_), {}), speed_(speed), delay_(delay) {}

  void run(Figures& figures, unsigned scene, int frames) {
    random_.seed(scene + 1);
    if (scene > 0)
      for (MovingRobot& robot : robots_) robot.drawPhases(random_);
    objects_ = scene == 0 ? firstObjects() : drawnObjects(random_);
    tracks_.reset();
    Comparison comparison(objects_);
    for (int frame = 0; frame < frames; ++frame) step(figures, comparison, frame / kRate);
  }

 private:
  void step(Figures& figures, Comparison& comparison, double time) {
    DepthCamera camera = picture(time);
    const Points points = camera.points(random_);
    const Scene scene = sceneAt(time);
    std::clock_t begin = std::clock();
    const std::vector<Label> labels = finder_.label(points, scene);
    figures.label_s += since(begin);
    begin = std::clock();
    const std::vector<FoundObject> found =
        finder_.find(points, labels, scene, tracks_.predictedAt(time));
    figures.find_s += since(begin);
    begin = std::clock();
    const std::vector<TrackedObject> tracked =
        tracks_.update(time, found, [&](const UprightBox& box) {
          return isHidden(box, points, labels, scene.global_from_cloud);
        });
    figures.track_s += since(begin);
    count(figures, camera, labels);
    comparison.compare(figures, tracked, time);
    ++figures.frames;
  }

  DepthCamera picture(double time) const {
    DepthCamera camera(camera_pose_);
    camera.draw(cloud::boxSurface({4, 4, 0.1F}), Isometry3f(Eigen::Translation3f(0, 0, -0.05F)),
                kTable);
    for (const MovingRobot& robot : robots_)
      for (const LinkGeometry& link : robot.links())
        camera.draw(link.mesh, robot.poseOf(link.frame, speed_ * time), kRobot);
    camera.draw(cloud::boxSurface(Board().size), Board().poseAt(time), kRobot);
    for (const MovingObject& object : objects_)
      camera.draw(cloud::boxSurface(object.size), object.poseAt(time), kObject);
    return camera;
  }

  Scene sceneAt(double time) const {
    Scene scene;
    scene.global_from_cloud = camera_pose_;
    for (const MovingRobot& robot : robots_)
      for (const LinkGeometry& link : robot.links())
        scene.cloud_from_body.push_back(camera_pose_.inverse() *
                                        robot.poseOf(link.frame, speed_ * (time - delay_)));
    scene.cloud_from_body.push_back(camera_pose_.inverse() * Board().poseAt(time - delay_));
    return scene;
  }

  const Isometry3f camera_pose_ = lookingDown({0.1F, 0, 2.2F});
  std::vector<MovingRobot> robots_;
  std::vector<MovingObject> objects_;
  ObjectFinder finder_;
  ObjectTracks tracks_;
  std::mt19937 random_;
  double speed_, delay_;
};

MovingRobot readRobot(const char* path, float x) {
  const std::vector<std::uint8_t> urdf = readFile(path);
  return {std::string(urdf.begin(), urdf.end()), readFile,
          Isometry3f(Eigen::Translation3f(x, 0, 0.05F))};
}

}  // namespace
}  // namespace process_visualizer::objects

int main(int argc, char** argv) {
  using namespace process_visualizer::objects;
  if (argc < 6) return 1;
  std::vector<MovingRobot> robots;
  for (int number = 5; number < argc; ++number)
    robots.push_back(readRobot(argv[number], 0.5F * static_cast<float>(number - 5)));
  Benchmark benchmark(std::move(robots), std::atof(argv[3]), std::atof(argv[4]));
  Figures figures;
  for (int scene = 0; scene < std::atoi(argv[2]); ++scene)
    benchmark.run(figures, static_cast<unsigned>(scene), std::atoi(argv[1]));
  print(figures);
  return 0;
}
