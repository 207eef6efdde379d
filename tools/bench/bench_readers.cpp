// Reader processes at full rate while surveys come and go: is every answer one of a committed state, and what
// does the writer cost them.
#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <random>

#include "db/error.h"
#include "db/stopwatch.h"
#include "query/extract.h"
#include "tools/bench/bench.h"
#include "tools/bench/process.h"

namespace patchwork::cli {

namespace {

constexpr int kReaders = 4, kQueries = 64, kQueriesAState = 8;

std::vector<UniformCut> make_queries(const Extent& all) {
  std::mt19937_64 random(1);
  const auto uniform = [&](double a, double b) {
    return std::uniform_real_distribution<double>(a, b)(random);
  };
  std::vector<UniformCut> cuts;
  for (int q = 0; q < kQueries; ++q) {
    const double side = (all.xmax - all.xmin) * uniform(0.05, 0.3);
    const double x = uniform(all.xmin, all.xmax - side), y = uniform(all.ymin, all.ymax - side);
    cuts.push_back(
        {.error = std::exp2(uniform(-2, 6)), .region = Region::inside(Extent{x, y, x + side, y + side})});
  }
  return cuts;
}

// A number that tells answers apart: which patches, their bounds, and the heights of a few; no ids, which a
// grid that comes again need not keep.
std::uint64_t answer_of(const Database& db, const UniformCut& cut) {
  const Extraction x = extract(db, cut);
  std::uint64_t sum = x.patches.size();
  const auto mix = [&](std::uint64_t v) { sum = (sum ^ v) * 0x9e3779b97f4a7c15u, sum ^= sum >> 29; };
  for (const PatchId id : x.patches) {
    const Digest& d = db.grid(id.grid()).info.digest;
    mix(std::uint64_t(d[0]) | std::uint64_t(d[1]) << 8 | std::uint64_t(d[2]) << 16);
    mix(PatchId::make({}, id.level(), id.bx(), id.by()).value);
    mix(std::bit_cast<std::uint64_t>(db.patch(id).top));
  }
  for (std::size_t k = 0; k < x.patches.size(); k += 1 + x.patches.size() / 4)
    for (const float c : db.surface(x.patches[k])->codes) mix(std::bit_cast<std::uint32_t>(c));
  return sum;
}

// What a reader tells at its end, followed by its latencies.
struct Tally {
  std::uint64_t queries = 0, states = 0, errors = 0, inconsistent = 0;
};

class ReadersBench {
 public:
  explicit ReadersBench(const BenchOptions& o) : o_(o), folder_(o) {
    const double middle = 5.0 * (o.size - 1);
    make_terrain(folder_.path("terrain"), {"--size", std::to_string(o.size), "--type", "Int16", "--scale",
                                           "0.1", "--survey", fmt::format("{0},{0},700,700,5,30,0", middle)});
    write({"import", database(), folder_.path("terrain/base.tif"), "--accuracy", "1"});
    queries_ = make_queries(Database::open(database()).extent());
    note_state();
    write(with_survey());
    note_state();
    write({"remove", database(), "survey_1"});
  }

  std::vector<Work> run() {
    const double alone = double(o_.seconds) / 4;
    const std::vector<double> quiet = phase(alone, false), busy = phase(o_.seconds, true);
    const auto spread = [](const std::vector<double>& v) {
      const auto at = [&](double share) {
        return v[std::min(v.size() - 1, size_t(share * double(v.size())))];
      };
      return Spread{at(0.5), at(0.99), v.back()};
    };
    const Json answer{{"readers", kReaders},
                      {"queries", tally_.queries},
                      {"states_seen", tally_.states},
                      {"errors", tally_.errors},
                      {"inconsistent", tally_.inconsistent},
                      {"commits", commits_},
                      {"seconds", o_.seconds},
                      {"columns", "min: p50, median: p99, max: worst"}};
    return {{fmt::format("{} readers beside a writer, latency", kReaders),
             "ms",
             true,
             spread(busy),
             {{"without a writer", spread(quiet)}},
             answer}};
  }

