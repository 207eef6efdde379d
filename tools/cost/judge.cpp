// What is concluded from the rows: the knee, what a time buys, and the model.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tools/cost/cost.h"

namespace patchwork::cli {

namespace {

constexpr double kTimes[] = {1, 5, 16, 33};  // milliseconds
constexpr double kFall = 1.25;               // of time from end to end: what is less has no knee

// A column of the table of bargains: which rows, and what of their time.
struct Column {
  std::string name, knob;
  std::vector<double> (*of)(const Stages&);
};

std::vector<Column> columns(int side) {
  const auto at_hand = [](const Stages& s) { return s.at_hand(); };
  const auto heights = [](int n) { return fmt::format("{0} x {0} heights", n); };
  return {{"patches found", "error", [](const Stages& s) { return s.query; }},
          {heights(side / 8) + ", patches in memory", fmt::format("error_{}", side / 8), at_hand},
          {heights(side / 2) + ", patches in memory", fmt::format("error_{}", side / 2), at_hand},
          {heights(side) + ", patches in memory", "error", at_hand},
          {heights(side) + ", from the file", "error", [](const Stages& s) { return s.total(); }}};
}

}  // namespace

double median(const std::vector<double>& values) { return Spread::of(values).median; }

std::size_t CostReport::beyond() const {
  std::size_t n = 0;
  for (const CostRow& r : rows) n += r.beyond;
  return n;
}

double CostReport::reference() const {
  double logs = 0, n = 0;
  for (const std::size_t k : of("reference")) logs += std::log(median(rows[k].ms.total())), ++n;
  return std::exp(logs / n);
}

std::vector<std::size_t> CostReport::of(const std::string& knob) const {
  std::vector<std::size_t> places;
  for (std::size_t k = 0; k < rows.size(); ++k)
    if (rows[k].knob == knob) places.push_back(k);
  return places;
}

// On logarithmic axes, scaled to the unit square, the point farthest from the chord between the ends.
void find_knee(CostReport& report) {
  report.knee.reset();
  const std::vector<std::size_t> steps = report.of("error");
  if (steps.empty()) return;
  const auto x = [&](std::size_t k) { return std::log(std::max(*report.rows[k].bound, 1e-9)); };
  const auto y = [&](std::size_t k) { return std::log(median(report.rows[k].ms.total())); };
  const std::size_t first = steps.front(), last = steps.back();
  if (y(first) - y(last) < std::log(kFall)) return;
  double farthest = 0;
  for (const std::size_t k : steps) {
    const double along = (x(k) - x(first)) / std::max(1e-12, x(last) - x(first)),
                 down = (y(first) - y(k)) / std::max(1e-12, y(first) - y(last));
    if (std::abs(down - along) > farthest) farthest = std::abs(down - along), report.knee = k;
  }
}

void find_bargains(CostReport& report) {
  for (const Column& c : columns(report.side)) {
    report.bought.push_back(c.name);
    for (const double ms : kTimes) {
      Bargain b{ms, c.name, {}};
      for (const std::size_t k : report.of(c.knob))  // from error 0 on
        if (median(c.of(report.rows[k].ms)) <= ms) {
          b.row = k;
          break;
        }
      report.bargains.push_back(b);
    }
  }
}

void fit_model(CostReport& report) {
  std::vector<Measured> answers;
  std::string last;
  int step = 0;
  for (CostRow& row : report.rows) {
    step = row.knob == last ? step + 1 : 0, last = row.knob;
    row.fitted = row.knob.starts_with("error") && step % 2 == 0;
    if (!row.fitted) continue;
    answers.push_back({.pages = double(row.found->nodes),
                       .patches = double(row.found->patches),
                       .samples = row.samples,
                       .find = 1e-3 * median(row.ms.query),
                       .read = 1e-3 * median(row.ms.fetch),
                       .blend = 1e-3 * median(row.ms.blend)});
  }
  report.model = fit(answers);
  std::vector<double> measured, predicted;
  for (CostRow& row : report.rows) {
    if (!row.expected) continue;
    const CostModel& m = report.model;
    const double patches = double(row.expected->patches);
    row.predicted = 1e3 * (m.seconds(double(row.expected->nodes), patches) + m.read_seconds(patches) +
                           m.blend_seconds(patches, row.samples));
    if (row.fitted || row.again) continue;
    measured.push_back(median(row.ms.total())), predicted.push_back(*row.predicted);
  }
  double mean = 0, around = 0, left = 0;
  for (const double m : measured) mean += m / double(measured.size());
  for (std::size_t k = 0; k < measured.size(); ++k) {
    around += (measured[k] - mean) * (measured[k] - mean);
    left += (measured[k] - predicted[k]) * (measured[k] - predicted[k]);
    report.worst_ratio =
        std::max({report.worst_ratio, measured[k] / predicted[k], predicted[k] / measured[k]});
  }
  report.r_squared = around > 0 ? 1 - left / around : 0;
}

}  // namespace patchwork::cli
