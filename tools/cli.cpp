#include "tools/cli.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <map>

#include "blend/vulkan/vulkan_blend.h"
#include "db/error.h"

namespace patchwork::cli {

CLI::App* verb(CLI::App& app, Common& common, const std::string& name, const std::string& what) {
  CLI::App* v = app.add_subcommand(name, what);
  v->add_flag("--quiet", common.quiet, "no progress and no notes");
  v->add_option("--memory", common.memory, "memory to use, e.g. 512MiB or 2GiB")
      ->transform(CLI::AsSizeValue(false))
      ->default_str("1GiB");
  v->add_option("--threads", common.threads, "threads to use; 0 means all cores")->check(CLI::Range(0, 1024));
  return v;
}

Database open_filled(const std::string& path, const Common& common) {
  Database db = Database::open(path, common.memory);
  if (db.grids().empty()) throw Error(path, "it holds no grid", "import one first");
  return db;
}

ProgressBar::ProgressBar(const Common& common, std::string label, double total, std::string unit)
    : label_(std::move(label)),
      unit_(std::move(unit)),
      total_(total),
      active_(!common.quiet && isatty(STDERR_FILENO)),
      start_(std::chrono::steady_clock::now()),
      last_(start_) {}

ProgressBar::~ProgressBar() {
  if (shown_) std::fputs("\r\033[K", stderr);
}

void ProgressBar::show(double share) {
  const auto now = std::chrono::steady_clock::now();
  const double elapsed = std::chrono::duration<double>(now - start_).count();
  if (!active_ || elapsed < 1 || std::chrono::duration<double>(now - last_).count() < 0.1) return;
  last_ = now, shown_ = true;
  constexpr int width = 30;
  const int filled = int(std::lround(share * width));
  const std::string rate = unit_.empty() ? "" : fmt::format(" {:.1f} {}/s", share * total_ / elapsed, unit_);
  const double left = share > 0 ? elapsed * (1 - share) / share : 0;
  const std::string line = fmt::format("\r\033[K{} [{:=<{}}{: <{}}] {:3.0f} %{} {:.0f} s left", label_, "",
                                       filled, "", width - filled, 100 * share, rate, left);
  std::fputs(line.c_str(), stderr);
}

CLI::Validator above_zero() {
  return {[](const std::string& s) {
            const double v = std::strtod(s.c_str(), nullptr);
            return v > 0 && std::isfinite(v) ? "" : std::string("it must be a number above 0");
          },
          "above 0"};
}

CLI::Validator finite() {
  return {[](const std::string& s) {
            return std::isfinite(std::strtod(s.c_str(), nullptr)) ? "" : std::string("it must be a number");
          },
          "finite"};
}

CLI::Validator not_empty() {
  return {[](const std::string& s) { return s.empty() ? std::string("it is empty") : ""; }, "TEXT"};
}

CLI::Validator zero_or_more() {
  return {[](const std::string& s) {
            const double v = std::strtod(s.c_str(), nullptr);
            return v >= 0 && std::isfinite(v) ? "" : std::string("it must be a number, 0 or more");
          },
          "0 or more"};
}

void SurfaceOptions::add_blend_to(CLI::App& v) {
  v.add_option("--error", error, "largest error that you accept, metres; 0 means the best there is")
      ->check(zero_or_more());
  v.add_option("--smoothness", smoothness, "k: derivatives that are continuous")
      ->check(CLI::Range(0, 2))
      ->capture_default_str();
  v.add_option("--blend", blend, "how patches are composed")
      ->check(CLI::IsMember({"priority", "weighted"}))
      ->capture_default_str();
}

void SurfaceOptions::add_to(CLI::App& v) {
  add_blend_to(v);
  v.add_option("--engine", engine, "where the surface is evaluated")
      ->check(CLI::IsMember({"cpu", "vulkan"}))
      ->capture_default_str();
  v.add_flag("--strict", strict, "no data where the error is not available, instead of the best there is");
}

void refuse_strict() {
  throw CLI::ValidationError("--strict", "it needs --error with more than 0 m: no height is without error");
}

BlendOptions SurfaceOptions::blend_options() const {
  if (strict && error == 0) refuse_strict();
  return {.smoothness = smoothness,
          .composition = blend == "weighted" ? Composition::weighted : Composition::priority,
          .strict = strict,
          .error = error};
}

std::unique_ptr<Evaluator> make_evaluator(const Database& db, std::span<const PatchId> patches,
                                          const SurfaceOptions& options, std::uint64_t memory) {
  if (options.engine == "cpu") return std::make_unique<Blend>(db, patches, options.blend_options());
  return std::make_unique<VulkanBlend>(Device::open(), db, patches, options.blend_options(),
                                       VulkanOptions{.memory = memory / 4});
}

std::string engine_name(const Evaluator& evaluator) {
  const auto* card = dynamic_cast<const VulkanBlend*>(&evaluator);
  return card ? card->device().name() : "cpu";
}

void RegionOptions::add_to(CLI::App& v, bool with_polygon) {
  auto* box = v.add_option("--extent", extent, "xmin ymin xmax ymax, in the database's CRS")->expected(4);
  if (with_polygon) v.add_option("--polygon", polygon, "\"x y, x y, x y\" or WKT")->excludes(box);
}

Region RegionOptions::region() const {
  if (polygon) return Region::parse_polygon(*polygon);
  if (extent.size() == 4) return Region::inside(Extent{extent[0], extent[1], extent[2], extent[3]});
  return {};
}

void expect_end_of(const std::istream& in) {
  // A stream that shares its buffer with stdio hears of no failure.
  if (in.bad() || !in.eof() || (&in == &std::cin && std::ferror(stdin)))
    throw Error("standard input", "it cannot be read to its end");
}

std::string source_name(const Database& db, std::int32_t source) {
  if (source == 0) return "-";
  return db.grids()[std::size_t(std::abs(source)) - 1].info.name + (source < 0 ? "(filled)" : "");
}

void print(const Json& document) { fmt::print("{}\n", document.dump(2)); }

void note(const Common& common, const std::string& text) {
  if (!common.quiet) std::fputs((text + "\n").c_str(), stderr);  // fmt::print throws where stderr is full
}

Json to_json(const Extent& e) { return {e.xmin, e.ymin, e.xmax, e.ymax}; }
std::string to_text(const Extent& e) {
  const auto millimetres = [](double v) { return std::round(v * 1000) / 1000 + 0.0; };  // -0 becomes 0
  return fmt::format("{:.3f} {:.3f} {:.3f} {:.3f}", millimetres(e.xmin), millimetres(e.ymin),
                     millimetres(e.xmax), millimetres(e.ymax));
}

Json by_level(const Extraction& x) {
  std::map<int, std::size_t> counts;
  for (const PatchId id : x.patches) ++counts[id.level()];
  Json out = Json::object();
  for (const auto& [level, n] : counts) out[std::to_string(level)] = n;
  return out;
}

Json by_grid(const Database& db, const Extraction& x) {
  std::map<GridId, std::size_t> counts;
  for (const PatchId id : x.patches) ++counts[id.grid()];
  Json out = Json::object();
  for (const auto& [grid, n] : counts) out[db.grid(grid).info.name] = n;
  return out;
}

}  // namespace patchwork::cli
