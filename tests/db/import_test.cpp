// Grids on their way into a database: bands, quantised samples, degenerate shapes.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "db/ingest.h"
#include "tests/db/databases.h"
#include "tests/grids.h"
#include "tests/hard_case.h"
#include "tests/seed.h"

namespace patchwork {
namespace {

// --- Streaming.

constexpr int kBand = 448;  // rows of the smallest band: a payload chunk of the coarsest streamed level
constexpr std::size_t kTiny = 1000;

GridFile tall(GDALDataType type, int height, bool holes, bool area, std::uint64_t seed) {
  GridFile file{.width = 37, .height = height, .pixel_is_area = area, .type = type, .nodata = -9999};
  if (type != GDT_Int16) file.nodata.reset();
  file.at = [=](int i, int j) {
    std::mt19937_64 random(seed + std::uint64_t(j) * 1000 + std::uint64_t(i));
    random.discard(3);
    const double noise = double(random() % 1000) / 7;
    const bool seam = j % kBand < 20 || j % kBand > kBand - 20;  // most holes lie where bands meet
    if (holes && (noise < (seam ? 20 : 1) || (i > 20 && j % kBand < 60))) return kHole;
    const double h = 300 * std::sin(0.03 * i) * std::cos(0.011 * j) + noise;
    return type == GDT_Int16 ? std::round(h) : h;
  };
  return file;
}

void expect_same_in_bands(const GridFolder& folder, const GridFile& file, const std::string& what) {
  const RasterSource source = folder.source(file, "tall");
  EXPECT_LT(Ingest(source, kTiny, {}).band_rows(), file.height) << "tiny memory makes bands";
  EXPECT_GE(Ingest(source, kDefaultMemory, {}).band_rows(), file.height);
  Database whole = folder.database(what + ".whole"), banded = folder.database(what + ".banded");
  whole.import(source, {.name = "tall"});
  ASSERT_EQ(refusal_of([&] { banded.import(source, {.name = "tall", .memory = kTiny}); }), "") << what;
  EXPECT_EQ(whole.content_hash(), banded.content_hash()) << what;
  EXPECT_EQ(different_surfaces(whole, whole.grids()[0], banded, banded.grids()[0]), 0) << what;
}

TEST(Streaming, BandsGiveTheSameDatabaseAsOnePiece) {
  const std::uint64_t seed = test_seed(1);
  for (const GDALDataType type : {GDT_Int16, GDT_Float32, GDT_Float64})
    for (const bool holes : {false, true})
      for (const bool area : {false, true}) {
        const GridFolder folder;
        const int height = 2 * kBand + 100 + int(type) * 11 + holes;
        expect_same_in_bands(folder, tall(type, height, holes, area, seed), GDALGetDataTypeName(type));
      }
}

TEST(Streaming, TheLastBandMayBeAsShortAsOneRow) {
  const std::uint64_t seed = test_seed(2);
  for (const int rest : {0, 1, 2, 3, 24, 25, 113})
    for (const bool holes : {false, true}) {
      const GridFolder folder;
      expect_same_in_bands(folder, tall(GDT_Float32, 2 * kBand + rest, holes, true, seed),
                           std::to_string(rest));
    }
}

TEST(Streaming, ADifferenceOfOneSampleGivesAnotherHash) {
  const GridFolder folder;
  GridFile file = tall(GDT_Int16, 2 * kBand + 60, true, true, test_seed(3));
  Database a = folder.database("a"), b = folder.database("b");
  folder.add(a, file, "grid", {.memory = kTiny});
  file.at = [at = file.at](int i, int j) { return at(i, j) + (i == 10 && j == kBand + 100); };
  folder.add(b, file, "grid", {.memory = kTiny});
  EXPECT_NE(a.content_hash(), b.content_hash());
}

// --- QuantiseTies.

struct Stored {
  double quantisation, worst;
  int inexact;
};

Stored store(const GridFile& file) {
  const GridFolder folder;
  Database db = folder.database();
  const ImportReport report = folder.add(db, file, "grid");
  const Grid& g = db.grids()[0];
  EXPECT_EQ(report.quantisation, g.info.quantisation);
  Stored s{g.info.quantisation, 0, 0};
  for (int j = 0; j < file.height; ++j)
    for (int i = 0; i < file.width; ++i) {
      const double h = file.type == GDT_Float32 ? double(float(file.at(i, j))) : file.at(i, j);
      const double off = std::abs(stored_height(db, g, i, j) - h);
      s.worst = std::max(s.worst, off), s.inexact += off > 0;
    }
  // Level-0 patches carry it in their bound.
  for (const double e : g.at(0, 0, 0).error) EXPECT_GE(e, file.accuracy + s.quantisation);
  return s;
}

GridFile values(GDALDataType type, double accuracy, std::function<double(int)> nth) {
  GridFile file{.type = type, .accuracy = accuracy};
  file.at = [nth = std::move(nth), w = file.width](int i, int j) { return nth(j * w + i); };
  return file;
}

TEST(QuantiseTies, IntegersAreLossless) {
  const std::uint64_t seed = test_seed(4);
  const auto random = [seed](int n, std::int64_t low, std::int64_t high) {
    std::mt19937_64 r(seed + std::uint64_t(n));
    r.discard(2);
    return double(low + std::int64_t(r() % std::uint64_t(high - low + 1)));
  };
  struct Case {
    GDALDataType type;
    std::int64_t low, high;
  };
  for (const Case c : {Case{GDT_Byte, 0, 255}, Case{GDT_Int16, -32768, 32767}, Case{GDT_UInt16, 0, 65535},
                       Case{GDT_Int32, 8000000, 8000900}, Case{GDT_Int32, -2147483648, -2147480000},
                       Case{GDT_Int32, 0, 1 << 23}, Case{GDT_Int32, -5, (1 << 23) - 5},
                       Case{GDT_UInt32, 4294960000, 4294967295}}) {
    const Stored s = store(values(c.type, 0, [=](int n) {
      return n == 0 ? double(c.low) : n == 1 ? double(c.high) : random(n, c.low, c.high);
    }));
    EXPECT_EQ(s.inexact, 0) << c.low << " to " << c.high;
    EXPECT_EQ(s.quantisation, 0);
  }
}

TEST(QuantiseTies, AHugeRangeOfIntegersIsStoredWithinItsStatedError) {
  const Stored s =
      store(values(GDT_Int32, 1, [](int n) { return n % 2 ? -2147483648.0 + 37 * n : 2147483647.0 - n; }));
  EXPECT_LE(s.worst, s.quantisation);
  EXPECT_GT(s.inexact, 0);
  EXPECT_LE(s.quantisation, std::exp2(32 - 23)) << "and the error is no larger than 23 bits need";
}

TEST(QuantiseTies, FloatsAreLosslessWhereThatIsCheap) {
  const Stored offset = store(values(GDT_Float32, 0.01, [](int n) { return 8000 + n / 64.0; }));
  EXPECT_EQ(offset.inexact, 0) << "1/64 m at 8 km";
  EXPECT_EQ(offset.quantisation, 0);
  EXPECT_EQ(store(values(GDT_Float64, 0.5, [](int n) { return -n / 8.0; })).inexact, 0);
  EXPECT_EQ(store(values(GDT_Float32, 0, [](int) { return 0.1f; })).inexact, 0)
      << "accuracy 0 asks for all bits";
}

TEST(QuantiseTies, ExactHalfStepsStayWithinTheStatedError) {
  // Accuracy 1 gives codes of 1/16; one sample of 2^-12 keeps the exact form from being taken.
  for (const double at : {0.0, -700.0, 8000.0}) {
    const Stored s = store(values(
        GDT_Float64, 1, [=](int n) { return n == 7 ? at + std::exp2(-12) : at + (n - 600 + 0.5) / 16; }));
    EXPECT_EQ(s.quantisation, 1.0 / 32);
    EXPECT_EQ(s.worst, s.quantisation) << "half steps are the worst case, and no worse";
    report_case("QuantiseTies", "exact half steps of 1/16 m", 1200, s.worst, s.quantisation, "m");
    EXPECT_GT(s.inexact, 1000) << "negative control: they are not stored exactly";
  }
}

TEST(QuantiseTies, AnyFloatsStayWithinTheStatedError) {
  const std::uint64_t seed = test_seed(5);
  for (const GDALDataType type : {GDT_Float32, GDT_Float64})
    for (const double scale : {1e-6, 1.0, 3e4, 1e30})
      for (const double accuracy : {0.0, 1e-4, 0.3}) {
        const Stored s = store(values(type, accuracy, [=](int n) {
          std::mt19937_64 r(seed + std::uint64_t(n));
          return std::uniform_real_distribution<double>(-0.2, 1)(r) * scale;
        }));
        EXPECT_LE(s.worst, s.quantisation * (1 + 1e-15)) << scale << ", accuracy " << accuracy;
        EXPECT_LE(s.quantisation, std::max(accuracy / 32, 1.2 * scale * std::exp2(-22)));
      }
}

TEST(QuantiseTies, CliffsAndSpikesAreStoredAsTheyAre) {
  const Stored s = store(values(GDT_Int16, 0, [](int n) {
    return n % 3 == 0 ? 32767 : n % 3 == 1 ? -32768 : 0;
  }));
  EXPECT_EQ(s.inexact, 0);
  report_case("QuantiseTies", "cliffs and spikes of 65 535 m", 1200, s.worst, 0, "m");
}

// The naive form: each sample is predicted from the ones before it, by the encoder in double and by the
// decoder in float32, and only the rounded residual is stored.
TEST(QuantiseTies, PredictingInFloatsWouldLoseSamples) {
  constexpr double q = 0.1;
  std::mt19937_64 random(test_seed(6));
  std::uniform_real_distribution<double> slope(-3, 3);
  double height = 8000, wide = 0, wide_before = 0;
  float narrow = 0, narrow_before = 0;
  int beyond = 0;
  for (int n = 0; n < 10000; ++n) {
    height += slope(random);
    const double residual = std::round((height - (2 * wide - wide_before)) / (2 * q));
    const double next = 2 * wide - wide_before + residual * 2 * q;
    const float decoded = 2 * narrow - narrow_before + float(residual) * float(2 * q);
    beyond += std::abs(double(decoded) - height) > q;
    wide_before = wide, wide = next, narrow_before = narrow, narrow = decoded;
  }
  EXPECT_GT(beyond, 100) << "negative control: codes are integers, and so are their predictions";
}

// --- DegenerateGrids.

TEST(DegenerateGrids, RefusedOnesLeaveNothingBehind) {
  const GridFolder folder;
  Database db = folder.database();
  folder.add(db, heights("1 2 3 / 4 5 6 / 7 8 9"), "good");
  const std::string hash = db.content_hash();
  for (const char* text : {"1 2 3 4", "1 / 2 / 3", "5"})
    EXPECT_NE(refusal_of([&] { folder.add(db, heights(text), "line"); }).find("at least 2 x 2"),
              std::string::npos);
  EXPECT_NE(refusal_of([&] {
              folder.add(db, heights("1 2 / 3 4", {.geotransform = {0, 10, 4, 0, 0, -10}}), "sheared");
            }).find("sheared"),
            std::string::npos);
  EXPECT_EQ(db.grids().size(), 1u);
  EXPECT_EQ(db.content_hash(), hash);
  report_law("DegenerateGrids", "lines, points and shears are refused whole", 4);
}

TEST(DegenerateGrids, FramesWithoutAnInverseAreRefused) {
  using Numbers = std::array<double, 6>;
  for (const Numbers& n : {Numbers{0, 0, 0, 0, 0, -1}, Numbers{0, 1, 0, 0, 0, 0}, Numbers{0, 1, 1, 0, 1, 1},
                           Numbers{0, INFINITY, 0, 0, 0, 1}, Numbers{NAN, 1, 0, 0, 0, 1},
                           Numbers{0, 1e200, 0, 0, 0, 1e200}, Numbers{0, 1e-170, 0, 0, 0, -1e-170}}) {
    EXPECT_NE(refusal_of([&] { Frame::from_geotransform(n, "grid"); }), "");
    const double naive = n[0] + n[5] / (n[1] * n[5] - n[2] * n[4]);
    EXPECT_FALSE(std::isfinite(naive) && naive != 0) << "negative control: the plain inverse is of no use";
  }
  EXPECT_EQ(refusal_of([&] { Frame::from_geotransform({0, 1, 0, 0, 0, -1}, "grid"); }), "");
}

TEST(DegenerateGrids, TheSmallestGridsAreOnePatchWithEverySampleKept) {
  for (const char* text : {"1 2 / 3 4", "1 2 / 3 4 / 5 9", "1 2 7 / 3 4 -5", "0 0 / 0 0"})
    for (const bool area : {false, true}) {
      const GridFolder folder;
      const GridFile file = heights(text, {.pixel_is_area = area});
      Database db = folder.database();
      EXPECT_EQ(folder.add(db, file, "grid").patches, 1u);
      const Grid& g = db.grids()[0];
      for (int j = 0; j < file.height; ++j)
        for (int i = 0; i < file.width; ++i) EXPECT_EQ(stored_height(db, g, i, j), file.at(i, j));
      EXPECT_TRUE(g.patches[0].best());
      EXPECT_EQ(g.patches[0].error[0], file.accuracy) << "a bilinear patch of level 0 is the grid itself";
    }
}

TEST(DegenerateGrids, AConstantGridHasNoErrorButItsAccuracyAtAnyLevel) {
  const GridFolder folder;
  Database db = folder.database();
  folder.add(db, {.width = 150, .height = 90, .accuracy = 0.25, .at = [](int, int) { return 1234.5; }},
             "flat");
  each_patch(db.grids()[0], [&](std::size_t k, auto) {
    for (const double e : db.grids()[0].patches[k].error) EXPECT_EQ(e, 0.25);
  });
  // All but the greatest are redundant: it says the same with less.
  EXPECT_EQ(count_live(db), 1u);
}

TEST(DegenerateGrids, MirroredAxesAndAnyStepKeepSamplesAndExtent) {
  for (const double sx : {10.0, -10.0, 1e-6, 1e6})
    for (const double sy : {7.0, -7.0, 2e-6, 1e6}) {
      const GridFolder folder;
      const GridFile file{
          .width = 70, .height = 45, .geotransform = {1000, sx, 0, 2000, 0, sy}, .at = [](int i, int j) {
            return double(i * i - 3 * j);
          }};
      Database db = folder.database();
      folder.add(db, file, "grid");
      const Grid& g = db.grids()[0];
      for (int j = 0; j < file.height; ++j)
        for (int i = 0; i < file.width; ++i) ASSERT_EQ(stored_height(db, g, i, j), file.at(i, j));
      const Extent e = db.extent();
      EXPECT_NEAR(e.xmin, 1000 + std::min(0.0, 70 * sx), 1e-9 * 1e8);
      EXPECT_NEAR(e.xmax - e.xmin, 70 * std::abs(sx), 1e-10 + 1e-12 * 7e7);
      EXPECT_NEAR(e.ymax - e.ymin, 45 * std::abs(sy), 1e-10 + 1e-12 * 7e7);
      g.patches.each([&](std::size_t, const PatchRecord& p) {
        EXPECT_TRUE(std::isfinite(p.bottom) && p.bottom >= file.accuracy && p.exists());
      });
    }
}

TEST(DegenerateGrids, APlaceBeyondAllNumbersIsRefusedAndTheOthersStay) {
  const GridFolder folder;
  Database db = folder.database();
  folder.add(db, heights("1 2 / 3 4"), "good");
  GridFile far = heights("1 2 / 3 4");
  far.geotransform[0] = 1.797e308, far.geotransform[1] = 1e305;
  EXPECT_NE(refusal_of([&] { folder.add(db, far, "far"); }), "");
  EXPECT_EQ(Database::open(db.path()).grids().size(), 1u);
}

// What means no data without saying so.
TEST(DegenerateGrids, HeightsThatReachTooFarAreRefusedWhereTheyCannotBeStored) {
  const GridFolder folder;
  Database db = folder.database();
  GridFile file{.width = 100, .height = 90};
  file.type = GDT_Float64;
  file.at = [](int i, int j) {
    return i == 31 && j == 17 ? std::numeric_limits<double>::lowest() : 300 + std::sin(0.1 * i) + 0.02 * j;
  };
  EXPECT_NE(refusal_of([&] { folder.add(db, file, "void"); }).find("--nodata"), std::string::npos);
  EXPECT_TRUE(db.grids().empty());
  EXPECT_TRUE(db.check().empty());
  file.nodata = std::numeric_limits<double>::lowest();
  folder.add(db, file, "void");
  EXPECT_TRUE(db.check().empty());
  EXPECT_GT(db.grids()[0].info.lowest, 298);
}
}  // namespace
}  // namespace patchwork
