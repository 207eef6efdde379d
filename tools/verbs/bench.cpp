// patchwork bench: the project's own benchmarks, peers beside it in one run.
#include "tools/bench/bench.h"

#include <fmt/format.h>

#include <map>

namespace patchwork::cli {

namespace {

const std::map<std::string, std::vector<Work> (*)(const BenchOptions&)> kBenches{
    {"blend", &bench_blend},     {"codec", &bench_codec},   {"effects", &bench_effects},
    {"flight", &bench_flight},   {"import", &bench_import}, {"query", &bench_query},
    {"readers", &bench_readers}, {"render", &bench_render}, {"resample", &bench_resample},
    {"tiles", &bench_tiles},     {"update", &bench_update}};

struct Options {
  std::string name;
  BenchOptions bench;
};

Json json_of(const Spread& s) { return {{"min", s.min}, {"median", s.median}, {"max", s.max}}; }

Json json_of(const Work& w) {
  Json peers = Json::array();
  for (const auto& [name, spread] : w.peers) {
    Json peer{{"name", name}};
    peer.update(json_of(spread));
    peers.push_back(std::move(peer));
  }
  return {{"work", w.work},          {"unit", w.unit}, {"better", w.lower_is_better ? "lower" : "higher"},
          {"ours", json_of(w.ours)}, {"peers", peers}, {"answer", w.answer}};
}

void print_row(const std::string& name, const Spread& s) {
  fmt::print("  {:<20} {:>10.4g} {:>10.4g} {:>10.4g}\n", name, s.min, s.median, s.max);
}

void print_table(const std::vector<Work>& works) {
  for (const Work& w : works) {
    fmt::print("{} ({}, {} is better)\n", w.work, w.unit, w.lower_is_better ? "lower" : "higher");
    fmt::print("  {:<20} {:>10} {:>10} {:>10}\n", "", "min", "median", "max");
    print_row("ours", w.ours);
    for (const auto& [name, spread] : w.peers) print_row(name, spread);
  }
  if (!works.empty()) fmt::print("answer: {}\n", works.front().answer.dump());
}

std::vector<std::string> names() {
  std::vector<std::string> all;
  for (const auto& [name, bench] : kBenches) all.push_back(name);
  return all;
}

void run(Options o, const Common& common) {
  if (common.threads > 0) o.bench.threads = common.threads;
  const std::vector<Work> works = kBenches.at(o.name)(o.bench);
  if (!common.json) return print_table(works);
  Json all = Json::array();
  for (const Work& w : works) all.push_back(json_of(w));
  print(all);
}

}  // namespace

void add_bench(CLI::App& app, Common& common) {
  auto o = std::make_shared<Options>();
  CLI::App* v = verb(app, common, "bench", "the project's own benchmarks, with peers beside it");
  v->get_option("--threads")->description("threads of both sides; 0 means 2");
  v->get_option("--memory")->description("of GDAL's cache of raster blocks; ours has its default");
  v->add_option("NAME", o->name, "what to measure")->required()->check(CLI::IsMember(names()));
  v->add_option("--file", o->bench.file,
                "heights to use: to code, integers (codec), to evaluate (blend), to fly over (render)")
      ->check(CLI::ExistingFile);
  v->add_option("--seconds", o->bench.seconds, "how long readers are kept busy (readers only)")
      ->check(CLI::Range(1, 3600))
      ->capture_default_str();
  v->add_option("--size", o->bench.size, "samples along each side")
      ->check(CLI::Range(129, 16385))
      ->capture_default_str();
  v->add_option("--runs", o->bench.runs, "measured runs of each side")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  v->add_option("--keep", o->bench.keep, "folder to work in, which is left as it is");
  v->add_flag("--json", common.json, "one JSON document on stdout");
  v->callback([o, &common] { run(*o, common); });
}

}  // namespace patchwork::cli
