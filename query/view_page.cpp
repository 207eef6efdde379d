#include "query/view_page.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <type_traits>

// Compiled once for every instruction set that Highway knows of this kind of machine; the best is used.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "query/view_page.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#ifndef PATCHWORK_VIEW_PAGE_ONCE
#define PATCHWORK_VIEW_PAGE_ONCE
namespace patchwork {
namespace {

// What a page's floats are compared with, metres from its origin: wide enough for what floats lose, so that
// no box is missed. Lengths by kLoss, eight roundings of a float, of all that they were made from, tolerances
// a metre by kHair, which also covers what a frame's shear adds to a patch's range, besides what floats lose
// of tolerances.
constexpr double kLoss = 0x1p-21, kHair = 0x1p-16, kRounding = 0x1p-19;
static_assert(kHair - kRounding >= Frame::kMostShear);
// Tolerances a metre of distance, and distances, whose squares stay floats; kNothing is what may vanish
// there.
constexpr double kLeast = 1e-15, kMost = 1e18;
constexpr float kNothing = 1e-36f;

float squared(double v) { return float(v * v); }

}  // namespace
}  // namespace patchwork
#endif

HWY_BEFORE_NAMESPACE();
namespace patchwork::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using Slots = hn::CappedTag<float, 16>;
using Sides = hn::CappedTag<float, 8>;
static_assert(LodPage::kSlots % hn::MaxLanes(Slots()) == 0 &&
                  PageView::kMostSides % hn::MaxLanes(Sides()) == 0,
              "vectors are read as a whole");

std::uint64_t bits_of(Slots d, hn::Mask<Slots> mask) {
  using Bits = std::conditional_t<(hn::MaxLanes(Slots()) > 8), std::uint16_t, std::uint8_t>;
  std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(d, mask, bytes);
  Bits bits;
  std::memcpy(&bits, bytes, sizeof(bits));
  return bits;
}

// The eye from a page's origin, and what lengths there may have lost.
struct Eye {
  float x, y, loss;
};

// Boxes that meet the region's bounds and whose errors meet the cone. Slots that are not in use count or not.
std::uint64_t near_enough(const LodPage& page, const PageView& v, Eye eye) {
  const Slots d;
  const float x0 = eye.x - eye.loss, x1 = eye.x + eye.loss, y0 = eye.y - eye.loss, y1 = eye.y + eye.loss;
  const auto x_low = hn::Set(d, x0), x_high = hn::Set(d, x1), y_low = hn::Set(d, y0), y_high = hn::Set(d, y1);
  const auto bounds_west = hn::Set(d, x0 + v.west), bounds_east = hn::Set(d, x1 + v.east),
             bounds_south = hn::Set(d, y0 + v.south), bounds_north = hn::Set(d, y1 + v.north);
  const auto k_near = hn::Set(d, v.k_near), k_far = hn::Set(d, v.k_far), height2 = hn::Set(d, v.height2),
             nothing = hn::Set(d, kNothing), zero = hn::Zero(d);
  std::uint64_t met = 0;
  for (std::uint32_t s = 0; s < page.count; s += std::uint32_t(hn::Lanes(d))) {
    const auto west = hn::LoadU(d, page.west + s), south = hn::LoadU(d, page.south + s),
               east = hn::LoadU(d, page.east + s), north = hn::LoadU(d, page.north + s);
    const auto left = hn::Sub(west, x_high), right = hn::Sub(x_low, east), below = hn::Sub(south, y_high),
               above = hn::Sub(y_low, north);
    const auto fx = hn::Min(left, right), fy = hn::Min(below, above);
    const auto dx = hn::Max(hn::Max(left, right), zero), dy = hn::Max(hn::Max(below, above), zero);
    const auto far = hn::MulAdd(fx, fx, hn::MulAdd(fy, fy, height2));
    const auto near = hn::MulAdd(dx, dx, hn::MulAdd(dy, dy, height2));
    const auto bottom = hn::LoadU(d, page.bottom + s), top = hn::LoadU(d, page.top + s);
    const auto low_enough = hn::Le(hn::Mul(bottom, bottom), hn::MulAdd(k_far, far, nothing));
    const auto high_enough = hn::Le(hn::Mul(k_near, near), hn::MulAdd(top, top, nothing));
    const auto across = hn::And(hn::Le(west, bounds_east), hn::Le(bounds_west, east));
    const auto along = hn::And(hn::Le(south, bounds_north), hn::Le(bounds_south, north));
    met |= bits_of(d, hn::And(hn::And(low_enough, high_enough), hn::And(across, along))) << s;
  }
  return met & page.used();
}

