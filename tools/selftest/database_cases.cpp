// Cases of what is stored: coverage, the invariant, and what coming and going grids leave behind.
#include <fmt/format.h>
#include <gdal_priv.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "db/coverage.h"
#include "db/error.h"
#include "db/invariant.h"
#include "tools/bench/bench.h"
#include "tools/resampler.h"
#include "tools/selftest/selftest.h"

namespace patchwork::cli {

namespace {

constexpr std::uint64_t kMostBytes = std::uint64_t{4} << 30;  // of a file that is copied

// Other numbers for the same lattice, without rounding.
Frame doubled(const Frame& f) {
  const auto& n = f.numbers();
  return Frame::from_trusted({n[0], 2 * n[1], 2 * n[2], n[3], 2 * n[4], 2 * n[5]});
}
LatticeRect doubled(const LatticeRect& r) { return {r.i0 / 2, r.j0 / 2, r.i1 / 2, r.j1 / 2}; }

// The database once more, and small grids over its middle, made of its own heights and turned against it.
class Copy {
 public:
  explicit Copy(const Trial& t) : folder_({}), original_(t.db), memory_(t.options.memory) {
    for (const char* suffix : {"", "-wal"})
      if (std::filesystem::exists(t.db.path() + suffix))
        std::filesystem::copy_file(t.db.path() + suffix, path() + suffix);
  }
  Database open() const { return Database::open_existing(path(), memory_); }

  RasterSource probe(int number) const {
    const Extent e = original_.extent();
    const double step = finest_step(original_, e) / (1.7 + number), angle = 0.3 + 0.9 * number;
    const double c = step * std::cos(angle), s = step * std::sin(angle);
    std::array<double, 6> place{(e.xmin + e.xmax) / 2, c, s, (e.ymin + e.ymax) / 2, s, -c};
    std::vector<double> heights;
    for (int k = 0; k < kWidth * kHeight; ++k)
      heights.push_back(original_.grids()[0].info.lowest + (k * 7 + number) % 64 / 8.0);
    const std::string file = folder_.path(fmt::format("probe{}.tif", number));
    write(file, place, heights);
    RasterOptions options{.accuracy = accuracy(number)};
    if (!original_.crs().empty()) options.crs = original_.crs();
    return RasterSource::open(file, options, original_.crs());
  }

