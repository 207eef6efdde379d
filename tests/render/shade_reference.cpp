#include "tests/render/shade_reference.h"

namespace patchwork {

ShadeReference reference_of(const Scene& scene, const effects::LookInput& input, const effects::Set& on) {
  using effects::Id;
  const auto is = [&](Id id) { return has(on, id); };
  ShadeReference r;
  r.look = effects::look_of(scene, input);
  r.has_sun = is(Id::sun), r.has_shadow = is(Id::shadow), r.has_sky = is(Id::sky);
  r.has_water = is(Id::water), r.has_haze = is(Id::haze), r.has_disc = is(Id::solar_disc);
  r.has_tints = is(Id::tints), r.has_scale = is(Id::error) || is(Id::cost), r.has_source = is(Id::source);
  r.has_contours = is(Id::contours);
  if (scene.effects.tints) r.tint = &color_ramp(scene.effects.tints->ramp);
  return r;
}

}  // namespace patchwork
