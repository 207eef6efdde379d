#include "render/effects/registry.h"

namespace patchwork::effects {

namespace {

bool anywhere(const Scene&, const TileView&) { return true; }

bool wet(const Scene& s, const TileView& t) {
  return s.effects.water && can_matter(*s.effects.water, t.lowest);
}

template <auto Member>
bool named(const Scene& s, const SceneView&) {
  return (s.effects.*Member).has_value();
}

using E = SceneEffects;

// Keys: the light map holds horizons towards the sun and the sky's bits; everything else is made anew by the
// pixel.
constexpr Entry kRegistry[] = {
    {Id::sun, "sun", kNothing, named<&E::sun>, anywhere},
    {Id::shadow, "shadow", kHeight | kSun,
     [](const Scene& s, const SceneView& v) {
       return s.effects.shadow && can_matter(*s.effects.shadow, *s.effects.sun, v.steepest);
     },
     [](const Scene& s, const TileView& t) {
       return can_matter(*s.effects.shadow, *s.effects.sun, t.steepest);
     }},
    {Id::sky, "sky", kHeight,
     [](const Scene& s, const SceneView& v) {
       return s.effects.sky && can_matter(*s.effects.sky, v.steepest);
     },
     [](const Scene& s, const TileView& t) { return can_matter(*s.effects.sky, t.steepest); }},
    {Id::water, "water", kNothing,
     [](const Scene& s, const SceneView& v) {
       return s.effects.water && can_matter(*s.effects.water, v.lowest);
     },
     wet},
    // The sky shows it from any distance, and water mirrors the sky.
    {Id::haze, "haze", kNothing, named<&E::haze>,
     [](const Scene& s, const TileView& t) {
       return wet(s, t) || most_change(*s.effects.haze, t.farthest, t.lowest_air) > kInvisible;
     }},
    {Id::curvature, "curvature", kNothing,
     [](const Scene& s, const SceneView& v) {
       return s.effects.curvature && most_shift(*s.effects.curvature, v.camera, v.farthest) > kLeastShift;
     },
     anywhere},
    // Water mirrors what is not in view itself.
    {Id::solar_disc, "solar_disc", kNothing,
     [](const Scene& s, const SceneView& v) {
       return s.effects.solar_disc &&
              (s.effects.water || in_view(*s.effects.solar_disc, *s.effects.sun, v.camera));
     },
     wet},
    {Id::tints, "tints", kNothing, named<&E::tints>, anywhere},
    {Id::contours, "contours", kNothing,
     [](const Scene& s, const SceneView& v) {
       return s.effects.contours && can_matter(*s.effects.contours, v.lowest, v.highest);
     },
     [](const Scene& s, const TileView& t) { return can_matter(*s.effects.contours, t.lowest, t.highest); }},
    {Id::error, "error", kHeight, named<&E::error>, anywhere},
    {Id::source, "source", kHeight, named<&E::source>, anywhere},
    {Id::cost, "cost", kHeight, named<&E::cost>, anywhere},
    {Id::wireframe, "wireframe", kNothing, named<&E::wireframe>, anywhere},
};
static_assert(std::size(kRegistry) == kEffects);

}  // namespace

std::span<const Entry> registry() { return kRegistry; }

Set called_for(const Scene& scene, const SceneView& view) {
  Set set;
  for (const Entry& e : kRegistry) set[std::size_t(e.id)] = e.called(scene, view);
  return set;
}

Set matter_to(const Scene& scene, const Set& frame, const TileView& tile) {
  Set set;
  for (const Entry& e : kRegistry) set[std::size_t(e.id)] = has(frame, e.id) && e.matters(scene, tile);
  return set;
}

}  // namespace patchwork::effects
