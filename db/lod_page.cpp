#include "db/lod_page.h"

#ifdef __SSE2__
#include <emmintrin.h>
#endif

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "db/little_endian.h"
#include "db/vectorized.h"

// A page as bytes, format 1, all little-endian:
//   u8 format, u8 level, u16 count, then per entry six box sides (xmin, ymin, xmax, ymax as f64, bottom, top
//   as f32) and the u64 ref (in a leaf a patch id, else a page index).

namespace patchwork {

namespace {

constexpr std::uint8_t kFormat = 1;
constexpr std::size_t kPageHeader = 4, kEntryBytes = 48;
constexpr float kLeastError = 1e-3f,
                kMostError = 1e6f;  // errors beyond weigh the same: a millimetre, 1000 km

// The entries of a page that overflows.
using Overflow = std::array<LodEntry, LodPage::kSlots + 1>;

struct Cut {
  std::size_t at = 0;
  double overlap = INFINITY, volume = INFINITY;
};

// A box with its sides as shares of another box, errors in octaves.
struct UnitBox {
  std::array<double, 3> low, high;
};

UnitBox unit_box(const LodBox& b) {
  return {{b.xmin, b.ymin, error_octaves(b.bottom)}, {b.xmax, b.ymax, error_octaves(b.top)}};
}

UnitBox scaled(UnitBox b, const UnitBox& whole) {
  for (std::size_t a = 0; a < 3; ++a) {
    const double side = whole.high[a] - whole.low[a], scale = side > 0 ? 1 / side : 0;
    b.low[a] = (b.low[a] - whole.low[a]) * scale, b.high[a] = (b.high[a] - whole.low[a]) * scale;
  }
  return b;
}

UnitBox united(UnitBox a, const UnitBox& b) {
  for (std::size_t i = 0; i < 3; ++i)
    a.low[i] = std::min(a.low[i], b.low[i]), a.high[i] = std::max(a.high[i], b.high[i]);
  return a;
}

double margin(const UnitBox& b) { return b.high[0] - b.low[0] + b.high[1] - b.low[1] + b.high[2] - b.low[2]; }

// Sides are padded a little, so that flat boxes still compare.
double volume(const UnitBox& b) {
  double v = 1;
  for (std::size_t i = 0; i < 3; ++i) v *= b.high[i] - b.low[i] + 1e-3;
  return v;
}

double overlap(const UnitBox& a, const UnitBox& b) {
  double v = 1;
  for (std::size_t i = 0; i < 3; ++i)
    v *= std::max(0.0, std::min(a.high[i], b.high[i]) - std::max(a.low[i], b.low[i]));
  return v;
}

// R* (Beckmann et al. 1990, section 4.2), with one order an axis: by centre. Returns the sum of margins over
// all cuts and the cut of least overlap.
double rate_cuts(const std::array<UnitBox, LodPage::kSlots + 1>& boxes, Cut& best) {
  constexpr std::size_t n = LodPage::kSlots + 1;
  std::array<UnitBox, n> behind;
  behind[n - 1] = boxes[n - 1];
  for (std::size_t i = n - 1; i-- > 0;) behind[i] = united(behind[i + 1], boxes[i]);
  UnitBox before = boxes[0];
  double margins = 0;
  for (std::size_t at = 1; at <= n - LodPage::kMinSlots; ++at) {
    if (at >= LodPage::kMinSlots) {
      margins += margin(before) + margin(behind[at]);
      const Cut cut{at, overlap(before, behind[at]), volume(before) + volume(behind[at])};
      if (cut.overlap < best.overlap || (cut.overlap == best.overlap && cut.volume < best.volume)) best = cut;
    }
    before = united(before, boxes[at]);
  }
  return margins;
}

// Puts the entries in the order of the best axis and returns how many belong to the first part.
std::size_t arrange(Overflow& entries) {
  constexpr std::size_t n = LodPage::kSlots + 1;
  std::array<UnitBox, n> boxes;
  std::transform(entries.begin(), entries.end(), boxes.begin(),
                 [](const LodEntry& e) { return unit_box(e.box); });
  UnitBox whole = boxes[0];
  for (const UnitBox& b : boxes) whole = united(whole, b);
  for (UnitBox& b : boxes) b = scaled(b, whole);
  double least = INFINITY;
  Cut cut;
  std::array<std::uint32_t, n> order{}, best_order{};
  for (std::size_t i = 0; i < n; ++i) order[i] = best_order[i] = std::uint32_t(i);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto centre = [&](std::uint32_t i) { return boxes[i].low[axis] + boxes[i].high[axis]; };
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
      return std::pair(centre(a), a) < std::pair(centre(b), b);
    });
    std::array<UnitBox, n> ordered;
    for (std::size_t i = 0; i < n; ++i) ordered[i] = boxes[order[i]];
    Cut candidate{LodPage::kMinSlots};
    const double margins = rate_cuts(ordered, candidate);
    if (margins < least) least = margins, cut = candidate, best_order = order;
  }
  const Overflow old = entries;
  for (std::size_t i = 0; i < n; ++i) entries[i] = old[best_order[i]];
  return std::max<std::size_t>(cut.at, LodPage::kMinSlots);
}

