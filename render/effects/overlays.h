// What is known of the surface, laid over it in colours: its bound, its grid, its cost; and the mesh.
#pragma once

#include <optional>

#include "render/picture.h"

namespace patchwork {

template <class T>
class Fields;

namespace effects {

/// The bound that the blend gives, metres.
struct ErrorOverlay {
  std::optional<double> lowest, highest;  ///< metres; without: of what is in view (see Renderer::keep_scale)
  bool logarithmic = false;               ///< else where the bounds' skewness is above 1
  double opacity = 1;
};
void describe(Fields<ErrorOverlay>& fields);

/// Which grid answers.
struct SourceOverlay {
  double opacity = 0.85;
};
void describe(Fields<SourceOverlay>& fields);

/// How many patches each tile was made of.
struct CostOverlay {
  double highest = 20;  ///< patches at the end of the ramp
  double opacity = 1;
};
void describe(Fields<CostOverlay>& fields);

/// The edges of the triangles that are drawn.
struct Wireframe {
  Color color{0x10, 0x10, 0x10};
  double opacity = 0.5;
};
void describe(Fields<Wireframe>& fields);

}  // namespace effects
}  // namespace patchwork
