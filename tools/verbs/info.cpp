// patchwork list and patchwork info: what is in a database.
#include <fmt/format.h>

#include "tools/cli.h"

namespace patchwork::cli {

namespace {

Json json_of(const GridInfo& g) {
  return {{"name", g.name},
          {"accuracy", g.accuracy},
          {"width", g.shape.width()},
          {"height", g.shape.height()},
          {"angle_degrees", g.frame.angle_degrees()},
          {"step", {g.frame.step_i(), g.frame.step_j()}},
          {"quantum", g.quantum},
          {"quantisation", g.quantisation},
          {"lowest", g.lowest},
          {"highest", g.highest},
          {"holes", g.holes},
          {"pixel_is_area", g.shape.pixel_is_area()}};
}

Json json_of_grids(const Database& db) {
  Json grids = Json::array();
  for (const Grid& g : db.grids()) grids.push_back(json_of(g.info));
  return grids;
}

void print_grids(const Database& db) {
  fmt::print("{:<24} {:>13} {:>16} {:>9} {:>10}\n", "grid", "samples", "step m", "angle", "accuracy m");
  for (const Grid& g : db.grids()) {
    const GridInfo& i = g.info;
    fmt::print("{:<24} {:>13} {:>16} {:>9.3f} {:>10.4g}\n", i.name,
               fmt::format("{} x {}", i.shape.width(), i.shape.height()),
               fmt::format("{:.6g} x {:.6g}", i.frame.step_i(), i.frame.step_j()), i.frame.angle_degrees(),
               i.accuracy);
  }
}

// The CRS in one line: its authority code where it has one, else its name.
std::string short_crs(const std::string& wkt) {
  if (wkt.empty()) return "none";
  const std::size_t id = wkt.rfind("ID[\"EPSG\","), quote = wkt.find('"');
  if (id != std::string::npos && wkt.find(']', id) + 2 >= wkt.find_last_not_of(" \n]")) {
    const std::size_t from = id + 10;
    return "EPSG:" + wkt.substr(from, wkt.find(']', from) - from);
  }
  return quote == std::string::npos ? wkt : wkt.substr(quote + 1, wkt.find('"', quote + 1) - quote - 1);
}

Json describe(const Database& db) {
  std::size_t patches = 0, dormant = 0;
  std::vector<std::size_t> by_level;
  double smallest = 0;
  for (const Grid& g : db.grids())
    g.patches.each([&](std::size_t k, const PatchRecord& p) {
      if (!p.exists()) return;
      const auto level = size_t(g.info.shape.block(k).level);
      if (by_level.size() <= level) by_level.resize(level + 1);
      smallest = patches == 0 ? p.bottom : std::min(smallest, p.bottom);
      ++patches, ++by_level[level], dormant += p.dormant();
    });
  Json levels = Json::object();
  for (std::size_t l = 0; l < by_level.size(); ++l) levels[std::to_string(l)] = by_level[l];
  const LodTree::Shape shape = db.tree().shape();
  const CoverageCounts c = db.coverage_counts();
  Json j{{"version", PATCHWORK_VERSION}, {"content_hash", db.content_hash()}, {"crs", db.crs()}};
  j["extent"] = db.grids().empty() ? Json(nullptr) : to_json(db.extent());
  j["grids"] = json_of_grids(db);
  j["patches"] = patches, j["dormant"] = dormant, j["levels"] = levels, j["error_available"] = smallest;
  j["file_bytes"] = db.file_bytes(), j["sample_bytes"] = db.sample_bytes();
  j["tree"] = {{"height", shape.height}, {"nodes", shape.nodes}, {"fill", shape.fill}};
  j["coverage_decided_by"] = {{"integer", c.integer}, {"interval", c.interval}, {"exact", c.exact}};
  return j;
}

void print_info(const Database& db, const Json& j) {
  fmt::print("{}\n  CRS {}, content {}\n", db.path(), short_crs(db.crs()),
             j["content_hash"].get<std::string>());
  if (!db.grids().empty()) fmt::print("  extent {}\n", to_text(db.extent()));
  fmt::print("  {} patches, {} of them redundant; smallest error available {:.4g} m\n",
             j["patches"].get<std::size_t>(), j["dormant"].get<std::size_t>(),
             j["error_available"].get<double>());
  fmt::print("  {:.2f} MB for {:.2f} MB of samples\n", double(db.file_bytes()) / 1e6,
             double(db.sample_bytes()) / 1e6);
  fmt::print("  R-tree: height {}, {} pages, {:.0f} % full\n", j["tree"]["height"].get<int>(),
             j["tree"]["nodes"].get<std::size_t>(), 100 * j["tree"]["fill"].get<double>());
  const CoverageCounts c = db.coverage_counts();
  fmt::print("  coverage decided by integers {}, intervals {}, exact arithmetic {}\n", c.integer, c.interval,
             c.exact);
  fmt::print("  patches by level {}\n", j["levels"].dump());
  print_grids(db);
}

void add(CLI::App& app, Common& common, const char* name, const char* what,
         const std::function<void(const Database&, const Common&)>& show) {
  auto path = std::make_shared<std::string>();
  CLI::App* v = verb(app, common, name, what);
  v->add_option("DB", *path, "the database")->required();
  v->add_flag("--json", common.json, "one JSON document on stdout");
  v->callback([path, show, &common] { show(Database::open(*path, common.memory), common); });
}

}  // namespace

void add_list(CLI::App& app, Common& common) {
  add(app, common, "list", "the grids of a database", [](const Database& db, const Common& c) {
    if (c.json)
      print({{"grids", json_of_grids(db)}});
    else
      print_grids(db);
  });
}

void add_info(CLI::App& app, Common& common) {
  add(app, common, "info", "counts, sizes, extent and shape of a database",
      [](const Database& db, const Common& c) {
        const Json j = describe(db);
        if (c.json)
          print(j);
        else
          print_info(db, j);
      });
}

}  // namespace patchwork::cli
