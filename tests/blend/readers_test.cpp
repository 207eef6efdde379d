// Readers beside a writer, on plain threads: under the thread sanitizer nothing races, and everywhere each
// reader gets the bits of the state that it opened.
#include <oneapi/tbb/global_control.h>

#include <atomic>
#include <thread>

#include "tests/blend/scene.h"

namespace patchwork {
namespace {

constexpr std::size_t kLittle = 1 << 20;  // bytes: caches that let go of what is still needed
constexpr int kReaders = 4, kRounds = 6, kMostRounds = 500;

class ReadersBesideAWriter : public testing::Test {
 protected:
  ReadersBesideAWriter() {
    const std::vector<GridFile> grids = surveys();
    Database db = folder_.database();
    for (std::size_t k = 0; k < 3; ++k) folder_.add(db, grids[k], "grid" + std::to_string(k));
    guest_.push_back(folder_.source(grids[3], "guest"));
    std::mt19937_64 random(test_seed(1));
    points_ = random_points(db.extent(), 2000, random);
    expected_ = evaluate(db, 0, points_, {.smoothness = 2});
    without_ = db.content_hash();
    db.import(guest_[0], {.name = "guest"});
    with_ = db.content_hash();
    other_ = evaluate(db, 0, points_, {.smoothness = 2});
    db.remove("guest");
  }
  std::string path() const { return folder_.path("grids.patchwork"); }
  bool answers_as(const Database& db, const Answers& expected) const {
    return evaluate(db, 0, points_, {.smoothness = 2}) == expected;
  }

  GridFolder folder_;
  std::vector<RasterSource> guest_;
  Points points_;
  Answers expected_{0}, other_{0};
  std::string with_, without_;
  // TBB is not instrumented: what it hands to its own threads would look like races.
  tbb::global_control one_{tbb::global_control::max_allowed_parallelism, 1};
};

TEST_F(ReadersBesideAWriter, ManyThreadsReadOneDatabaseWithSmallCaches) {
  const Database db = Database::open(path(), kLittle);
  std::atomic<int> wrong{0};
  std::vector<std::thread> readers;
  for (int r = 0; r < kReaders; ++r)
    readers.emplace_back([&] {
      for (int n = 0; n < kRounds; ++n) wrong += !answers_as(db, expected_);
    });
  for (std::thread& t : readers) t.join();
  EXPECT_EQ(wrong, 0);
  EXPECT_FALSE(answers_as(db, other_)) << "negative control: with the guest the bits are others";
}

TEST_F(ReadersBesideAWriter, AWriterDisturbsNoReader) {
  const Database shared = Database::open(path(), kLittle);
  std::atomic<bool> writing{true};
  std::atomic<int> wrong{0}, moved{0};
  std::thread writer([&] {
    Database db = Database::open_existing(path(), kLittle);
    for (int n = 0; n < kMostRounds && (n < kRounds || moved < 4); ++n)
      db.import(guest_[0], {.name = "guest"}), db.remove("guest");
    writing = false;
  });
  std::vector<std::thread> readers;
  for (int r = 0; r < kReaders; ++r)
    readers.emplace_back([&, r] {
      if (r % 2) {  // keeps the state that it shares with another
        while (writing) wrong += !answers_as(shared, expected_);
        return;
      }
      Database own = Database::open(path(), kLittle);
      while (writing) {
        moved += own.refresh();
        const std::string hash = own.content_hash();
        wrong += hash != with_ && hash != without_;
        wrong += !answers_as(own, hash == with_ ? other_ : expected_);
      }
    });
  writer.join();
  for (std::thread& t : readers) t.join();
  EXPECT_EQ(wrong, 0);
  EXPECT_GT(moved, 0) << "negative control: the state did change meanwhile";
}

TEST_F(ReadersBesideAWriter, ACheckFindsNothingWhileOthersReadAndWrite) {
  const Database shared = Database::open(path(), kLittle);
  std::atomic<bool> writing{true};
  std::atomic<int> wrong{0}, checks{0}, moved{0};
  std::thread writer([&] {
    Database db = Database::open_existing(path(), kLittle);
    for (int n = 0; n < kMostRounds && (n < kRounds || moved < 2 || checks < 4); ++n)
      db.import(guest_[0], {.name = "guest"}), db.remove("guest");
    writing = false;
  });
  const auto check = [&](const Database& db) {
    for (const Problem& p : db.check()) ADD_FAILURE() << p.what << " at " << p.where;
    ++checks;
  };
  std::thread checker([&] {
    while (writing) check(shared);
  });
  std::thread reader([&] {
    while (writing) wrong += !answers_as(shared, expected_);
  });
  std::thread mover([&] {
    Database own = Database::open(path(), kLittle);
    while (writing) moved += own.refresh(), check(own);
  });
  for (std::thread* t : {&writer, &checker, &reader, &mover}) t->join();
  EXPECT_EQ(wrong, 0);
  EXPECT_GT(checks, 3);
  EXPECT_GT(moved, 0) << "negative control: the state did change meanwhile";
}

#ifdef __SANITIZE_THREAD__
// Without this a preset that forgot its flags would pass too.
TEST(ThreadSanitizer, SeesARace) {
  EXPECT_EXIT(
      {
        int shared = 0;
        std::thread other([&] { ++shared; });
        ++shared;
        other.join();
        std::exit(0);
      },
      testing::ExitedWithCode(66), "data race");
}
#endif

}  // namespace
}  // namespace patchwork