// Bit s of the mask is byte s (0 or 1).
std::uint64_t mask_of(const std::uint8_t (&hit)[LodPage::kSlots]) {
  std::uint64_t mask = 0;
#ifdef __SSE2__
  for (std::uint32_t s = 0; s < LodPage::kSlots; s += 16) {
    const __m128i sixteen = _mm_loadu_si128(reinterpret_cast<const __m128i*>(hit + s));
    mask |= std::uint64_t(std::uint32_t(_mm_movemask_epi8(_mm_slli_epi16(sixteen, 7)))) << s;
  }
#else
  // A multiplication moves the low bits of eight bytes into the highest byte.
  for (std::uint32_t s = 0; s < LodPage::kSlots; s += 8) {
    std::uint64_t eight = 0;
    for (std::uint32_t i = 0; i < 8; ++i) eight |= std::uint64_t{hit[s + i]} << 8 * i;
    mask |= (eight * 0x0102040810204080u >> 56) << s;
  }
#endif
  return mask;
}

// All 64 slots are compared, in use or not: loops of fixed length become vectors, and the mask drops the
// others.
PATCHWORK_VECTORIZED void keep_error(const float* bottom, const float* top, float error,
                                     std::uint8_t* __restrict hit) {
  for (std::uint32_t s = 0; s < LodPage::kSlots; ++s)
    hit[s] = std::uint8_t((bottom[s] <= error) & (error < top[s]));
}
PATCHWORK_VECTORIZED void keep_region(const LodPage& p, const Extent& region, std::uint8_t* __restrict hit) {
  for (std::uint32_t s = 0; s < LodPage::kSlots; ++s)
    hit[s] = std::uint8_t(hit[s] & (p.xmin[s] <= region.xmax) & (region.xmin <= p.xmax[s]) &
                          (p.ymin[s] <= region.ymax) & (region.ymin <= p.ymax[s]));
}
PATCHWORK_VECTORIZED void keep_inside(const LodPage& p, const Extent& region, std::uint8_t* __restrict hit) {
  for (std::uint32_t s = 0; s < LodPage::kSlots; ++s)
    hit[s] = std::uint8_t(hit[s] & (p.xmax[s] <= region.xmax) & (region.xmin <= p.xmin[s]) &
                          (p.ymax[s] <= region.ymax) & (region.ymin <= p.ymin[s]));
}

void put_entry(std::vector<std::byte>& out, const LodEntry& e) {
  for (const double side : {e.box.xmin, e.box.ymin, e.box.xmax, e.box.ymax}) put_little(out, side);
  for (const float side : {e.box.bottom, e.box.top}) put_little(out, side);
  put_little(out, e.id.value);
}

LodEntry get_entry(const std::byte* from) {
  const auto side = [&](std::size_t k) { return get_little<double>(from + 8 * k); };
  return {{side(0), side(1), side(2), side(3), get_little<float>(from + 32), get_little<float>(from + 36)},
          {get_little<std::uint64_t>(from + 40)}};
}

}  // namespace

bool LodBox::sound() const {
  const bool finite =
      std::isfinite(xmin) && std::isfinite(ymin) && std::isfinite(xmax) && std::isfinite(ymax);
  return finite && xmin <= xmax && ymin <= ymax && bottom >= 0 && std::isfinite(bottom) && bottom <= top;
}

LodBox united(const LodBox& a, const LodBox& b) {
  return {std::min(a.xmin, b.xmin), std::min(a.ymin, b.ymin),     std::max(a.xmax, b.xmax),
          std::max(a.ymax, b.ymax), std::min(a.bottom, b.bottom), std::max(a.top, b.top)};
}

bool contains(const LodBox& outer, const LodBox& inner) { return united(outer, inner) == outer; }

// The bits of a float, read as an integer, are such a scale in steps of 2^-23 octaves; and this runs in
// vectors.
float error_octaves(float error) {
  const float bounded = error < kMostError ? error + kLeastError : kMostError;
  return float(std::bit_cast<std::int32_t>(bounded)) * 0x1p-23f;
}

