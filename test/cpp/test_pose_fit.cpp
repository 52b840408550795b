// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "process_visualizer/cloud/line_of_sight.hpp"
#include "process_visualizer/cloud/pose_fit.hpp"

namespace process_visualizer::cloud {
namespace {

using Points = pcl::PointCloud<pcl::PointXYZ>;

constexpr double kSpacing = 0.005;
constexpr double kDegree = M_PI / 180.0;
const Eigen::Vector3f kSensor(0.1F, -0.2F, 1.9F);  // looks down

Eigen::Affine3d at(double x, double y, double z, double yaw = 0.0, double roll = 0.0) {
  return Eigen::Translation3d(x, y, z) * Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
         Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX());
}

/// A table with a machine on it, a tube and a ball, seen from above like a robot cell.
SurfaceCloud cell() {
  SurfaceCloud model;
  addPoints(boxSurface({0.9F, 0.5F, 0.03F}), at(0, 0, -0.015), kSpacing, model);
  addPoints(boxSurface({0.2F, 0.4F, 0.3F}), at(0.4, 0.1, 0.15, 0.5), kSpacing, model);
  addPoints(cylinderSurface({0.2F, 0.2F, 0.7F}), at(-0.1, 0.1, 0.4, 0.3, M_PI_2), kSpacing, model);
  addPoints(sphereSurface({0.4F, 0.4F, 0.4F}), at(-0.4, -0.3, 0.3), kSpacing, model);
  return model;
}

/// Points of a model that a sensor sees, with noise along its rays, and points on no model.
Points seen(const SurfaceCloud& model, double noise_m) {
  std::mt19937 random(3);
  std::normal_distribution<float> noise(0.0F, static_cast<float>(noise_m));
  Points cloud;
  const auto add = [&](const Eigen::Vector3f& place) {
    const Eigen::Vector3f ray = (place - kSensor).normalized();
    const Eigen::Vector3f measured = place + noise(random) * ray;
    cloud.push_back({measured.x(), measured.y(), measured.z()});
  };
  for (const auto& point : visibleFrom(kSensor, model, kSpacing)) add(placeOf(point));
  SurfaceCloud unknown;
  addPoints(boxSurface({0.3F, 0.2F, 0.02F}), at(-0.4, 0.2, 0.02), kSpacing, unknown);
  for (const auto& point : visibleFrom(kSensor, unknown, kSpacing)) add(placeOf(point));
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  cloud.push_back({kNaN, 0.0F, 0.0F});
  return cloud;
}

/// A calibration error: the sensor is turned about its own position, and moved.
Eigen::Isometry3d displacement(const Eigen::Vector3d& shift_m, const Eigen::Vector3d& axis,
                               double angle) {
  const Eigen::Vector3d eye = kSensor.cast<double>();
  return Eigen::Translation3d(eye + shift_m) * Eigen::AngleAxisd(angle, axis.normalized()) *
         Eigen::Translation3d(-eye);
}

Points moved(const Points& cloud, const Eigen::Isometry3d& motion) {
  Points result;
  for (const auto& point : cloud) {
    const Eigen::Vector3f place = (motion * placeOf(point).cast<double>()).cast<float>();
    result.push_back({place.x(), place.y(), place.z()});
  }
  return result;
}

PoseFit fitted(const Points& cloud, const SurfaceCloud& model, const Eigen::Isometry3d& motion) {
  return fitPose(moved(cloud, motion), (motion * kSensor.cast<double>()).cast<float>(), model,
                 kSpacing);
}

std::string refusal(const Points& cloud, const SurfaceCloud& model) {
  try {
    fitted(cloud, model, Eigen::Isometry3d::Identity());
  } catch (const FitRefused& refused) {
    return refused.what();
  }
  return "";
}

TEST(PoseFit, RecoversTwentyMillimetresAndTwoDegrees) {
  const SurfaceCloud model = cell();
  const Points cloud = seen(model, 0.003);
  const Eigen::Vector3d eye = kSensor.cast<double>();
  for (int axis = 0; axis < 3; ++axis) {
    const auto motion = displacement(0.02 * Eigen::Vector3d::Unit(axis),
                                     Eigen::Vector3d::Unit((axis + 1) % 3), 2.0 * kDegree);
    const PoseFit fit = fitted(cloud, model, motion);
    const Eigen::Isometry3d rest = fit.correction * motion;
    EXPECT_LT((rest * eye - eye).norm(), 0.001);
    EXPECT_LT(Eigen::AngleAxisd(rest.linear()).angle(), 0.1 * kDegree);
    EXPECT_LT(fit.residual_m, 0.0015);
    EXPECT_GT(fit.before_m, 0.003);
  }
}

TEST(PoseFit, TellsTheDistanceBeforeOfTheSamePointsAsBehind) {
  const SurfaceCloud model = cell();
  Points cloud = seen(model, 0.0);
  const std::size_t count = cloud.size();
  for (std::size_t i = 0; i < count; i += 3)  // something thick lies on the models
    cloud.push_back({cloud[i].x, cloud[i].y, cloud[i].z + 0.05F});
  const PoseFit fit =
      fitted(cloud, model, displacement({0.002, 0.0, 0.0}, Eigen::Vector3d::UnitZ(), 0.0));
  EXPECT_LT(fit.before_m, 0.0025);  // the motion explains it
}

TEST(PoseFit, IsNotDrawnAsideByWhatBulgesOrHasEdges) {
  const SurfaceCloud model = cell();
  const Eigen::Vector3d eye = kSensor.cast<double>();
  const auto motion = displacement({0.01, -0.01, 0.01}, {1.0, 2.0, 3.0}, 1.0 * kDegree);
  const PoseFit fit = fitted(seen(model, 0.0), model, motion);
  EXPECT_LT((fit.correction * motion * eye - eye).norm(), 0.0001);
}

TEST(PoseFit, RefusesAPlaneAndNamesTheFreeDirection) {
  SurfaceCloud table;
  addPoints(boxSurface({1.2F, 0.8F, 0.03F}), at(0, 0, -0.015), kSpacing, table);
  const std::string text = refusal(seen(table, 0.001), table);
  EXPECT_NE(text.find("nothing in view holds the sensor against"), std::string::npos) << text;
}

TEST(PoseFit, RefusesAFewPointsAndNone) {
  const SurfaceCloud model = cell();
  Points few = seen(model, 0.001);
  few.resize(200);
  EXPECT_NE(refusal(few, model).find("points lie on the models"), std::string::npos);
  EXPECT_NE(refusal(Points(), model).find("only 0 points"), std::string::npos);
  EXPECT_NE(refusal(few, SurfaceCloud()).find("only 0 points"), std::string::npos);
}

TEST(PoseFit, RefusesACloudOfSomethingElse) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> anywhere(-0.5F, 0.5F);
  Points cloud;
  for (int i = 0; i < 50'000; ++i)
    cloud.push_back({anywhere(random), anywhere(random), anywhere(random)});
  EXPECT_NE(refusal(cloud, cell()), "");
}

TEST(PoseObservability, NamesWhatNothingHolds) {
  SurfaceCloud tube;  // along z: free along and about z
  addPoints(cylinderSurface({0.2F, 0.2F, 1.0F}), at(0, 0, 0), kSpacing, tube);
  SurfaceCloud wall;
  for (const auto& point : tube)
    if (std::abs(point.normal_z) < 0.5F) wall.push_back(point);
  const PoseObservability observability(wall);
  EXPECT_LT(observability.weakest(), 1e-4);
  EXPECT_EQ(observability.freeMotion().back(), 'z') << observability.freeMotion();
  EXPECT_GT(PoseObservability(cell()).weakest(), 0.05);
}

TEST(Surface, PointsLookOutwardsWhateverTheTrianglesOrder) {
  Surface box = boxSurface({1, 2, 3});
  for (const bool is_turned : {false, true}) {
    if (is_turned)
      for (auto& triangle : box) std::swap(triangle[0], triangle[1]);
    SurfaceCloud points;
    addPoints(box, at(5, 6, 7, 1.0), 0.05, points);
    EXPECT_NEAR(static_cast<double>(points.size()), 22.0 / (0.05 * 0.05), 10.0);
    for (const auto& point : points)
      EXPECT_GT(normalOf(point).dot(placeOf(point) - Eigen::Vector3f(5, 6, 7)), 0.0F);
  }
}

TEST(Surface, HidesWhatIsBehindAndBelow) {
  SurfaceCloud points;
  addPoints(boxSurface({1, 1, 0.1F}), at(0, 0, 0), kSpacing, points);
  addPoints(boxSurface({0.5F, 0.5F, 0.1F}), at(0, 0, -0.5), kSpacing, points);
  for (const auto& point : visibleFrom({0, 0, 2}, points, kSpacing)) {
    EXPECT_NEAR(point.z, 0.05F, 1e-5F);
  }
}

TEST(SurfaceFile, ReadsStlAndCollada) {
  const std::string stl =
      "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 2 0 0\nvertex 0 3 0\n"
      "endloop\nendfacet\nendsolid a\n";
  const Surface surface = readSurface({stl.begin(), stl.end()}, "a.stl");
  ASSERT_EQ(surface.size(), 1U);
  EXPECT_EQ(surface[0][1], Eigen::Vector3f(2, 0, 0));
  const std::string text =
      R"(<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset>
      <unit meter="0.01"/><up_axis>Y_UP</up_axis></asset><library_geometries><geometry id="g"><mesh>
      <source id="p"><float_array id="f" count="9">0 0 0 100 0 0 0 0 200</float_array>
      <technique_common><accessor source="#f" count="3" stride="3"><param name="X" type="float"/>
      <param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common>
      </source><vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
      <triangles count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles>
      </mesh></geometry></library_geometries><library_visual_scenes><visual_scene id="s"><node id="n">
      <instance_geometry url="#g"/></node></visual_scene></library_visual_scenes><scene>
      <instance_visual_scene url="#s"/></scene></COLLADA>)";
  const Surface scaled = readSurface({text.begin(), text.end()}, "a.dae");
  ASSERT_EQ(scaled.size(), 1U);
  EXPECT_LT((scaled[0][1] - Eigen::Vector3f(1, 0, 0)).norm(), 1e-6F);
  EXPECT_LT((scaled[0][2] - Eigen::Vector3f(0, 0, 2)).norm(), 1e-6F);
}

TEST(SurfaceFile, RefusesWhatIsNoMesh) {
  const std::string text = "this is no mesh";
  for (const char* extension : {"dae", "stl", "obj", "xyz", ""})
    EXPECT_THROW(readSurface({text.begin(), text.end()}, extension), std::invalid_argument);
  EXPECT_THROW(readSurface({}, "a.stl"), std::invalid_argument);
}

}  // namespace
}  // namespace process_visualizer::cloud

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
