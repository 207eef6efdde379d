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

constexpr Entry kRegistry[] = {
    {Id::sun, "sun", named<&E::sun>, anywhere},
    {Id::shadow, "shadow",
     [](const Scene& s, const SceneView& v) {
       return s.effects.shadow && can_matter(*s.effects.shadow, *s.effects.sun, v.steepest);
     },
     [](const Scene& s, const TileView& t) {
       return can_matter(*s.effects.shadow, *s.effects.sun, t.steepest);
     }},
    {Id::sky, "sky",
     [](const Scene& s, const SceneView& v) {
       return s.effects.sky && can_matter(*s.effects.sky, v.steepest);
     },
     [](const Scene& s, const TileView& t) { return can_matter(*s.effects.sky, t.steepest); }},
    {Id::water, "water",
     [](const Scene& s, const SceneView& v) {
       return s.effects.water && can_matter(*s.effects.water, v.lowest);
     },
     wet},
    // The sky shows it from any distance, and water mirrors the sky.
    {Id::haze, "haze", named<&E::haze>,
     [](const Scene& s, const TileView& t) {
       return wet(s, t) || most_change(*s.effects.haze, t.farthest, t.lowest_air) > kInvisible;
     }},
    {Id::curvature, "curvature",
     [](const Scene& s, const SceneView& v) {
       return s.effects.curvature && most_shift(*s.effects.curvature, v.camera, v.farthest) > kLeastShift;
     },
     anywhere},
    // Water mirrors what is not in view itself.
    {Id::solar_disc, "solar_disc",
     [](const Scene& s, const SceneView& v) {
       return s.effects.solar_disc &&
              (s.effects.water || in_view(*s.effects.solar_disc, *s.effects.sun, v.camera));
     },
     wet},
    {Id::tints, "tints", named<&E::tints>, anywhere},
    {Id::contours, "contours",
     [](const Scene& s, const SceneView& v) {
       return s.effects.contours && can_matter(*s.effects.contours, v.lowest, v.highest);
     },
     [](const Scene& s, const TileView& t) { return can_matter(*s.effects.contours, t.lowest, t.highest); }},
    {Id::error, "error", named<&E::error>, anywhere},
    {Id::source, "source", named<&E::source>, anywhere},
    {Id::cost, "cost", named<&E::cost>, anywhere},
    {Id::wireframe, "wireframe", named<&E::wireframe>, anywhere},
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
