// The plots of `patchwork cost`, drawn by gnuplot as SVG.
#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>

#include "db/error.h"
#include "tools/bench/process.h"
#include "tools/cost/cost.h"

namespace patchwork::cli {

namespace {

// Colours that people who see fewer of them can tell apart (Okabe and Ito).
constexpr const char* kStyle = R"(set encoding utf8
set border 3 lc rgb "#444444"
set tics nomirror
set grid lc rgb "#dddddd" lw 1
set style line 1 lc rgb "#0072B2" lw 2 pt 7 ps 0.6
set style line 2 lc rgb "#D55E00" lw 2 pt 5 ps 0.6
set style line 3 lc rgb "#009E73" lw 2 pt 9 ps 0.6
set style line 4 lc rgb "#777777" lw 2 dt 2 pt 4 ps 0.7
set style line 5 lc rgb "#E69F00" lw 2 pt 11 ps 0.7
set style line 6 lc rgb "#000000" lw 2 pt 6 ps 1.6
set style line 7 lc rgb "#CC79A7" lw 2 pt 7 ps 0.6
set style line 8 lc rgb "#56B4E9" lw 2 pt 13 ps 0.6
set style arrow 1 heads size screen 0.005,90 lc rgb "#000000" lw 1.5
set key outside right top vertical Left reverse samplen 2 spacing 1.3 width -2
set format "%g"
)";

// Inside of gnuplot's single quotes.
std::string quoted(std::string text) {
  for (std::size_t at = 0; (at = text.find('\'', at)) != std::string::npos; at += 2) text.insert(at, 1, '\'');
  return text;
}

// A gnuplot script under construction: data blocks, then a picture.
class Script {
 public:
  explicit Script(std::string scratch) : scratch_(std::move(scratch)), text_(kStyle) {}

  void picture(const std::string& name, const std::string& settings, const std::string& plot) {
    names_.push_back(name);
    text_ += fmt::format(
        "reset session\n{}set terminal svg size 860,440 dynamic font 'DejaVu Sans,13' background '#ffffff'\n"
        "set output '{}'\n{}{}\n{}\nset output\n",
        kStyle, quoted(path(name)), blocks_, settings, plot);
    blocks_.clear();
  }
  // Lines of numbers or quoted words under the name $`name`.
  void block(const std::string& name, const std::vector<std::string>& lines) {
    blocks_ += "$" + name + " << EOD\n";
    for (const std::string& line : lines) blocks_ += line + "\n";
    blocks_ += "EOD\n";
  }
  std::vector<std::pair<std::string, std::string>> draw() const {
    const std::string script = scratch_ + "/plots.gnuplot";
    std::ofstream out(script);
    if (!(out << text_).flush()) throw Error(script, "it cannot be written", "is the disk full?");
    run_process({"gnuplot", script}, "gnuplot-nox");
    std::vector<std::pair<std::string, std::string>> all;
    for (const std::string& name : names_) {
      std::ifstream in(path(name), std::ios::binary);
      all.emplace_back(name, std::string(std::istreambuf_iterator<char>(in), {}));
      if (all.back().second.find("</svg>") == std::string::npos)
        throw Error(path(name), "gnuplot did not finish it");
    }
    return all;
  }

