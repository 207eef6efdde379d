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
// no box is missed. Lengths by kLoss of all that they were made from, tolerances a metre by kHair, which also
// covers what a frame's shear adds to a patch's range, besides what floats lose of tolerances.
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
using Coordinates = hn::CappedTag<double, 8>;

std::uint64_t bits_of(Slots d, hn::Mask<Slots> mask) {
  using Bits = std::conditional_t<(hn::MaxLanes(Slots()) > 8), std::uint16_t, std::uint8_t>;
  std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(d, mask, bytes);
  Bits bits;
  std::memcpy(&bits, bytes, sizeof(bits));
  return bits;
}

// Boxes that meet the region's bounds and whose errors meet the cone. Slots that are not in use count or not.
std::uint64_t near_enough(const LodPage& page, const PageView& v, float loss) {
  const Slots d;
  const Point& o = page.origin;
  const auto less = [&](double a) HWY_ATTR { return hn::Set(d, float(a) - loss); };
  const auto more = [&](double a) HWY_ATTR { return hn::Set(d, float(a) + loss); };
  const auto x_low = less(v.eye.x - o.x), x_high = more(v.eye.x - o.x), y_low = less(v.eye.y - o.y),
             y_high = more(v.eye.y - o.y);
  const auto bounds_west = less(v.bounds.xmin - o.x), bounds_east = more(v.bounds.xmax - o.x),
             bounds_south = less(v.bounds.ymin - o.y), bounds_north = more(v.bounds.ymax - o.y);
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
void keep_inside(const LodPage& page, const PageView& v, float loss, LodHits& hits) {
  const Sides d;
  const Coordinates dd;
  const std::size_t step = hn::Lanes(d), part = hn::Lanes(dd);
  const std::size_t sides = (v.sides + step - 1) / step * step;  // a vector reads those behind the last, too
  HWY_ALIGN float most[PageView::kMostSides];
  for (std::size_t k = 0; k < sides; k += part) {
    const auto at = hn::Add(hn::Mul(hn::LoadU(dd, &v.nx[k]), hn::Set(dd, page.origin.x)),
                            hn::Mul(hn::LoadU(dd, &v.ny[k]), hn::Set(dd, page.origin.y)));
    const hn::Rebind<float, Coordinates> df;
    hn::StoreU(hn::DemoteTo(df, hn::Sub(hn::LoadU(dd, &v.most[k]), at)), df, most + k);
  }
  std::uint64_t out = 0, not_whole = 0;
  for (std::size_t k = 0; k < sides; k += step) {
    const auto nx_up = hn::LoadU(d, &v.nx_up[k]), nx_down = hn::LoadU(d, &v.nx_down[k]),
               ny_up = hn::LoadU(d, &v.ny_up[k]), ny_down = hn::LoadU(d, &v.ny_down[k]);
    const auto limit = hn::LoadU(d, most + k);
    const auto nearly = hn::Add(limit, hn::Set(d, loss)), surely = hn::Sub(limit, hn::Set(d, loss));
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

LodHits view_hits(const LodPage& page, const PageView& v, float loss, bool inside) {
  LodHits hits{near_enough(page, v, loss)};
  hits.inside = hits.met;
  if (!inside && hits.met) keep_inside(page, v, loss, hits);
  return hits;
}

}  // namespace patchwork::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace patchwork {

HWY_EXPORT(view_hits);

PageView::PageView(Point from, double height, double metres_a_metre)
    : eye(from),
      above(height),
      slope(metres_a_metre),
      k_near(squared(slope < kLeast ? 0 : std::min(slope, kMost) * (1 - kHair))),
      k_far(squared(std::clamp(slope, kLeast, kMost) * (1 + kHair))),
      height2(squared(std::min(above, kMost))) {
  most.fill(std::numeric_limits<double>::infinity());
}

void PageView::add_side(Point a, Point b) {
  if (sides == kMostSides) throw std::length_error("a view's region has too many sides");
  const double length = std::hypot(b.x - a.x, b.y - a.y);
  const double x = (b.y - a.y) / length, y = (a.x - b.x) / length;  // outward
  nx[sides] = x, ny[sides] = y, most[sides] = std::max(x * a.x + y * a.y, x * b.x + y * b.y);
  nx_up[sides] = float(std::max(x, 0.0)), nx_down[sides] = float(std::min(x, 0.0));
  ny_up[sides] = float(std::max(y, 0.0)), ny_down[sides] = float(std::min(y, 0.0));
  ++sides;
  bounds.add(a), bounds.add(b);
  for (const Point& p : {a, b}) reach = std::max(reach, std::abs(p.x - eye.x) + std::abs(p.y - eye.y));
}

LodHits PageView::hits(const LodPage& page, bool inside) const {
  const Point& o = page.origin;
  const double away = std::abs(eye.x - o.x) + std::abs(eye.y - o.y);
  const double furthest = away + (page.reach + (reach + above + 1));
  if (!(furthest < kMost && slope * furthest < kMost)) return {page.used()};
  // Coordinates lose far less than floats, but may be far larger.
  const double made_from = furthest + (page.reach + 0x1p-26 * (std::abs(o.x) + std::abs(o.y)));
  return HWY_DYNAMIC_DISPATCH(view_hits)(page, *this, float(kLoss * made_from), inside);
}

}  // namespace patchwork

#endif
