// The command under fire: killed at any moment, on a disk that fills up, beside another writer.
#include <gtest/gtest.h>
#include <signal.h>
#include <sqlite3.h>
#include <sys/resource.h>

#include <chrono>
#include <cstdlib>
#include <random>
#include <thread>

#include "tests/cli/command.h"
#include "tests/seed.h"

namespace patchwork {
namespace {

using std::chrono::duration;
using std::chrono::steady_clock;

// PATCHWORK_TRIALS=200 tries as often as the design asks for; with TMPDIR on a disk of 16 MB, that one fills
// up.
int trials() { return test_trials(24); }

class Fault : public CliTest {
 protected:
  void SetUp() override {
    CliTest::SetUp();
    database_ = hill_database();
    if (const char* disk = std::getenv("PATCHWORK_SMALL_DISK")) {
      const std::string there = std::string(disk) + "/hills.pwk";
      write_text(there, text_of(database_)), database_ = there;
    }
    RasterFile file = hill_file(900, 900, -200, 300, 3);
    file.at = [at = file.at](int i, int j) { return at(i, j) + ((i * 7919 + j * 104729) % 64) / 256.0; };
    survey_ = make(file, "survey.tif");
    file = hill_file(400, 300, 0, 0, 4);
    other_ = make(file, "other.tif");
  }
  Words import() const {
    return {"import", database_, survey_, "--accuracy", "0.05", "--name", "survey", "--quiet"};
  }
  // By the other of the two files.
  Words replace() const {
    bool small = false;
    const Database db = Database::open(database_);
    for (const Grid& g : db.grids()) small |= g.info.shape.width() == 400;
    return {"import", database_, small ? survey_ : other_, "--accuracy", "0.05", "--replace",
            "survey", "--quiet"};
  }
  Words remove() const { return {"remove", database_, "survey", "--quiet"}; }
  bool has_survey() const {
    const Database db = Database::open(database_);
    bool hills = false, survey = false;
    for (const Grid& g : db.grids()) hills |= g.info.name == "hills", survey |= g.info.name == "survey";
    EXPECT_TRUE(hills) << "an imported grid is missing";
    return survey;
  }
  void TearDown() override {
    for (const char* suffix : {"", "-wal", "-shm"}) std::filesystem::remove(database_ + suffix);
    CliTest::TearDown();
  }
  std::string database_, survey_, other_;
};

TEST_F(Fault, AKillOrAFullDiskLeavesTheStateBeforeOrAfter) {
  std::mt19937_64 random(test_seed(1));
  const auto uniform = [&](double a, double b) {
    return std::uniform_real_distribution<double>(a, b)(random);
  };
  double longest = 0;
  int killed = 0, refused = 0, done = 0;
  for (int n = 0; n < trials() && !HasFailure(); ++n) {
    const Words words = !has_survey() ? import() : random() % 2 ? remove() : replace();
    const std::string before = content_hash(database_);
    Circumstances c;
    if (n >= 3)
      c.meanwhile = [&](pid_t child) {
        std::this_thread::sleep_for(duration<double>(uniform(0, 1.1 * longest)));
        kill(child, SIGKILL);
      };
    if (n % 4 == 3) {
      const auto room = rlim_t(uniform(0.2, 3) * double(std::filesystem::file_size(database_)));
      c.in_child = [room] {
        signal(SIGXFSZ, SIG_IGN);
        const rlimit limit{room, room};
        setrlimit(RLIMIT_FSIZE, &limit);
      };
    }
    const auto start = steady_clock::now();
    const Outcome o = run(words, c);
    if (n < 3) longest = std::max(longest, duration<double>(steady_clock::now() - start).count());
    killed += o.signal == SIGKILL, refused += o.code == 1, done += o.code == 0;
    const Outcome checked = run({"check", database_});
    EXPECT_EQ(checked.code, 0) << words[0] << " ended with " << o.code << ", signal " << o.signal << "\n"
                               << checked.out << checked.err;
    has_survey();
    if (o.code == 1) {
      EXPECT_EQ(content_hash(database_), before) << o.err;
    }
    if (o.code == 0) {
      EXPECT_NE(content_hash(database_), before);
    }
  }
  std::printf("killed %d, refused %d, done %d\n", killed, refused, done);
  EXPECT_GT(killed, 0);
  EXPECT_GT(done, 0);
}

// Holds the database's write lock while `act` runs.
void beside_a_writer(const std::string& database, const std::function<void(sqlite3*)>& act) {
  sqlite3* other = nullptr;
  ASSERT_EQ(sqlite3_open(database.c_str(), &other), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(other, "BEGIN IMMEDIATE", nullptr, nullptr, nullptr), SQLITE_OK);
  act(other);
  sqlite3_close(other);
}

TEST_F(Fault, ASecondWriterWaitsForTheFirst) {
  beside_a_writer(database_, [&](sqlite3* other) {
    std::thread later([other] {
      std::this_thread::sleep_for(std::chrono::seconds(1));
      sqlite3_exec(other, "ROLLBACK", nullptr, nullptr, nullptr);
    });
    EXPECT_EQ(run(import()).code, 0);
    later.join();
  });
  EXPECT_TRUE(has_survey());
}

TEST_F(Fault, ASecondWriterIsRefusedWhenTheFirstTakesTooLong) {
  beside_a_writer(database_, [&](sqlite3*) {
    EXPECT_NE(complaint(run(import())).find("another process is writing"), std::string::npos);
    EXPECT_EQ(run({"info", database_}).code, 0) << "readers do not wait";
  });
  EXPECT_FALSE(has_survey());
}

TEST_F(Fault, RemoveReplaceExportAndCheckWorkTogether) {
  const std::string before = content_hash(database_);
  EXPECT_EQ(run(import()).code, 0);
  const std::string with_survey = content_hash(database_);
  const std::string back = in_directory("back.tif");
  const Json exported = json({"export", database_, "survey", back, "--json"});
  EXPECT_EQ(exported["type"], "Float32");
  // What was written back is the same grid: a database made of it has the same content.
  const std::string again = in_directory("again.pwk");
  write_text(again, text_of(database_));
  EXPECT_EQ(run({"remove", again, "survey", "--quiet"}).code, 0);
  EXPECT_EQ(content_hash(again), before);
  EXPECT_EQ(run({"import", again, back, "--accuracy", "0.05", "--name", "survey", "--quiet"}).code, 0);
  EXPECT_EQ(content_hash(again), with_survey);
  EXPECT_EQ(run(replace()).code, 0);
  const Json checked = json({"check", database_, "--json"});
  EXPECT_EQ(checked["sound"], true);
  EXPECT_TRUE(checked["problems"].empty());
  const Json removed = json({"remove", database_, "survey", "--json"});
  EXPECT_GT(removed["patches"], 0);
  EXPECT_EQ(content_hash(database_), before);
  EXPECT_EQ(run({"remove", database_, "survey"}).code, 1);
}

TEST_F(Fault, CheckNamesDamageAndRepairsWhatItCan) {
  sqlite3* db = nullptr;
  ASSERT_EQ(sqlite3_open(database_.c_str(), &db), SQLITE_OK);
  EXPECT_EQ(sqlite3_exec(db, "DELETE FROM tree_page", nullptr, nullptr, nullptr), SQLITE_OK);
  sqlite3_close(db);
  const Outcome broken = run({"check", database_, "--json"});
  EXPECT_EQ(broken.code, 1);
  const Json report = Json::parse(broken.out);
  EXPECT_EQ(report["sound"], false);
  EXPECT_EQ(report["problems"][0]["where"], "R-tree");
  EXPECT_EQ(run({"query", database_, "--error", "1"}).code, 1);
  EXPECT_EQ(run({"check", database_, "--repair"}).code, 0);
  EXPECT_EQ(run({"check", database_}).code, 0);
  EXPECT_EQ(run({"query", database_, "--error", "1"}).code, 0);
}

}  // namespace
}  // namespace patchwork
