#include "render/effects/look.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/common.hpp>

namespace patchwork::effects {

namespace {

constexpr Color kGround{0xb8, 0xb4, 0xa6};  // where no tints are

using glsl::vec3;
using glsl::vec4;

vec4 of(const Color& c, double w) { return {linear(c), w}; }

// The part of the sun's disc above a level horizon.
double risen(const Sun& sun) {
  const double half = 0.2665;
  return glm::smoothstep(-half, half, sun.elevation);
}

void put_light(Look& l, const SceneEffects& e) {
  if (e.sun) {
    l.sun_direction = {direction_of(*e.sun), std::tan(e.sun->elevation * kDegree)};
    l.sun_light = {linear(e.sun->color) * (e.sun->strength * risen(*e.sun)),
                   e.shadow ? 0.5 * e.shadow->softness * kDegree : 0};
    l.ambient = {(e.sky ? linear(e.sky->color) : vec3(1)) * e.sun->ambient,
                 e.shadow ? e.shadow->strength : 0};
  }
  l.ground = of(kGround, e.sky ? e.sky->strength : 0);
  if (!e.solar_disc) return;
  l.air_scale.z = e.solar_disc->glow;
  l.air_scale.w = 1 / (kGlowDegrees * kDegree);
  l.tints.z = std::cos(0.5 * e.solar_disc->diameter * kDegree);
}

void put_air(Look& l, const SceneEffects& e, const Camera& camera) {
  l.air_scale.y = camera.eye.z;
  if (e.curvature) l.background.w = drop_per_square(*e.curvature);
  if (!e.haze) return;
  l.air = of(e.haze->color, depth_per_metre(*e.haze, camera.eye.z));
  l.air_scale.x = 1 / e.haze->scale_height;
}

void put_water(Look& l, const Water& w, const Camera& camera) {
  l.water = of(w.color, w.level);
  l.water_surface = {w.waves, 1 / w.clarity, 0, 0};
  if (w.waves == 0) return;
  const double period = 240 * w.waves;  // water.glsl: wave_period
  l.water_surface.z = std::fmod(camera.eye.x, period);
  l.water_surface.w = std::fmod(camera.eye.y, period);
}

void put_view(Look& l, const Camera& c) {
  const CameraAxes a = axes(c);
  l.view_right = {a.right, 1 / c.gamma()};
  l.view_up = {a.up, 0.5 * c.width};
  l.view_forward = {a.forward, 0.5 * c.height};
}

double opacity_of(const SceneEffects& e) {
  return e.error ? e.error->opacity : e.cost ? e.cost->opacity : e.source ? e.source->opacity : 0;
}

}  // namespace

glm::dvec3 linear(const Color& c) { return {linear_of(c.r), linear_of(c.g), linear_of(c.b)}; }

Look look_of(const Scene& s, const LookInput& in) {
  Look l{};
  const SceneEffects& e = s.effects;
  l.background = of(s.background, 0);
  put_light(l, e);
  put_air(l, e, in.view.camera);
  if (e.water) put_water(l, *e.water, in.view.camera);
  const double range = in.tints.highest - in.tints.lowest;
  l.tints.x = in.tints.lowest, l.tints.y = range > 0 ? 1 / range : 0;
  if (e.contours) {
    l.contours = of(e.contours->color, e.contours->opacity);
    l.contour_lines = {e.contours->interval, double(e.contours->index), e.contours->width, 0};
  }
  l.overlay = {in.scale.lowest, in.scale.highest, in.scale.logarithmic, opacity_of(e)};
  if (e.wireframe) l.wireframe = of(e.wireframe->color, e.wireframe->opacity);
  put_view(l, in.view.camera);
  return l;
}

std::array<float, kLookFloats> block_of(const Look& look) {
  const auto from = std::bit_cast<std::array<double, kLookFloats>>(look);  // vec4 alone (look.glsl)
  std::array<float, kLookFloats> block;
  std::copy(from.begin(), from.end(), block.begin());
  return block;
}

}  // namespace patchwork::effects
