// Updates: what a client gets is what a reader of the database has, bit by bit; damage is refused.
#include "query/wire.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

#include "db/pack.h"
#include "tests/db/databases.h"
#include "tests/grids.h"
#include "tests/seed.h"

namespace patchwork {
namespace {

double rough(double x, double y) {
  return 30 * std::sin(x / 150) * std::cos(y / 110) + std::sin(x * 1.3 + y);
}

class Wire : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new GridFolder;
    db_ = new Database(folder_->database());
    GridFile base{
        .width = 150, .height = 130, .geotransform = rotated(-1500, 1400, 0, 20, 20), .accuracy = 1};
    GridFile holed{.width = 160, .height = 120, .geotransform = rotated(-300, 400, 25, 5, 5)};
    holed = of_terrain(holed, rough);
    holed.at = [at = holed.at](int i, int j) { return i > 60 && i < 90 && j < 40 ? kHole : at(i, j); };
    folder_->add(*db_, of_terrain(base, rough), "base");
    folder_->add(*db_, holed, "holed");
  }
  static void TearDownTestSuite() { delete db_, delete folder_; }
  static Difference from_nothing(double error) {
    return {extract(*db_, {.error = error}).patches, {{7}, {9}}};
  }
  static GridFolder* folder_;
  static Database* db_;
};
GridFolder* Wire::folder_ = nullptr;
Database* Wire::db_ = nullptr;

// The part of the window that an interpolant inside the domain reads.
int differing_samples(const PatchSurface& a, const PatchSurface& b, int& compared) {
  const double step = std::exp2(a.level);
  int n = 0;
  for (int j = 0; j <= std::floor(a.domain.j1 / step - a.first_j) + 1; ++j)
    for (int i = 0; i <= std::floor(a.domain.i1 / step - a.first_i) + 1; ++i, ++compared)
      n += a.codes[std::size_t(j * PatchSurface::kSide + i)] !=
           b.codes[std::size_t(j * PatchSurface::kSide + i)];
  return n;
}

int differing_holes(const PatchSurface& a, const PatchSurface& b) {
  if (!a.holes || !b.holes) return bool(a.holes) != bool(b.holes);
  const double step = std::exp2(a.level);
  int n = 0;
  for (int j = 0; j <= std::floor(a.domain.j1 / step - a.first_j) + 1; ++j)
    for (int i = 0; i <= std::floor(a.domain.i1 / step - a.first_i) + 1; ++i) {
      const auto k = std::size_t(j * PatchSurface::kSide + i);
      n += a.holes->answering[k] != b.holes->answering[k] || a.holes->real[k] != b.holes->real[k] ||
           a.holes->near[k] != b.holes->near[k] || a.holes->wide[k] != b.holes->wide[k];
    }
  return n;
}

TEST_F(Wire, AClientGetsWhatAReaderHas) {
  int holed = 0, compared = 0;
  for (const double error : {0.0, 0.5, 3.0, 20.0}) {
    const Difference d = from_nothing(error);
    const std::vector<std::byte> bytes = encode_update(*db_, d);
    const Update u = decode_update(bytes);
    EXPECT_EQ(u.drop, d.drop);
    ASSERT_EQ(u.add.size(), d.add.size());
    std::vector<PatchId> ids;
    for (const Update::Patch& p : u.add) {
      const auto s = db_->surface(p.surface.id);
      ids.push_back(p.surface.id);
      EXPECT_EQ(p.bottom, db_->patch(s->id).bottom);
      EXPECT_EQ(p.error, db_->patch(s->id).error);
      EXPECT_EQ(p.surface.first_i, s->first_i);
      EXPECT_EQ(p.surface.first_j, s->first_j);
      EXPECT_EQ(p.surface.domain.i1, s->domain.i1);
      EXPECT_EQ(p.surface.kernel.j0, s->kernel.j0);
      EXPECT_EQ(differing_samples(*s, p.surface, compared), 0);
      EXPECT_EQ(differing_holes(*s, p.surface), 0);
      holed += s->holes != nullptr;
    }
    std::vector<PatchId> wanted = d.add;
    std::sort(ids.begin(), ids.end()), std::sort(wanted.begin(), wanted.end());
    EXPECT_EQ(ids, wanted);
    EXPECT_LT(bytes.size(), d.add.size() * 4 * 33 * 33) << "no larger than the samples as floats";
  }
  EXPECT_GT(holed, 0);
  EXPECT_GT(compared, 10000);
  const auto s = db_->surface(from_nothing(0).add.front());
  PatchSurface other;
  other.codes = s->codes, other.codes[5 * PatchSurface::kSide + 5] += 1, other.domain = s->domain;
  EXPECT_EQ(differing_samples(*s, other, compared), 1) << "negative control";
}

