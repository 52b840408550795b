// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <QLabel>
#include <functional>

namespace process_visualizer::displays {

/// Hangs in front of a scene that has not been drawn yet, and says so: models are read while the
/// first picture is drawn, and the window would be black until then.
class ReplayCurtain : public QLabel {
 public:
  /// \param scene what it covers
  /// \param seen called once, when it has been painted: drawing may begin
  ReplayCurtain(QWidget& scene, std::function<void()> seen);

  /// Covers all of the scene, which may have got another size, and says how long it takes so far.
  void cover(double elapsed_s);
  /// Leaves all but its words open: the X server throws away what is drawn behind a window.
  void open();

 protected:
  void paintEvent(QPaintEvent* event) override;

 private:
  std::function<void()> seen_;
};

}  // namespace process_visualizer::displays