void LodPage::set_box(std::uint32_t s, const LodBox& b) {
  xmin[s] = b.xmin, ymin[s] = b.ymin, xmax[s] = b.xmax, ymax[s] = b.ymax;
  bottom[s] = b.bottom, top[s] = b.top;
  if (count == 0) origin = {b.xmin, b.ymin}, reach = 0;
  const double w = b.xmin - origin.x, so = b.ymin - origin.y, e = b.xmax - origin.x, n = b.ymax - origin.y;
  west[s] = float_at_most(w), south[s] = float_at_most(so);
  east[s] = float_at_least(e), north[s] = float_at_least(n);
  reach = std::max({reach, std::abs(w), std::abs(so), std::abs(e), std::abs(n)});
}

void LodPage::append(const LodEntry& e) {
  set_box(count, e.box);
  ref[count++] = e.id.value;
}

void LodPage::remove(std::uint32_t s) {
  const std::uint32_t last = --count;
  set_box(s, box(last));
  ref[s] = ref[last];
}

LodBox LodPage::bounds() const {
  LodBox all = box(0);
  for (std::uint32_t s = 1; s < count; ++s) all = patchwork::united(all, box(s));
  return all;
}

LodHits LodPage::uniform_hits(const Extent& region, float error, bool in) const {
  std::uint8_t hit[kSlots];
  keep_error(bottom, top, error, hit);
  LodHits hits{mask_of_used(hit)};
  if (in) hits.inside = hits.met;
  if (in || hits.met == 0) return hits;
  keep_region(*this, region, hit);
  hits.met = mask_of_used(hit);
  if (level == 0) return hits;
  keep_inside(*this, region, hit);
  hits.inside = mask_of_used(hit);
  return hits;
}

std::uint64_t LodPage::mask_of_used(const std::uint8_t (&hit)[kSlots]) const { return mask_of(hit) & used(); }

std::uint32_t LodPage::choose_slot(const LodBox& b) const {
  double growth[kSlots], size[kSlots];
  const float low = error_octaves(b.bottom), high = error_octaves(b.top);
  for (std::uint32_t s = 0; s < kSlots; ++s) {
    const float own_low = error_octaves(bottom[s]), own_high = error_octaves(top[s]);
    const double own =
        double(own_high - own_low) + 1;  // one octave at least: thin boxes are told apart by area
    const double both = double((high > own_high ? high : own_high) - (low < own_low ? low : own_low)) + 1;
    const double x0 = b.xmin < xmin[s] ? b.xmin : xmin[s], x1 = b.xmax > xmax[s] ? b.xmax : xmax[s];
    const double y0 = b.ymin < ymin[s] ? b.ymin : ymin[s], y1 = b.ymax > ymax[s] ? b.ymax : ymax[s];
    size[s] = (xmax[s] - xmin[s]) * (ymax[s] - ymin[s]) * own;
    growth[s] = (x1 - x0) * (y1 - y0) * both - size[s];
  }
  std::uint32_t best = 0;
  for (std::uint32_t s = 1; s < count; ++s)
    if (growth[s] < growth[best] || (growth[s] == growth[best] && size[s] < size[best])) best = s;
  return best;
}

LodPage LodPage::split(const LodEntry& extra) {
  Overflow entries;
  for (std::uint32_t s = 0; s < kSlots; ++s) entries[s] = entry(s);
  entries[kSlots] = extra;
  const std::size_t cut = arrange(entries);
  LodPage other(level);
  *this = LodPage(level);
  for (std::size_t i = 0; i < entries.size(); ++i) (i < cut ? *this : other).append(entries[i]);
  return other;
}

std::vector<std::byte> LodPage::bytes() const {
  std::vector<std::byte> out;
  out.reserve(kPageHeader + count * kEntryBytes);
  put_little(out, kFormat), put_little(out, std::uint8_t(level)), put_little(out, std::uint16_t(count));
  for (std::uint32_t s = 0; s < count; ++s) put_entry(out, entry(s));
  return out;
}

LodPage LodPage::from_bytes(std::span<const std::byte> bytes, std::string& problem) {
  LodPage page;
  if (bytes.size() < kPageHeader) return problem = "is cut short", page;
  if (std::uint8_t(bytes[0]) != kFormat) return problem = "has an unknown format", page;
  page.level = std::uint8_t(bytes[1]);
  const std::uint32_t count = get_little<std::uint16_t>(bytes.data() + 2);
  if (count > kSlots || bytes.size() != kPageHeader + count * kEntryBytes)
    return problem = "has a wrong number of entries", page;
  for (std::uint32_t s = 0; s < count; ++s) {
    page.append(get_entry(bytes.data() + kPageHeader + s * kEntryBytes));
    if (!page.box(s).sound()) return problem = "holds a box that is none", page;
  }
  return page;
}

}  // namespace patchwork