 private:
  std::string path(const std::string& name) const { return scratch_ + "/" + name + ".svg"; }
  std::string scratch_, text_, blocks_;
  std::vector<std::string> names_;
};

std::string spread(const std::vector<double>& ms) {
  const Spread s = Spread::of(ms);
  return fmt::format("{} {} {}", s.median, s.min, s.max);
}

// Error against time: lines "error median min max", errors of 0 left out, which no logarithm shows.
std::vector<std::string> lines(const CostReport& c, const std::string& knob,
                               const std::function<double(const CostRow&)>& error) {
  std::vector<std::string> all;
  for (const std::size_t k : c.of(knob))
    if (const double e = error(c.rows[k]); e > 0)
      all.push_back(fmt::format("{} {}", e, spread(c.rows[k].ms.total())));
  return all;
}
double guaranteed(const CostRow& r) { return r.bound.value_or(0); }
double largest(const CostRow& r) { return r.error.max; }
double p99(const CostRow& r) { return r.error.p99; }
double rms(const CostRow& r) { return r.error.rms; }

std::string axes(const std::string& x, const std::string& y, const std::string& log) {
  return fmt::format("set xlabel '{}'\nset ylabel '{}'\n{}", x, y, log.empty() ? "" : "set logscale " + log);
}

constexpr const char* kCurve =
    "$guaranteed w yerrorlines ls 1 t 'guaranteed', $largest w yerrorlines ls 2 t 'measured, largest', "
    "$p99 w yerrorlines ls 3 t 'measured, 99 %', $uniform w yerrorlines ls 4 t 'uniform grid, largest'";

void price(Script& s, const CostReport& c) {
  s.block("guaranteed", lines(c, "error", guaranteed)), s.block("largest", lines(c, "error", largest));
  s.block("p99", lines(c, "error", p99));
  s.block("uniform", lines(c, fmt::format("uniform_{}", c.side), largest));
  std::string plot = fmt::format("plot {}", kCurve);
  if (c.knee) {
    const CostRow& knee = c.rows[*c.knee];
    const double ms = median(knee.ms.total());
    s.block("knee", {fmt::format("{} {}", guaranteed(knee), ms)});
    plot += fmt::format(", $knee w p ls 6 t 'knee: {} m, {} ms'", figure(guaranteed(knee)), figure(ms));
  }
  s.picture("price", axes("error, metres", "time, ms", "xy"), plot);
}

void pixels(Script& s, const CostReport& c) {
  if (c.of("pixel_error").empty()) return;
  s.block("guaranteed", lines(c, "pixel_error", guaranteed)),
      s.block("largest", lines(c, "pixel_error", largest));
  s.block("p99", lines(c, "pixel_error", p99)), s.block("uniform", lines(c, "uniform_view", largest));
  s.picture("pixels", axes("error on the screen, pixels", "time, ms", "xy"), fmt::format("plot {}", kCurve));
}

// Asked, guaranteed and measured of the ladder.
void errors(Script& s, const CostReport& c) {
  std::vector<std::string> data;
  for (const std::size_t k : c.of("error")) {
    const CostRow& r = c.rows[k];
    const auto shown = [](double e) { return e > 0 ? fmt::format("{}", e) : std::string("NaN"); };
    if (*r.asked > 0)
      data.push_back(fmt::format("{} {} {} {} {}", *r.asked, shown(guaranteed(r)), shown(largest(r)),
                                 shown(p99(r)), shown(rms(r))));
  }
  s.block("ladder", data);
  std::vector<std::string> uniform;
  for (const std::size_t k : c.of(fmt::format("uniform_{}", c.side)))
    if (c.rows[k].error.max > 0)
      uniform.push_back(fmt::format("{0} {0} {1}", c.rows[k].error.max, c.rows[k].error.rms));
  s.block("uniform", uniform);
  s.picture("errors", axes("error asked for, metres", "error, metres", "xy"),
            "plot $ladder u 1:2 w lp ls 1 t 'guaranteed', '' u 1:3 w lp ls 2 t 'measured, largest', "
            "'' u 1:4 w lp ls 3 t 'measured, 99 %', '' u 1:5 w lp ls 5 t 'measured, rms', "
            "$uniform u 1:3 w lp ls 4 t 'uniform grid, rms'");
}

// Bytes of samples in memory against the largest measured error.
void bytes(Script& s, const CostReport& c) {
  const auto data = [&](const std::string& knob, bool bound) {
    std::vector<std::string> all;
    for (const std::size_t k : c.of(knob)) {
      const CostRow& r = c.rows[k];
      if (const double e = bound ? guaranteed(r) : largest(r); e > 0)
        all.push_back(fmt::format("{} {}", e, double(r.bytes) / 1e6));
    }
    return all;
  };
  s.block("guaranteed", data("error", true)), s.block("largest", data("error", false));
  s.block("uniform", data(fmt::format("uniform_{}", c.side), false));
  s.picture("bytes", axes("error, metres", "samples in memory, MB", "xy"),
            "plot $guaranteed w lp ls 1 t 'guaranteed', $largest w lp ls 2 t 'measured, largest', "
            "$uniform w lp ls 4 t 'uniform grid, largest'");
}

// The uniform grid's time for at most this error at this side: its coarsest level that will do.
std::string equal(const CostReport& c, const CostRow& row) {
  const std::string knob =
      row.unit == "px" ? "uniform_view" : fmt::format("uniform_{}", std::lround(std::sqrt(row.samples)));
  std::string found = "NaN NaN NaN";
  for (const std::size_t k : c.of(knob))
    if (c.rows[k].error.max <= std::max(row.error.max, 1e-9)) found = spread(c.rows[k].ms.total());
  return found;
}

// Columns: place, label, query, fetch, blend, tessellate, light, draw, total median min max, uniform grid
// median min max.
std::vector<std::string> columns(const CostReport& c, const std::string& knob, bool with_bound) {
  std::vector<std::string> all;
  const auto stage = [](const std::vector<double>& ms) { return ms.empty() ? 0 : median(ms); };
  for (const std::size_t k : c.of(knob)) {
    const CostRow& r = c.rows[k];
    const std::string bound = r.bound ? fmt::format("≤ {} {}", figure(guaranteed(r)), r.unit)
                                      : fmt::format("measured {} {}", figure(r.error.max), r.unit);
    all.push_back(fmt::format("{} \"{}{}\" {} {} {} {} {} {} {} {}", all.size(), r.value,
                              with_bound ? "\\n" + bound : "", stage(r.ms.query), stage(r.ms.fetch),
                              stage(r.ms.blend), stage(r.ms.tessellate), stage(r.ms.light), stage(r.ms.draw),
                              spread(r.ms.total()), equal(c, r)));
  }
  return all;
}

std::string bars(std::size_t n, bool two_lines) {
  return fmt::format(
      "set style fill solid 0.85 noborder\nset boxwidth 0.6\nset xrange [-0.6:{}]\nset xlabel offset 0,{}\n",
      double(n) - 0.4, two_lines ? -1 : 0);
}

// Boxes of the sums of stages, the largest first, each times `factor`.
std::string stack(bool pictures, bool lit, const std::string& factor) {
  const auto boxes = [&](const std::string& sum, int style, const std::string& name) {
    return fmt::format("$data u 1:(({}){}):xtic(2) w boxes ls {} t '{}', ", sum, factor, style, name);
  };
  std::string drawn = pictures ? boxes("$3+$4+$5+$6+$7+$8", 2, "draw") : "";
  if (lit) drawn += boxes("$3+$4+$5+$6+$7", 8, "light, rest");
  if (pictures) drawn += boxes("$3+$4+$5+$6", 7, "tessellate");
  return "plot " + drawn + boxes("$3+$4+$5", 1, "blend") + boxes("$3+$4", 3, "fetch, decode") +
         boxes("$3", 5, "query");
}

void stacked(Script& s, const CostReport& c, const std::string& knob, const std::string& x) {
  const bool ladder = knob == "error";
  const std::vector<std::string> data = columns(c, knob, !ladder);
  if (data.empty()) return;
  s.block("data", data);
  const bool pictures = !c.rows[c.of(knob).front()].ms.draw.empty();
  s.picture(ladder ? "stages" : knob,
            axes(x, "time, ms", "") + bars(data.size(), !ladder) + "set yrange [0:*]\n" +
                (ladder ? "set xtics rotate by -45\n" : ""),
            stack(pictures, knob == "sky_directions", "") +
                "$data u 1:10:(0):($11-$10) w vectors as 1 t 'total, least to most', "
                "$data u 1:12:13:14 w yerrorbars ls 4 dt 1 t 'uniform grid, equal error'");
}

void shares(Script& s, const CostReport& c) {
  const std::vector<std::string> data = columns(c, "error", false);
  s.block("data", data);
  s.picture("shares",
            axes("error asked for, metres", "part of the time, %", "") + bars(data.size(), false) +
                "set yrange [0:100]\nset xtics rotate by -45\n",
            stack(false, false, "*100/($3+$4+$5)") + "NaN notitle");
}

void sides(Script& s, const CostReport& c) {
  std::vector<std::string> data;
  for (const std::size_t k : c.of("side")) {
    const CostRow& r = c.rows[k];
    data.push_back(
        fmt::format("{} {} {} {}", r.value, spread(r.ms.total()), spread(r.ms.at_hand()), equal(c, r)));
  }
  s.block("data", data);
  s.picture("side", axes("heights along each side of the picture", "time, ms", "xy 2"),
            "set logscale y 10\nset ytics format '%g'\n"
            "plot $data u 1:2:3:4 w yerrorlines ls 1 t 'from the file', '' u 1:5:6:7 w yerrorlines ls 3 t "
            "'patches in memory', '' u 1:8:9:10 w yerrorlines ls 4 t 'uniform grid, equal error'");
}

void model(Script& s, const CostReport& c) {
  std::vector<std::string> seen, unseen, uniform;
  for (const CostRow& r : c.rows)
    if (r.predicted)
      (r.fitted ? seen : unseen).push_back(fmt::format("{} {}", *r.predicted, spread(r.ms.total())));
  for (const std::size_t k : c.of("error"))
    if (c.rows[k].predicted)
      uniform.push_back(fmt::format("{} {}", *c.rows[k].predicted, equal(c, c.rows[k])));
  s.block("seen", seen), s.block("unseen", unseen), s.block("uniform", uniform);
  s.picture(
      "model", axes("predicted time, ms", "measured time, ms", "xy"),
      fmt::format("plot x w l lc rgb '#bbbbbb' lw 1 t 'predicted = measured', $seen w yerrorbars ls 3 t "
                  "'fitted to', $unseen w yerrorbars ls 2 t 'not fitted to, R² = {:.3f}', $uniform w "
                  "yerrorbars ls 4 dt 1 t 'uniform grid, equal error'",
                  c.r_squared));
}

}  // namespace

std::vector<std::pair<std::string, std::string>> draw_cost(const CostReport& report,
                                                           const std::string& scratch) {
  Script s(scratch);
  price(s, report), errors(s, report), bytes(s, report);
  stacked(s, report, "error", "error asked for, metres"), shares(s, report);
  pixels(s, report), sides(s, report);
  stacked(s, report, "frame", "error on the screen asked for, pixels");
  stacked(s, report, "tessellation", "tessellation");
  stacked(s, report, "sky_directions", "directions of sky light");
  stacked(s, report, "smoothness", "smoothness k"), stacked(s, report, "blend", "blend");
  stacked(s, report, "engine", "engine"), stacked(s, report, "tile", "vertices along a side of a tile");
  stacked(s, report, "threads", "threads"), stacked(s, report, "tolerance", "storage tolerance, metres");
  model(s, report);
  return s.draw();
}

}  // namespace patchwork::cli
