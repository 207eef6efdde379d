// What `patchwork cost` measures: rows of knobs, the uniform grid beside them, and what is made of both.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "query/cost_model.h"
#include "tools/cli.h"
#include "tools/cost/rounds.h"
#include "tools/error_figures.h"
#include "tools/spread.h"

namespace patchwork::cli {

struct CostOptions {
  std::string database, folder;
  std::vector<double> extent;  ///< xmin ymin xmax ymax; empty: all, or as much as kMostPatches allow
  std::string scene;     ///< a file; its camera is that of the views; empty: one over the south-west corner
  int side = 512;        ///< heights along each side of the picture
  int runs = 6;          ///< measured at least: rounds.h says which count
  double seconds = 280;  ///< that all may take before it stays at `runs`
  int points = 1 << 17;  ///< at which errors are measured
};

/// The best answer may have this many patches; a database with more is looked at in its middle.
inline constexpr std::size_t kMostPatches = 60000;

/// One setting of one knob.
struct CostRow {
  std::string knob, value;
  std::string unit = "m";  ///< of the errors: m or px
  std::optional<double> asked = {},
                        bound = {};  ///< largest guaranteed error at the points; a uniform grid has none
  double bound_p99 = 0;              ///< of the points
  ErrorFigures error = {};           ///< measured against the best available, in double
  std::size_t patches = 0, bytes = 0, file_bytes = 0;
  Stages ms = {};
  double samples = 0;
  std::optional<Cost> found = {}, expected = {};  ///< where the model can say something: what it goes by
  std::optional<double> predicted = {};           ///< milliseconds of all stages
  bool again = false;                             ///< the same work as a row before it, measured with that
  bool fitted = false;                            ///< the model was made from it
  std::size_t beyond = 0;  ///< points farther from the best than both bounds allow, or without an answer
};

/// A setting whose facts are known, and how its time is taken: together with that of those that share `once`,
/// the same work under the name of another knob.
struct Measurable {
  CostRow row;
  std::shared_ptr<const MeasuredRun> once;
};

/// What a time buys: the finest step of the ladder whose median is at most `ms`.
struct Bargain {
  double ms = 0;
  std::string what;                ///< e.g. "256 x 256 heights, patches at hand"
  std::optional<std::size_t> row;  ///< none: not even the coarsest
};

struct CostReport {
  std::string machine, engine, content_hash;  ///< engine: the graphics card, empty where there is none
  int threads = 0, side = 0, runs = 0, points = 0;
  Extent extent;
  std::vector<CostRow> rows;
  std::vector<std::string> notes;
  std::optional<std::size_t> knee;  ///< place in rows; none where a larger error buys no time
  std::vector<Bargain> bargains;
  std::vector<std::string> bought;  ///< columns of the table of bargains, in order
  CostModel model;
  double r_squared = 0, worst_ratio = 1;  ///< of predictions of rows that the model was not made from
  /// Milliseconds: the geometric mean of the medians of the settings over the reference (reference.h). Times
  /// of two runs compare by their ratio to it: a machine is not equally fast at all times.
  double reference() const;
  std::size_t beyond() const;
  std::vector<std::size_t> of(const std::string& knob) const;  ///< places in rows
};

/// Measures everything; saves nothing. Throws Error.
CostReport measure_cost(const CostOptions& options, const Common& common);

/// The model from every second step of the ladders; predictions of all other rows of the default blend.
void fit_model(CostReport& report);
void find_knee(CostReport& report);
void find_bargains(CostReport& report);

/// cost.csv, cost.json, the plots and index.html in `folder`; returns the names. Throws Error: gnuplot or
/// the disk.
std::vector<std::string> write_cost(const CostReport& report, const std::string& folder);
/// The plots as SVG texts, by name. `scratch` is a folder for gnuplot's files.
std::vector<std::pair<std::string, std::string>> draw_cost(const CostReport& report,
                                                           const std::string& scratch);
std::string cost_page(const CostReport& report,
                      const std::vector<std::pair<std::string, std::string>>& plots);
double median(const std::vector<double>& values);  ///< REQUIRES: not empty
/// A number for people: three digits, no exponent between 0.001 and 100 000.
std::string figure(double value);

}  // namespace patchwork::cli
