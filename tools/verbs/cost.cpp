// patchwork cost: what accuracy costs in time, for this database on this machine.
#include <fmt/format.h>

#include <filesystem>

#include "db/error.h"
#include "tools/bench/process.h"
#include "tools/cost/cost.h"

namespace patchwork::cli {

namespace {

Json json_of(const CostReport& c, const std::vector<std::string>& files) {
  Json j{{"rows", c.rows.size()},
         {"points", c.points},
         {"beyond", c.beyond()},
         {"files", files},
         {"notes", c.notes},
         {"machine", c.machine},
         {"content_hash", c.content_hash},
         {"reference_ms", c.reference()},
         {"knee", {}},
         {"model", {{"r_squared", c.r_squared}, {"worst_ratio", c.worst_ratio}}},
         {"budgets", Json::array()}};
  if (c.knee) {
    const CostRow& r = c.rows[*c.knee];
    j["knee"] = {{"error", *r.asked}, {"bound", *r.bound}, {"ms", median(r.ms.total())}};
  }
  for (const Bargain& b : c.bargains) {
    Json one{{"ms", b.ms},  {"what", b.what},  {"error", {}},
             {"bound", {}}, {"error_max", {}}, {"patches", {}}};
    if (b.row) {
      const CostRow& r = c.rows[*b.row];
      one["error"] = *r.asked, one["bound"] = *r.bound, one["error_max"] = r.error.max;
      one["patches"] = r.patches;
    }
    j["budgets"].push_back(std::move(one));
  }
  return j;
}

void print_text(const CostReport& c, const std::string& folder) {
  const auto at = [](const CostRow& r) {
    return fmt::format("the knee is at an error of {} m ({} ms)", figure(*r.bound),
                       figure(median(r.ms.total())));
  };
  fmt::print("{} settings; {}; the model explains {:.1f} % of the time\n", c.rows.size(),
             c.knee ? at(c.rows[*c.knee]) : "no knee: larger errors take about as long", 100 * c.r_squared);
  for (const Bargain& b : c.bargains)
    fmt::print("  {:>2g} ms, {}: {}\n", b.ms, b.what,
               b.row ? fmt::format("within {} m (measured {} m)", figure(*c.rows[*b.row].bound),
                                   figure(c.rows[*b.row].error.max))
                     : "not even the coarsest");
  fmt::print("see {}\n", (std::filesystem::path(folder) / "index.html").string());
}

// The database may lie where nobody may write: then the model is not kept.
void keep_model(const CostReport& c, const std::string& path, const Common& common) {
  try {
    Database db = Database::open_existing(path, common.memory);
    save_model(db, c.model);
  } catch (const Error& e) {
    note(common, fmt::format("the model was not kept in the database: {}", e.what()));
  }
}

void run(const CostOptions& o, const Common& common) {
  run_process({"gnuplot", "--version"}, "gnuplot-nox");  // before minutes of work, not after
  std::error_code failed;
  std::filesystem::create_directories(o.folder, failed);
  if (failed) throw Error(o.folder, "it cannot be made", failed.message());
  const CostReport report = measure_cost(o, common);
  keep_model(report, o.database, common);
  const std::vector<std::string> files = write_cost(report, o.folder);
  for (const std::string& n : report.notes) note(common, "note: " + n);
  if (common.json)
    print(json_of(report, files));
  else if (!common.quiet)
    print_text(report, o.folder);
  if (report.beyond() > 0)
    throw Error(o.database, fmt::format("{} measured errors are beyond their bounds", report.beyond()),
                "some grid is less accurate than --accuracy said; compare them with: import --dry-run");
}

}  // namespace

void add_cost(CLI::App& app, Common& common) {
  auto o = std::make_shared<CostOptions>();
  CLI::App* v = verb(app, common, "cost", "what accuracy costs in time: CSV, JSON, plots and one page");
  v->add_option("DB", o->database, "the database; a model of the costs is kept in it")->required();
  v->add_option("OUTDIR", o->folder, "where cost.csv, cost.json, the plots and index.html go")->required();
  v->add_option("--extent", o->extent, "xmin ymin xmax ymax of the picture, in the database's CRS")
      ->expected(4);
  v->add_option("--scene", o->scene, "a scene whose camera and size the views and frames have")
      ->check(CLI::ExistingFile);
  v->add_option("--size", o->side, "heights along each side of the picture")
      ->check(CLI::Range(64, 4096))
      ->capture_default_str();
  v->add_option("--runs", o->runs, "measured runs of each setting, at least; the fastest quarter counts")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  v->add_option("--seconds", o->seconds, "up to which runs are added until the medians are sure")
      ->check(zero_or_more())
      ->capture_default_str();
  v->add_option("--points", o->points, "at which errors are measured")
      ->check(CLI::Range(100, 100'000'000))
      ->capture_default_str();
  v->add_flag("--json", common.json, "one JSON document on stdout");
  v->callback([o, &common] { run(*o, common); });
}

}  // namespace patchwork::cli