 private:
  static void write(const std::string& file, std::array<double, 6>& place, std::vector<double>& heights) {
    GDALDriver* driver = GetGDALDriverManager()->GetDriverByName("GTiff");
    const GDALDatasetUniquePtr out(driver->Create(file.c_str(), kWidth, kHeight, 1, GDT_Float64, nullptr));
    if (!out || out->SetGeoTransform(place.data()) != CE_None ||
        out->GetRasterBand(1)->RasterIO(GF_Write, 0, 0, kWidth, kHeight, heights.data(), kWidth, kHeight,
                                        GDT_Float64, 0, 0, nullptr) != CE_None)
      throw Error(file, "a grid for the trial cannot be written");
  }
  static constexpr int kWidth = 64, kHeight = 48;
  std::string path() const { return folder_.path("copy.pwk"); }
  double accuracy(int number) const {
    double least = INFINITY;
    for (const Grid& g : original_.grids()) least = std::min(least, g.info.accuracy);
    return 0.5 * std::max(least, 1e-3) / (1 + number);
  }
  WorkFolder folder_;
  const Database& original_;
  std::uint64_t memory_;
};

void insert(Database& db, const Copy& copy, std::initializer_list<int> probes) {
  for (const int p : probes) db.import(copy.probe(p), {.name = fmt::format("selftest probe {}", p)});
}
void remove(Database& db, std::initializer_list<int> probes) {
  for (const int p : probes) db.remove(fmt::format("selftest probe {}", p));
}

}  // namespace

Verdict rotated_nesting(Trial& t) {
  Verdict v{"CoverageRotatedNesting",
            "parents cover their children and are covered by them, exactly",
            0,
            0,
            0,
            "wrong answers",
            {}};
  CoverageCounts counts;
  for (int n = 0; n < t.options.tries / 10; ++n) {
    const Grid& g = t.any_grid();
    const GridShape& s = g.info.shape;
    if (s.levels() < 2) continue;
    const int level = t.integer(1, s.levels() - 1), bx = t.integer(0, s.blocks_i(level) - 1),
              by = t.integer(0, s.blocks_j(level) - 1);
    const LatticeRect parent = s.kernel(level, bx, by);
    const Frame twice = doubled(g.info.frame);
    std::vector<OrientedRect> children;
    for (int c = 0; c < 4; ++c) {
      const int x = 2 * bx + c % 2, y = 2 * by + c / 2;
      if (x >= s.blocks_i(level - 1) || y >= s.blocks_j(level - 1)) continue;
      const LatticeRect child = s.kernel(level - 1, x, y);
      children.push_back({&twice, doubled(child)});
      const OrientedRect cover{&twice, doubled(parent)};
      v.worst += !covered({&g.info.frame, child}, std::span(&cover, 1), counts);
    }
    v.worst += !covered({&g.info.frame, parent}, children, counts);
    v.tries += children.size() + 1;
  }
  if (v.tries == 0) v.left_out = "no grid has a second level";
  return v;
}

Verdict invariant(Trial& t) {
  Verdict v{"Invariant", "tops and flags are what the set of patches alone says", 0, 0, 0, "patches differ",
            {}};
  CoverageCounts counts;
  const Database::Reading reading = t.db.reading();
  for (int n = 0; n < t.options.tries / 10; ++n) {
    const std::size_t g = std::size_t(t.integer(0, int(t.db.grids().size()) - 1));
    const Grid& grid = t.db.grids()[g];
    const std::size_t k = std::size_t(t.between(0, double(grid.patches.size())));
    if (k >= grid.patches.size() || !grid.patches[k].exists()) continue;
    const Standing s = standing(t.db.grids(), {g, k}, counts);
    v.worst += s.top != grid.patches[k].top || s.best != grid.patches[k].best();
    ++v.tries;
  }
  return v;
}

std::vector<Verdict> changes(Trial& t) {
  std::vector<Verdict> all{
      {"InsertRemove", "a grid that came and went leaves no trace", 0, 0, 0, "hashes differ", {}},
      {"OrderPermutations", "the order in which grids come decides nothing", 0, 0, 0, "hashes differ", {}},
      {"EqualGrids", "the same grid twice is there once", 0, 0, 0, "hashes differ", {}}};
  const auto leave_out = [&](const std::string& why) {
    for (Verdict& v : all) v.left_out = why;
    return all;
  };
  if (t.db.file_bytes() > kMostBytes) return leave_out("the file is too large to be copied");
  std::optional<Copy> copied;
  std::optional<Database> opened;
  try {
    opened.emplace(copied.emplace(t).open());
  } catch (const std::exception& e) {  // a writer moved what stood in the log while it was copied
    return leave_out(fmt::format("it could not be copied as it stands: {}", e.what()));
  }
  const Copy& copy = *copied;
  Database& db = *opened;
  const std::string before = db.content_hash();
  if (before != t.db.content_hash()) return leave_out("the database is being changed");
  insert(db, copy, {0, 1, 2});
  const std::string with = db.content_hash();
  const bool twice = db.import(copy.probe(1), {.name = "once more"}).duplicate_of.empty();
  all[2].tries = 1, all[2].worst = twice || db.content_hash() != with;
  remove(db, {1, 0, 2});
  all[0].tries = 1, all[0].worst = db.content_hash() != before || with == before;
  for (const auto& order :
       {std::initializer_list<int>{0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}}) {
    insert(db, copy, order);
    all[1].worst += db.content_hash() != with, ++all[1].tries;
    remove(db, {0, 1, 2});
    all[0].worst += db.content_hash() != before, ++all[0].tries;
  }
  return all;
}

}  // namespace patchwork::cli
