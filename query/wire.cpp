#include "query/wire.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "db/codec.h"
#include "db/error.h"
#include "db/little_endian.h"
#include "db/pack.h"

// Format 1, all little-endian: u32 'PWU1', u32 length of the structure, the structure (packed), then one blob
// of codec.h for each sheet, as long as the structure says. The structure:
//   u32 sources; each: u32 id, 6 f64 frame, u32 width, u32 height, u32 1 if pixels are areas, f64 quantum,
//     f64 base, f64 rim error, i64 code origin
//   u32 sheets; each: u32 side in samples, u32 patches, u32 1 if it carries what is known of holes, u32
//   bytes,
//     then the patches: u64 id, 3 f64 errors, f64 bottom
//   u32 drops; each: u64 id
// A sheet's blob holds its patches' windows one below the other, cut to `side` samples; behind them, where it
// carries holes, as many windows of bits: 0 answering, 1 real, 2 to 5 near, 6 to 9 wide.
// Zeros follow where the update would else be shorter than least_bytes(): few bytes never ask for much
// memory.

namespace patchwork {

namespace {

constexpr std::uint32_t kMagic = 0x31555750;
constexpr std::size_t kMostStructure = std::size_t{1} << 28;
// Of an update with a patch, which takes 7 to 13 KB in memory; flat land would do with less, hills take more.
constexpr std::size_t kLeastBytes = 64;
// Structure for each byte of an update: 148 bytes suffice for a patch, its sheet and its source, 8 for a
// drop.
constexpr std::size_t kMostPacking = 16;
constexpr int kSide = PatchSurface::kSide;
constexpr int kMargin = kExtensionCells + 1;  // window vertices before the block

std::size_t least_bytes(std::size_t patches, std::size_t drops) { return kLeastBytes * patches + drops; }

[[noreturn]] void refuse(const char* problem) { throw Error("update", problem, "ask for it again"); }

class Writer {
 public:
  template <class T>
  void put(T value) {
    put_little(bytes_, value);
  }
  std::vector<std::byte> take() { return std::move(bytes_); }

 private:
  std::vector<std::byte> bytes_;
};

class Reader {
 public:
  explicit Reader(std::span<const std::byte> bytes) : left_(bytes) {}
  template <class T>
  T get() {
    return get_little<T>(take(sizeof(T)).data());
  }
  double metres() {
    const auto value = get<double>();
    if (!std::isfinite(value)) refuse("it holds a number that is none");
    return value;
  }
  double error() {
    const double value = metres();
    if (value < 0) refuse("it holds an error below zero");
    return value;
  }
  std::uint32_t at_most(std::uint32_t most) {
    const auto value = get<std::uint32_t>();
    if (value > most) refuse("it states an impossible number");
    return value;
  }
  std::span<const std::byte> take(std::size_t n) {
    if (n > left_.size()) refuse("it is cut short");
    const auto taken = left_.first(n);
    left_ = left_.subspan(n);
    return taken;
  }
  bool done() const { return left_.empty(); }
  bool only_zeros() const {
    return std::all_of(left_.begin(), left_.end(), [](std::byte b) { return b == std::byte{0}; });
  }