// Of the boxes that are met those that have a corner on the inner side of each side; `inside` are those that
// have all corners there. Few are left to be asked, so a vector takes the sides of one box.
void keep_inside(const LodPage& page, const PageView& v, Eye eye, LodHits& hits) {
  const Sides d;
  const std::size_t step = hn::Lanes(d);
  const auto x = hn::Set(d, eye.x), y = hn::Set(d, eye.y), loss = hn::Set(d, eye.loss);
  std::uint64_t out = 0, not_whole = 0;
  for (std::size_t k = 0; k < v.sides; k += step) {  // a vector reads those behind the last, too
    const auto nx_up = hn::LoadU(d, &v.nx_up[k]), nx_down = hn::LoadU(d, &v.nx_down[k]),
               ny_up = hn::LoadU(d, &v.ny_up[k]), ny_down = hn::LoadU(d, &v.ny_down[k]);
    const auto limit = hn::MulAdd(hn::Add(nx_up, nx_down), x,
                                  hn::MulAdd(hn::Add(ny_up, ny_down), y, hn::LoadU(d, &v.from_eye[k])));
    const auto nearly = hn::Add(limit, loss), surely = hn::Sub(limit, loss);
    for (std::uint64_t left = hits.met; left; left &= left - 1) {
      const int s = std::countr_zero(left);
      const auto west = hn::Set(d, page.west[s]), south = hn::Set(d, page.south[s]),
                 east = hn::Set(d, page.east[s]), north = hn::Set(d, page.north[s]);
      const auto innermost = hn::MulAdd(
          nx_up, west, hn::MulAdd(nx_down, east, hn::MulAdd(ny_up, south, hn::Mul(ny_down, north))));
      out |= std::uint64_t{!hn::AllFalse(d, hn::Gt(innermost, nearly))} << s;
      if (page.level == 0) continue;  // there is nothing below it
      const auto outermost = hn::MulAdd(
          nx_up, east, hn::MulAdd(nx_down, west, hn::MulAdd(ny_up, north, hn::Mul(ny_down, south))));
      not_whole |= std::uint64_t{!hn::AllFalse(d, hn::Gt(outermost, surely))} << s;
    }
  }
  hits.met &= ~out, hits.inside &= ~(out | not_whole);
}

}  // namespace

LodHits view_hits(const LodPage& page, const PageView& v, bool inside) {
  const double x = v.eye.x - page.origin.x, y = v.eye.y - page.origin.y;
  const double furthest = std::abs(x) + std::abs(y) + (page.reach + v.reach);
  if (!(furthest < v.most_reach)) return {page.used()};
  const Eye eye{float(x), float(y), float(kLoss * (furthest + (page.reach + v.unsure)))};
  LodHits hits{near_enough(page, v, eye)};
  hits.inside = hits.met;
  if (!inside && hits.met) keep_inside(page, v, eye, hits);
  return hits;
}

}  // namespace patchwork::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace patchwork {

HWY_EXPORT(view_hits);

PageView::PageView(Point from, double height, double metres_a_metre, std::span<const Point> corners)
    : eye(from),
      above(height),
      slope(metres_a_metre),
      k_near(squared(slope < kLeast ? 0 : std::min(slope, kMost) * (1 - kHair))),
      k_far(squared(std::clamp(slope, kLeast, kMost) * (1 + kHair))),
      height2(squared(above < kLeast ? 0 : std::min(above, kMost))) {
  if (corners.size() < 3) corners = {};
  if (corners.size() > kMostSides) throw std::length_error("a view's region has too many sides");
  most.fill(std::numeric_limits<double>::infinity()), from_eye.fill(std::numeric_limits<float>::infinity());
  Extent bounds = Extent::nothing();
  double far = 0;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const Point &a = corners[k], &b = corners[(k + 1) % corners.size()];
    add_side(a, b), bounds.add(a);
    far = std::max(far, std::abs(a.x - eye.x) + std::abs(a.y - eye.y));
  }
  west = float(bounds.xmin - eye.x), south = float(bounds.ymin - eye.y);
  east = float(bounds.xmax - eye.x), north = float(bounds.ymax - eye.y);
  reach = far + above + 1, most_reach = slope > 1 ? kMost / slope : kMost;
  unsure = 0x1p-25 * (std::abs(eye.x) + std::abs(eye.y));  // with kLoss: 128 of their roundings
  // Chosen once and not for every page; to ask the processor takes longer than a query.
  if (!hwy::GetChosenTarget().IsInitialized()) hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  if (sides > 0) hits_ = &HWY_DYNAMIC_DISPATCH(view_hits);
}

void PageView::add_side(Point a, Point b) {
  const double length = std::hypot(b.x - a.x, b.y - a.y);
  const double x = (b.y - a.y) / length, y = (a.x - b.x) / length;  // outward
  const auto outer = [&](Point from) {
    return std::max(x * (a.x - from.x) + y * (a.y - from.y), x * (b.x - from.x) + y * (b.y - from.y));
  };
  nx[sides] = x, ny[sides] = y, most[sides] = outer({0, 0}), from_eye[sides] = float(outer(eye));
  nx_up[sides] = float(std::max(x, 0.0)), nx_down[sides] = float(std::min(x, 0.0));
  ny_up[sides] = float(std::max(y, 0.0)), ny_down[sides] = float(std::min(y, 0.0));
  ++sides;
}

}  // namespace patchwork

#endif
