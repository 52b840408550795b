// SPDX-License-Identifier: BSD-3-Clause
// Measures the time for the labels of a picture: their plates are painted when their texts change,
// ten times a second, and all are placed in each picture.
// usage: QT_QPA_PLATFORM=offscreen bench_labels [LABELS]

#include <QGuiApplication>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "label_layout.hpp"
#include "label_plate.hpp"

namespace {

using namespace process_visualizer::displays;  // NOLINT: a program of one file

constexpr int kPictures = 600;
constexpr Size kView{1200, 870};

/// Returns the mean time of the calls, ms.
template <typename Function>
double milliseconds(int calls, Function function) {
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < calls; ++i) function(i);
  const std::chrono::duration<double, std::milli> taken = std::chrono::steady_clock::now() - begin;
  return taken.count() / calls;
}

std::vector<PlateLine> linesOf(int number) {
  return {{"v 0." + std::to_string(100 + number % 900) + " m/s", {0.65F, 0.93F, 0.68F}},
          {"F " + std::to_string(10 + number % 90) + " N", {0.96F, 0.67F, 0.67F}}};
}

float wave(int number) { return (1 + std::sin(static_cast<float>(number))) / 2; }

/// Anchors that move as tools do, all in the middle of the view, where there is least room.
std::vector<LabelLayout::Plate> platesOf(int count, int picture) {
  std::vector<LabelLayout::Plate> plates;
  for (int i = 0; i < count; ++i) {
    const float x = 300 + 600 * wave(i) + 40 * std::sin(0.02F * static_cast<float>(picture + i));
    plates.push_back({std::to_string(i), {x, 200 + 470 * wave(7 * i)}, {140, 50}});
  }
  return plates;
}

std::vector<Obstacle> robots() {
  std::vector<Obstacle> obstacles;
  for (int i = 0; i < 120; ++i)
    obstacles.push_back({{{300 + 500 * wave(3 * i), 100 + 600 * wave(5 * i)}, {50, 50}}, 60});
  return obstacles;
}

}  // namespace

int main(int argc, char** argv) {
  const QGuiApplication application(argc, argv);
  const int count = argc > 1 ? std::atoi(argv[1]) : 20;
  paintPlate(linesOf(0), 18);  // loads the font
  const double paint = milliseconds(kPictures, [](int i) { paintPlate(linesOf(i), 18); });
  LabelLayout layout;
  const std::vector<Obstacle> obstacles = robots();
  const double place = milliseconds(kPictures, [&](int picture) {
    layout.place(platesOf(count, picture), obstacles, kView, 1.0F / 60);
  });
  std::printf("%d labels, 120 obstacles: placed in %.3f ms; one plate painted in %.3f ms\n", count,
              place, paint);
}
