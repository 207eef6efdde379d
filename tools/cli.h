// What every verb of the command shares: options, one JSON document on stdout, progress on stderr.
#pragma once

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdint>
#include <functional>
#include <iosfwd>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "blend/blend.h"
#include "db/database.h"
#include "query/extract.h"

namespace patchwork::cli {

using Json = nlohmann::ordered_json;

/// Options that stand on every verb.
struct Common {
  bool json = false, quiet = false;
  std::uint64_t memory = kDefaultMemory;  ///< bytes
  int threads = 0;                        ///< 0: all
};

/// A verb: adds its subcommand; the callback that it sets does the work and throws Error.
void add_import(CLI::App& app, Common& common);
void add_remove(CLI::App& app, Common& common);
void add_export(CLI::App& app, Common& common);
void add_check(CLI::App& app, Common& common);
void add_list(CLI::App& app, Common& common);
void add_info(CLI::App& app, Common& common);
void add_query(CLI::App& app, Common& common);
void add_profile(CLI::App& app, Common& common);
void add_sight(CLI::App& app, Common& common);
void add_accuracy(CLI::App& app, Common& common);
void add_volume(CLI::App& app, Common& common);
void add_sample(CLI::App& app, Common& common);
void add_resample(CLI::App& app, Common& common);
void add_cost(CLI::App& app, Common& common);
void add_render(CLI::App& app, Common& common);
void add_selftest(CLI::App& app, Common& common);
void add_view(CLI::App& app, Common& common);
void add_bench(CLI::App& app, Common& common);

/// A subcommand with the common options.
CLI::App* verb(CLI::App& app, Common& common, const std::string& name, const std::string& what);

/// Opens for reading; throws Error also where it holds no grid.
Database open_filled(const std::string& path, const Common& common);

/// Checks of an option's number; what is no number does not pass.
CLI::Validator above_zero();
CLI::Validator zero_or_more();
CLI::Validator finite();
/// Of a name: "" is what a script gives whose variable is not set.
CLI::Validator not_empty();

/// A bar with share, rate and remaining time on stderr: on a terminal, when the work lasts longer than a
/// second.
class ProgressBar {
 public:
  /// `unit` and `total`: what is counted, e.g. "Msamples", 16.8; an empty unit shows the share alone.
  ProgressBar(const Common& common, std::string label, double total = 0, std::string unit = {});
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;
  void show(double share);

 private:
  std::string label_, unit_;
  double total_;
  bool active_, shown_ = false;
  std::chrono::steady_clock::time_point start_, last_;
};

/// Options of verbs that evaluate the surface.
struct SurfaceOptions {
  double error = 0;
  int smoothness = 0;
  std::string blend = "priority", engine = "cpu";
  bool strict = false;
  void add_to(CLI::App& verb);
  void add_blend_to(CLI::App& verb);  ///< --error, --smoothness and --blend alone
  BlendOptions blend_options() const;
};

/// For --strict with error 0, which no surface has.
[[noreturn]] void refuse_strict();

/// The engine that the options name. REQUIRES: `db` outlives it. Throws Error: no device, no memory on it.
std::unique_ptr<Evaluator> make_evaluator(const Database& db, std::span<const PatchId> patches,
                                          const SurfaceOptions& options, std::uint64_t memory);
/// "cpu", or the name of the graphics card.
std::string engine_name(const Evaluator& evaluator);

/// The region options of a query: --extent and --polygon.
struct RegionOptions {
  std::vector<double> extent;
  std::optional<std::string> polygon;
  bool given() const { return !extent.empty() || polygon; }
  void add_to(CLI::App& verb, bool with_polygon);
  Region region() const;  ///< throws Error where they are no region
};

/// Throws Error where standard input ended because it could not be read on.
void expect_end_of(const std::istream& in);

void print(const Json& document);
/// A warning or a note on stderr, not with --quiet.
void note(const Common& common, const std::string& text);
Json to_json(const Extent& e);
/// xmin ymin xmax ymax to a millimetre.
std::string to_text(const Extent& e);
/// Whose height it is, by BlendOutput::source: the grid's name, with "(filled)" behind it where only a filled
/// cell replies; "-" for none.
std::string source_name(const Database& db, std::int32_t source);
/// Counts of an extraction by level and by grid name.
Json by_level(const Extraction& x);
Json by_grid(const Database& db, const Extraction& x);

}  // namespace patchwork::cli