 private:
  std::span<const std::byte> left_;
};

// Patches whose windows are cut to the same size, and know of holes or do not.
struct Sheet {
  int side = 0;
  bool holes = false;
  std::vector<std::shared_ptr<const PatchSurface>> patches;
};

// Samples that a patch is evaluated from: one vertex beyond its domain, counted from the window's corner.
int side_of(const PatchSurface& s) {
  const double step = std::exp2(s.level);
  const double reach = std::max(s.domain.i1 / step - s.first_i, s.domain.j1 / step - s.first_j);
  return std::clamp(int(std::ceil(reach)) + 2, 4, kSide);
}

std::vector<Sheet> sheets_of(const Database& db, const std::vector<PatchId>& ids) {
  std::map<std::pair<int, bool>, Sheet> sheets;
  for (const PatchId id : ids) {
    auto s = db.surface(id);
    const std::pair key(side_of(*s), s->holes != nullptr);
    Sheet& sheet = sheets[key];
    sheet.side = key.first, sheet.holes = key.second;
    sheet.patches.push_back(std::move(s));
  }
  std::vector<Sheet> all;
  for (auto& [key, sheet] : sheets) all.push_back(std::move(sheet));
  return all;
}

std::int32_t bits_of(const PatchSurface::Holes& h, std::size_t k) {
  return h.answering[k] | h.real[k] << 1 | h.near[k] << 2 | h.wide[k] << 6;
}

std::vector<std::byte> blob_of(const Sheet& sheet) {
  const std::size_t windows = sheet.patches.size() * (sheet.holes ? 2 : 1);
  std::vector<std::int32_t> codes;
  codes.reserve(windows * std::size_t(sheet.side * sheet.side));
  const auto add = [&](auto code) {
    for (int j = 0; j < sheet.side; ++j)
      for (int i = 0; i < sheet.side; ++i) codes.push_back(code(std::size_t(j * kSide + i)));
  };
  for (const auto& s : sheet.patches) add([&](std::size_t k) { return std::int32_t(s->codes[k]); });
  for (const auto& s : sheet.patches)
    if (sheet.holes) add([&](std::size_t k) { return bits_of(*s->holes, k); });
  return encode_codes(codes, sheet.side, int(windows) * sheet.side);
}

void put_source(Writer& w, const GridInfo& g) {
  w.put(g.id.value);
  for (const double n : g.frame.numbers()) w.put(n);
  w.put(std::uint32_t(g.shape.width())), w.put(std::uint32_t(g.shape.height()));
  w.put(std::uint32_t(g.shape.pixel_is_area()));
  w.put(g.quantum), w.put(g.base), w.put(g.rim_error), w.put(g.code_origin);
}

Update::Source get_source(Reader& r) {
  Update::Source s;
  s.id.value = r.at_most(0xffff);
  std::array<double, 6> n;
  for (double& v : n) v = r.metres();
  if (n[1] * n[5] == n[2] * n[4]) refuse("a frame of it has no area");
  s.frame = Frame::from_trusted(n);
  const std::uint32_t width = r.at_most(GridShape::kMostSamples), height = r.at_most(GridShape::kMostSamples),
                      area = r.at_most(1);
  if (width < 2 || height < 2) refuse("a grid of it has no cells");
  s.shape = GridShape(int(width), int(height), area != 0);
  s.quantum = r.metres(), s.base = r.metres(), s.rim_error = r.error();
  if (s.quantum == 0) refuse("a grid of it has no unit");
  s.code_origin = r.get<std::int64_t>();
  return s;
}

void put_sheet(Writer& w, const Database& db, const Sheet& sheet, std::size_t bytes) {
  w.put(std::uint32_t(sheet.side)), w.put(std::uint32_t(sheet.patches.size()));
  w.put(std::uint32_t(sheet.holes)), w.put(std::uint32_t(bytes));
  for (const auto& s : sheet.patches) {
    const PatchRecord p = db.patch(s->id);
    w.put(s->id.value);
    for (const double e : p.error) w.put(e);
    w.put(p.bottom);
  }
}

Update::Patch get_patch(Reader& r, const std::vector<Update::Source>& sources) {
  Update::Patch p;
  PatchSurface& s = p.surface;
  s.id.value = r.get<std::uint64_t>(), s.level = s.id.level();
  for (double& e : p.error) e = r.error();
  p.bottom = r.error();
  const auto of = std::lower_bound(sources.begin(), sources.end(), s.id.grid(),
                                   [](const Update::Source& g, GridId id) { return g.id < id; });
  if (of == sources.end() || of->id != s.id.grid()) refuse("a patch of it belongs to no grid");
  if (s.level >= of->shape.levels() || s.id.bx() >= of->shape.blocks_i(s.level) ||
      s.id.by() >= of->shape.blocks_j(s.level))
    refuse("a patch of it lies in no block of its grid");
  s.first_i = double(s.id.bx()) * kKernelCells - kMargin,
  s.first_j = double(s.id.by()) * kKernelCells - kMargin;
  s.kernel = of->shape.kernel(s.level, s.id.bx(), s.id.by());
  s.domain = of->shape.domain(s.level, s.id.bx(), s.id.by());
  return p;
}

// A sheet's patches, without samples yet.
struct Expected {
  int side = 0;
  bool holes = false;
  std::size_t first = 0, count = 0, bytes = 0;
};

// `most`: patches of all sheets.
Expected get_sheet(Reader& r, Update& u, std::uint32_t most) {
  Expected e;
  e.side = int(r.at_most(kSide)), e.first = u.add.size(), e.count = r.at_most(most - std::uint32_t(e.first));
  e.holes = r.at_most(1) != 0, e.bytes = r.get<std::uint32_t>();
  if (e.side < 4 || e.count == 0) refuse("a sheet of it is empty");
  for (std::size_t k = 0; k < e.count; ++k) u.add.push_back(get_patch(r, u.sources));
  return e;
}

void fill(Update& u, const Expected& e, std::span<const std::byte> blob) {
  const std::size_t window = std::size_t(e.side * e.side), windows = e.count * (e.holes ? 2 : 1);
  std::vector<std::int32_t> codes(windows * window);
  if (const std::string problem = decode_codes(blob, e.side, int(windows) * e.side, codes); !problem.empty())
    refuse("its samples cannot be read");
  const auto each = [&](std::size_t first, auto set) {
    for (int j = 0; j < e.side; ++j)
      for (int i = 0; i < e.side; ++i)
        set(std::size_t(j * kSide + i), codes[first + std::size_t(j * e.side + i)]);
  };
  for (std::size_t k = 0; k < e.count; ++k) {
    PatchSurface& s = u.add[e.first + k].surface;
    each(k * window, [&](std::size_t at, std::int32_t code) { s.codes[at] = float(code); });
    if (!e.holes) continue;
    auto holes = std::make_unique<PatchSurface::Holes>();
    each((e.count + k) * window, [&](std::size_t at, std::int32_t bits) {
      const auto part = [&](int shift, int mask) { return std::uint8_t(bits >> shift & mask); };
      holes->answering[at] = part(0, 1), holes->real[at] = part(1, 1);
      holes->near[at] = part(2, 15), holes->wide[at] = part(6, 15);
    });
    s.holes = std::move(holes);
  }
}

}  // namespace

std::vector<std::byte> encode_update(const Database& db, const Difference& difference) {
  const std::vector<Sheet> sheets = sheets_of(db, difference.add);
  std::vector<GridId> grids;
  for (const PatchId id : difference.add) grids.push_back(id.grid());
  std::sort(grids.begin(), grids.end());
  grids.erase(std::unique(grids.begin(), grids.end()), grids.end());
  Writer structure, all;
  structure.put(std::uint32_t(grids.size()));
  for (const GridId id : grids) put_source(structure, db.grid(id).info);
  structure.put(std::uint32_t(sheets.size()));
  std::vector<std::vector<std::byte>> blobs;
  for (const Sheet& sheet : sheets) {
    blobs.push_back(blob_of(sheet));
    put_sheet(structure, db, sheet, blobs.back().size());
  }
  structure.put(std::uint32_t(difference.drop.size()));
  for (const PatchId id : difference.drop) structure.put(id.value);
  const std::vector<std::byte> packed = pack(structure.take());
  all.put(kMagic), all.put(std::uint32_t(packed.size()));
  std::vector<std::byte> bytes = all.take();
  bytes.insert(bytes.end(), packed.begin(), packed.end());
  for (const auto& blob : blobs) bytes.insert(bytes.end(), blob.begin(), blob.end());
  bytes.resize(std::max(bytes.size(), least_bytes(difference.add.size(), difference.drop.size())));
  return bytes;
}

Update decode_update(std::span<const std::byte> bytes) {
  Reader all(bytes);
  if (all.get<std::uint32_t>() != kMagic) refuse("it has an unknown format");
  const auto structure =
      unpack(all.take(all.get<std::uint32_t>()), std::min(kMostStructure, kMostPacking * bytes.size()));
  if (!structure) refuse("its structure cannot be read");
  Reader r(*structure);
  Update u;
  for (std::uint32_t n = r.at_most(0xffff); n > 0; --n) {
    u.sources.push_back(get_source(r));
    const std::size_t k = u.sources.size();
    if (k > 1 && !(u.sources[k - 2].id < u.sources[k - 1].id)) refuse("its grids are not in order");
  }
  std::vector<Expected> sheets;
  const auto most = std::uint32_t(std::min<std::size_t>(bytes.size() / kLeastBytes, UINT32_MAX));
  for (std::uint32_t n = r.at_most(2 * kSide); n > 0; --n) sheets.push_back(get_sheet(r, u, most));
  for (std::uint32_t n = r.get<std::uint32_t>(); n > 0; --n) u.drop.push_back({r.get<std::uint64_t>()});
  if (!r.done()) refuse("it is longer than it says");
  for (const Expected& e : sheets) fill(u, e, all.take(e.bytes));
  if (!all.done() && bytes.size() != least_bytes(u.add.size(), u.drop.size()))
    refuse("it is longer than it says");
  if (!all.only_zeros()) refuse("there is something where zeros should be");
  return u;
}

}  // namespace patchwork