TEST_F(Wire, NothingIsSentForNothing) {
  const std::vector<std::byte> bytes = encode_update(*db_, {});
  EXPECT_LT(bytes.size(), 64u);
  const Update u = decode_update(bytes);
  EXPECT_TRUE(u.add.empty() && u.drop.empty() && u.sources.empty());
}

std::vector<std::byte> with_structure(const std::vector<std::byte>& structure) {
  const std::vector<std::byte> packed = pack(structure);
  const std::uint32_t head[] = {0x31555750, std::uint32_t(packed.size())};
  const auto bits = std::as_bytes(std::span(head));
  std::vector<std::byte> all(bits.begin(), bits.end());
  all.insert(all.end(), packed.begin(), packed.end());
  return all;
}

TEST_F(Wire, FewBytesAskForLittleMemory) {
  const std::vector<std::byte> whole = encode_update(*db_, {{from_nothing(3).add.front()}, {}});
  std::uint32_t length = 0;
  std::memcpy(&length, whole.data() + 4, 4);
  const std::vector<std::byte> one = *unpack(std::span(whole).subspan(8, length), 1 << 20);
  constexpr std::size_t kSource = 92, kCount = 4 + kSource + 4 + 4, kPatch = 40, kPatches = 100000;
  std::vector<std::byte> many(one.begin(), one.begin() + kCount + 12);  // up to the sheet's patches
  const std::uint32_t count = kPatches;
  std::memcpy(many.data() + kCount, &count, 4);
  for (std::size_t k = 0; k < kPatches; ++k)
    many.insert(many.end(), one.begin() + kCount + 12, one.begin() + kCount + 12 + kPatch);
  many.resize(many.size() + 4);  // no drops
  std::vector<std::byte> update = with_structure(many);
  EXPECT_LT(update.size(), kPatches / 4) << "negative control: so many patches in so few bytes";
  EXPECT_THROW(decode_update(update), Error);
  update.resize(many.size() / 8);  // the structure may be so long, the patches not so many
  try {
    decode_update(update);
    ADD_FAILURE() << "it was taken";
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("impossible number"), std::string::npos) << e.what();
  }
}

TEST_F(Wire, FlatLandArrivesWhole) {
  const GridFolder folder;
  Database flat = folder.database();
  folder.add(flat, {.width = 1200, .height = 900, .at = [](int, int) { return 7.; }}, "flat");
  Difference d;
  const GridInfo& grid = flat.grids().front().info;
  for (int by = 0; by < int(grid.shape.blocks_j(0)); ++by)
    for (int bx = 0; bx < int(grid.shape.blocks_i(0)); ++bx)
      d.add.push_back(PatchId::make(grid.id, 0, bx, by));
  d.drop = d.add;
  const std::vector<std::byte> bytes = encode_update(flat, d);
  EXPECT_EQ(bytes.size(), 65 * d.add.size()) << "zeros fill it up";
  const Update u = decode_update(bytes);
  EXPECT_EQ(u.add.size(), d.add.size());
  EXPECT_EQ(u.drop, d.drop);
  std::vector<std::byte> longer = bytes, other = bytes;
  longer.push_back(std::byte{0}), other.back() = std::byte{1};
  EXPECT_THROW(decode_update(longer), Error);
  EXPECT_THROW(decode_update(other), Error);
}

TEST_F(Wire, DamageIsRefusedOrHarmless) {
  std::mt19937_64 random(test_seed(1));
  const std::vector<std::byte> whole = encode_update(*db_, from_nothing(3));
  for (std::size_t n = 0; n < whole.size(); n += 1 + whole.size() / 300)
    EXPECT_THROW(decode_update(std::span(whole).first(n)), Error) << n;
  int refused = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    std::vector<std::byte> bytes = whole;
    bytes[random() % (trial % 2 ? bytes.size() : 200)] ^= std::byte(1 + random() % 255);
    try {
      decode_update(bytes);
    } catch (const Error&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 500);
}

}  // namespace
}  // namespace patchwork
