// What the last frames cost, as a person reads it.
#pragma once

#include "render/renderer.h"
#include "tools/view/panels.h"

namespace patchwork::cli {

/// Means over the frames of a while that drew anew; counts are the last frame's, but tiles made add up.
class FrameMeter {
 public:
  /// `show_ms`: until the picture was handed to the screen.
  void add(const FrameStats& frame, double show_ms);
  /// What was added since; keeps what is shown where nothing was.
  Rows rows();

 private:
  FrameStats sum_, last_;
  double show_ms_ = 0;
  int frames_ = 0;
  Rows stages_;
};

}  // namespace patchwork::cli
