#include "blend/sight_search.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace patchwork {

namespace {

// A hump between samples is at most so many times as high as the parabola through them makes it.
constexpr double kHumps = 4;

// The parabola through three samples: value of `b` + slope (t - b) + bend (t - b)^2.
struct Parabola {
  double b, slope, bend;
  Parabola(const SightSample& low, const SightSample& middle, const SightSample& high) : b(middle.t) {
    const double d = (middle.above - low.above) / (middle.t - low.t);
    const double e = (high.above - middle.above) / (high.t - middle.t);
    bend = (e - d) / (high.t - low.t), slope = d + bend * (middle.t - low.t);
  }
  double peak() const { return b - slope / (2 * bend); }
  double rise() const { return slope * slope / (-4 * bend); }  // of the peak above b
};

// A share of the bound above (1) or below (-1) the surface, in its place.
SightSample with_bound(SightSample s, double share) {
  s.above += share * s.bound;
  return s;
}

}  // namespace

std::optional<HitSearch> HitSearch::between(const std::vector<SightSample>& samples, double touching,
                                            double end) {
  const auto high =
      std::find_if(samples.begin(), samples.end(), [&](const SightSample& s) { return s.above > touching; });
  if (high == samples.end()) return std::nullopt;
  // Where nothing before it was looked at, the surface cannot reach the ray there: the hit is this sample.
  const bool alone = high == samples.begin() || high->place == SightPlace::begins;
  const SightSample& low = alone ? *high : *std::prev(high);
  HitSearch s;
  s.low_ = low.t, s.high_ = high->t, s.end_ = end, s.width_before_ = s.width();
  s.touching_ = touching;
  s.below_ = alone || std::isnan(low.above) ? -INFINITY : low.above - touching;
  s.above_ = high->above - touching;
  s.bound_ = high->bound;
  return s;
}

double HitSearch::guess() const {
  if (halve_ || !std::isfinite(below_) || !(above_ - below_ > 0)) return middle();
  const double t = low_ + (high_ - low_) * (-below_ / (above_ - below_));
  return t > low_ && t < high_ ? t : middle();
}

void HitSearch::take(double t, double above, double bound) {
  if (above > touching_)
    high_ = t, above_ = above - touching_, bound_ = bound;
  else
    low_ = t, below_ = std::isnan(above) ? -INFINITY : above - touching_;
  ++steps_;
  if (steps_ % 2 == 0)
    width_before_ = width(), halve_ = false;
  else
    halve_ = width() > 0.5 * width_before_;
}

void find_humps(const std::vector<SightSample>& s, double miss,
                const std::function<void(double t, SightPlace)>& take) {
  double most = -INFINITY, hit = INFINITY;
  bool may = false, must = false;  // hide the ray, for what is known so far
  for (const SightSample& a : s) {
    if (a.above > most) most = a.above;
    if (a.above > miss) hit = std::min(hit, a.t);
    may |= a.above + a.bound > miss, must |= a.above - a.bound > miss;
  }
  for (std::size_t k = 1; k + 1 < s.size(); ++k) {
    const SightSample &a = s[k - 1], &b = s[k], &c = s[k + 1];
    if (b.place <= SightPlace::line) continue;
    const Parabola p(a, b, c);
    const double enough = a.t < hit ? std::min(most, 0.0) + miss : most + miss;
    const double seen = std::max({a.above, b.above, c.above}), half = 0.5 * (c.t - a.t);
    const bool peaks = p.bend < 0 && p.peak() > a.t && p.peak() < c.t && p.peak() != b.t;
    if (b.place == SightPlace::parabola) {
      // Where one patch speaks its bound is the same all over.
      const double peak = b.above + p.rise();
      const bool decides = (!may && peak + b.bound > miss) || (!must && peak - b.bound > miss);
      if (peaks && ((peak > seen && peak > enough) || decides)) take(p.peak(), b.place);
      continue;
    }
    // Could the surface, or the end of its bound that decides, come up so high between the samples?
    const auto may_reach = [&](double share, double height) {
      const Parabola q(with_bound(a, share), with_bound(b, share), with_bound(c, share));
      const double hump = kHumps * std::abs(q.bend) * half * half;
      const double top =
          std::max({a.above + share * a.bound, b.above + share * b.bound, c.above + share * c.bound});
      return hump > miss && top + hump > height;
    };
    if (may_reach(0, enough) || (!may && may_reach(1, miss)) || (!must && may_reach(-1, miss))) {
      take(0.5 * (a.t + b.t), b.place), take(0.5 * (b.t + c.t), b.place);
      if (peaks) take(p.peak(), b.place);
    }
  }
}

}  // namespace patchwork
