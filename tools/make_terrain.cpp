// make_terrain: a base grid and rotated finer surveys of one known terrain, each with its honest accuracy.
#include <tbb/global_control.h>
#include <tbb/info.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "db/error.h"
#include "tools/cli.h"
#include "tools/raster_field.h"
#include "tools/terrain_function.h"
#include "tools/terrain_writer.h"

namespace patchwork {

namespace {

using nlohmann::json;

struct Arguments {
  std::string directory, from;
  int size = 1025;
  double step = 10, relief = 1200, cliff = 12, noise = 0, holes = 0, detail = 2;
  std::vector<double> origin{0, 0};
  std::uint32_t seed = 1;
  SampleFormat format{.crs = "EPSG:32610"};
  std::vector<std::string> surveys, points;
  int random_surveys = 0, threads = 0;
  bool as_json = false;
};

void declare(CLI::App& app, Arguments& a) {
  app.add_option("OUTDIR", a.directory, "where base.tif, survey_1.tif ... and terrain.json go")->required();
  app.add_option("--size", a.size, "samples along each side of the base")->check(CLI::Range(2, 65537));
  app.add_option("--step", a.step, "metres between samples of the base")->check(cli::above_zero());
  app.add_option("--origin", a.origin, "south-west sample of the base, metres")->expected(2);
  app.add_option("--crs", a.format.crs, "of every file; \"\" for none");
  app.add_option("--seed", a.seed, "of the terrain and of everything random");
  app.add_option("--relief", a.relief, "metres between plains and summits")->check(cli::zero_or_more());
  app.add_option("--cliffs", a.cliff, "metres, height of the cliffs")->check(cli::zero_or_more());
  app.add_option("--type", a.format.type, "of the samples")
      ->check(CLI::IsMember({"Int16", "UInt16", "Int32", "Float32"}));
  app.add_option("--scale", a.format.quantum, "metres per unit of the integer types")
      ->check(cli::above_zero());
  app.add_option("--noise", a.noise, "metres, bound of the base's noise")->check(cli::zero_or_more());
  app.add_option("--holes", a.holes, "share of samples without data")->check(CLI::Range(0., 0.3));
  app.add_option(
         "--survey", a.surveys,
         "x,y,width,height,step,angle,noise: centre (metres), samples, metres, degrees clockwise, metres; "
         "may be repeated")
      ->allow_extra_args(false);
  app.add_option("--surveys", a.random_surveys, "this many random surveys more")->check(CLI::Range(0, 10000));
  app.add_option("--points", a.points, "N FILE: random points with true heights, as CSV")->expected(2);
  app.add_option("--from", a.from, "take the heights of this file instead; writes no base")
      ->check(CLI::ExistingFile);
  app.add_option("--detail", a.detail, "metres, bound of the detail added to --from")
      ->check(cli::zero_or_more());
  app.add_option("--threads", a.threads, "0: all")->check(cli::zero_or_more());
  app.add_flag("--json", a.as_json, "print terrain.json instead of a table");
}

// One file to be made.
struct Task {
  std::string name;
  SurveyPlan plan;
  double step = 0, angle = 0;
};

Task survey_task(std::size_t number, Point centre, int width, int height, double step, double angle) {
  return {"survey_" + std::to_string(number) + ".tif",
          {.geotransform = survey_geotransform(centre, width, height, step, angle),
           .width = width,
           .height = height},
          step,
          angle};
}

// The whole text must be used: a stray character would otherwise shift every number after it unseen.
Task parse_survey(const std::string& text, std::size_t number) {
  double v[7];
  int used = 0;
  const int got = std::sscanf(text.c_str(), "%lf,%lf,%lf,%lf,%lf,%lf,%lf%n", v, v + 1, v + 2, v + 3, v + 4,
                              v + 5, v + 6, &used);
  bool sound = got == 7 && std::size_t(used) == text.size() && v[4] > 0 && v[6] >= 0;
  for (int k = 0; sound && k < 7; ++k) sound = std::isfinite(v[k]);
  for (int k = 2; sound && k < 4; ++k) sound = v[k] >= 2 && v[k] <= 65537 && v[k] == std::floor(v[k]);
  if (!sound)
    throw CLI::ValidationError("--survey", "\"" + text + "\" is not x,y,width,height,step,angle,noise");
  Task task = survey_task(number, {v[0], v[1]}, int(v[2]), int(v[3]), v[4], v[5]);
  task.plan.noise = v[6];
  return task;
}

// Anywhere in the extent, an eighth to a half of the base's side in samples, twice to eight times as fine.
Task random_survey(const Arguments& a, const Extent& extent, std::size_t number) {
  const auto random = [&](int k) { return hash_unit(std::int64_t(number), k, a.seed + 31); };
  const Point centre{extent.xmin + random(0) * (extent.xmax - extent.xmin),
                     extent.ymin + random(1) * (extent.ymax - extent.ymin)};
  const auto side = [&](int k) { return std::max(2, int(a.size * (0.125 + 0.375 * random(k)))); };
  const double step = a.step / (2 + 6 * random(4));
  Task task = survey_task(number, centre, side(2), side(3), step, 360 * random(5));
  task.plan.noise = 0.05 * step * random(6);
  return task;
}

// Noise and holes are seeded by the file's place in the list: two surveys never share them.
std::vector<Task> plan_tasks(const Arguments& a, const Extent& extent) {
  std::vector<Task> tasks;
  if (a.from.empty()) {
    const std::array<double, 6> north_up{extent.xmin, a.step, 0, extent.ymax, 0, -a.step};
    tasks.push_back({"base.tif", {north_up, a.size, a.size, a.noise}, a.step, 0});
  }
  std::size_t number = 0;
  for (const std::string& text : a.surveys) tasks.push_back(parse_survey(text, ++number));
  for (int k = 0; k < a.random_surveys; ++k) tasks.push_back(random_survey(a, extent, ++number));
  for (std::size_t k = 0; k < tasks.size(); ++k) {
    tasks[k].plan.holes = a.holes;
    tasks[k].plan.seed = hash_lattice(std::int64_t(k), 41, a.seed);
  }
  return tasks;
}

// Vertices, not pixel corners: what a reader needs to place sample (i, j) without knowing GDAL.
json describe(const Task& task, const SurveyFacts& facts, const SampleFormat& format) {
  const SurveyPlan& p = task.plan;
  return {{"file", task.name},
          {"first_sample", {p.geotransform[0], p.geotransform[3]}},
          {"step_i", {p.geotransform[1], p.geotransform[4]}},
          {"step_j", {p.geotransform[2], p.geotransform[5]}},
          {"width", p.width},
          {"height", p.height},
          {"step", task.step},
          {"angle_degrees", task.angle},
          {"type", format.type},
          {"voids", facts.voids},
          {"lowest", facts.lowest},
          {"highest", facts.highest},
          {"interpolation_error", facts.interpolation_error},
          {"rounding", facts.rounding},
          {"noise", p.noise},
          {"accuracy", facts.accuracy}};
}

// Points are hashed from their number, so that a longer list begins with the shorter one; 17 digits keep
// every bit.
void write_points(const Arguments& a, const HeightField& field, const Extent& extent) {
  const long long count = std::stoll(a.points[0]);
  std::FILE* out = std::fopen(a.points[1].c_str(), "w");
  if (out == nullptr) throw Error(a.points[1], "it cannot be written", "check the folder");
  std::fputs("x,y,height\n", out);
  for (long long k = 0; k < count; ++k) {
    const double x = extent.xmin + hash_unit(k, 0, a.seed + 51) * (extent.xmax - extent.xmin);
    const double y = extent.ymin + hash_unit(k, 1, a.seed + 51) * (extent.ymax - extent.ymin);
    double h = 0;
    field.heights({&x, 1}, {&y, 1}, {&h, 1});
    std::fprintf(out, "%.17g,%.17g,%.17g\n", x, y, h);
  }
  const bool failed = std::ferror(out) != 0;
  if (std::fclose(out) != 0 || failed) throw Error(a.points[1], "it cannot be written", "is the disk full?");
}

void check_points(const Arguments& a) {
  if (a.points.empty()) return;
  const std::string& count = a.points[0];
  if (count.empty() || count.size() > 12 || count.find_first_not_of("0123456789") != std::string::npos)
    throw CLI::ValidationError("--points", "\"" + count + "\" is not a number of points");
}

// Accuracy stands last on every line, where a shell script finds it.
void print_table(const json& document) {
  std::printf("%-16s %7s %7s %10s %8s %10s\n", "file", "width", "height", "step", "angle", "accuracy");
  for (const json& f : document["files"])
    std::printf("%-16s %7d %7d %10.6g %8.2f %10.4f\n", f["file"].get<std::string>().c_str(),
                f["width"].get<int>(), f["height"].get<int>(), f["step"].get<double>(),
                f["angle_degrees"].get<double>(), f["accuracy"].get<double>());
  if (document.contains("from")) std::printf("source %.4f\n", document["from"]["accuracy"].get<double>());
}

// The terrain, and what terrain.json says of it.
std::unique_ptr<HeightField> make_field(const Arguments& a, Extent& extent, json& document) {
  if (!a.from.empty()) {
    auto field = std::make_unique<RasterField>(a.from, RasterFieldOptions{a.format.crs, a.detail, a.seed});
    extent = field->extent();
    document["from"] = {{"file", a.from}, {"detail", a.detail}, {"accuracy", field->source_accuracy()}};
    return field;
  }
  const double side = a.step * (a.size - 1);
  extent = {a.origin[0], a.origin[1], a.origin[0] + side, a.origin[1] + side};
  auto field = std::make_unique<TerrainFunction>(TerrainParameters{extent, a.relief, a.cliff, a.seed});
  const Lake& lake = field->lake();
  document["terrain"] = {{"relief", a.relief}, {"cliff", a.cliff}};
  document["lake"] = {
      {"centre", {lake.centre.x, lake.centre.y}}, {"radius", lake.radius}, {"level", lake.level}};
  return field;
}

void write_document(const json& document, const std::filesystem::path& path) {
  std::ofstream out(path);
  out << document.dump(2) << '\n';
  if (!out.flush()) throw Error(path.string(), "it cannot be written", "is the disk full?");
}

void run(const Arguments& a) {
  check_points(a);
  const std::size_t threads =
      a.threads > 0 ? std::size_t(a.threads) : std::size_t(tbb::info::default_concurrency());
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
  const std::filesystem::path directory(a.directory);
  std::error_code failed;
  std::filesystem::create_directories(directory, failed);
  if (failed) throw Error(a.directory, "it cannot be made", failed.message());

  json document{{"crs", a.format.crs}, {"seed", a.seed}, {"margin", kInterpolationMargin}};
  Extent extent;
  const std::unique_ptr<HeightField> field = make_field(a, extent, document);
  document["extent"] = {extent.xmin, extent.ymin, extent.xmax, extent.ymax};
  document["files"] = json::array();
  for (const Task& task : plan_tasks(a, extent)) {
    const SurveyFacts facts = write_survey(*field, task.plan, a.format, (directory / task.name).string());
    document["files"].push_back(describe(task, facts, a.format));
  }
  write_document(document, directory / "terrain.json");
  if (!a.points.empty()) write_points(a, *field, extent);
  if (a.as_json)
    std::cout << document.dump(2) << '\n';
  else
    print_table(document);
}

}  // namespace

}  // namespace patchwork

int main(int argc, char** argv) {
  CLI::App app(
      "Make a base grid and rotated finer surveys of one known terrain, with their honest accuracies.");
  patchwork::Arguments arguments;
  patchwork::declare(app, arguments);
  try {
    app.parse(argc, argv);
    patchwork::run(arguments);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  } catch (const std::exception& e) {
    std::cerr << "make_terrain: " << e.what() << '\n';
    return 1;
  }
  return 0;
}