 private:
  std::string database() const { return folder_.path("db.pwk"); }
  std::vector<std::string> with_survey() const {
    return {"import", database(), folder_.path("terrain/survey_1.tif"), "--accuracy", "0.2"};
  }
  static void write(std::vector<std::string> words) {
    words.insert(words.begin(), own_program("patchwork")), words.push_back("--quiet");
    run_process(words);
  }
  void note_state() {
    const Database db = Database::open(database());
    std::vector<std::uint64_t> answers;
    for (const UniformCut& cut : queries_) answers.push_back(answer_of(db, cut));
    states_.push_back(answers);
  }

  // One reader's life, in a process of its own. Nothing before it has started a thread.
  void read(int number, double seconds, int to) const {
    std::mt19937_64 random(static_cast<std::uint64_t>(number));
    Tally tally;
    std::vector<double> latencies;
    Database db = Database::open(database());
    for (const Stopwatch reading; reading.seconds() < seconds;) {
      try {
        tally.states += db.refresh();
        std::array<bool, 2> fits{true, true};
        for (int n = 0; n < kQueriesAState; ++n, ++tally.queries) {
          const std::size_t q = random() % queries_.size();
          const Stopwatch asking;
          const std::uint64_t answer = answer_of(db, queries_[q]);
          latencies.push_back(asking.milliseconds());
          for (std::size_t s = 0; s < fits.size(); ++s) fits[s] = fits[s] && states_[s][q] == answer;
        }
        tally.inconsistent += !fits[0] && !fits[1];
      } catch (const Error& e) {
        if (tally.errors++ == 0) fmt::print(stderr, "reader {}: {}\n", number, e.what());
      }
    }
    const auto send = [&](const void* data, std::size_t n) {
      for (const char* p = static_cast<const char*>(data); n > 0;) {
        const ssize_t sent = ::write(to, p, n);
        if (sent <= 0) _exit(1);
        p += sent, n -= size_t(sent);
      }
    };
    send(&tally, sizeof tally), send(latencies.data(), latencies.size() * sizeof(double));
    _exit(0);
  }

  std::vector<double> phase(double seconds, bool writing) {
    std::vector<int> pipes;
    std::vector<pid_t> readers;
    for (int r = 0; r < kReaders; ++r) {
      int ends[2];
      if (pipe(ends) != 0) throw Error("readers", "no pipe can be made");
      const pid_t child = fork();
      if (child == 0) read(r, seconds, ends[1]);
      close(ends[1]), pipes.push_back(ends[0]), readers.push_back(child);
    }
    for (const Stopwatch watch; writing && watch.seconds() < seconds; commits_ += 2)
      write(with_survey()), write({"remove", database(), "survey_1"});
    std::vector<double> all;
    for (const int from : pipes) receive(from, all);
    for (const pid_t child : readers) waitpid(child, nullptr, 0);
    std::sort(all.begin(), all.end());
    if (all.empty()) throw Error("readers", "none of them answered");
    return all;
  }

  void receive(int from, std::vector<double>& all) {
    std::string bytes;
    char part[65536];
    for (ssize_t n; (n = ::read(from, part, sizeof part)) > 0;) bytes.append(part, size_t(n));
    close(from);
    Tally t;
    if (bytes.size() < sizeof t) throw Error("readers", "one of them died");
    std::memcpy(&t, bytes.data(), sizeof t);
    tally_.queries += t.queries, tally_.states += t.states, tally_.errors += t.errors,
        tally_.inconsistent += t.inconsistent;
    std::vector<double> latencies((bytes.size() - sizeof t) / sizeof(double));
    std::memcpy(latencies.data(), bytes.data() + sizeof t, latencies.size() * sizeof(double));
    all.insert(all.end(), latencies.begin(), latencies.end());
  }

  const BenchOptions& o_;
  WorkFolder folder_;
  std::vector<UniformCut> queries_;
  std::vector<std::vector<std::uint64_t>> states_;
  Tally tally_;
  int commits_ = 0;
};

}  // namespace

std::vector<Work> bench_readers(const BenchOptions& options) { return ReadersBench(options).run(); }

}  // namespace patchwork::cli
