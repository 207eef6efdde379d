// One self-contained page of everything that `patchwork cost` found.
#include <fmt/format.h>

#include <map>

#include "tools/cost/cost.h"

namespace patchwork::cli {

namespace {

constexpr const char* kHead = R"(<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>What accuracy costs in time</title>
<style>
body { font: 16px/1.5 "DejaVu Sans", sans-serif; color: #222; margin: 2em auto; max-width: 900px; padding: 0 1em }
h1 { font-size: 1.6em } h2 { font-size: 1.2em; margin: 2em 0 .3em }
p { margin: .3em 0 .8em } figure { margin: 0 } svg { width: 100%; height: auto }
table { border-collapse: collapse; font-size: .8em; margin: 1em 0 }
th, td { border-bottom: 1px solid #ddd; padding: .3em .7em; text-align: right; vertical-align: top }
th { background: #f4f4f4; font-weight: 600 } td:first-child, th:first-child { text-align: left; white-space: nowrap }
small { color: #666; white-space: nowrap } .wide { overflow-x: auto } .bad { color: #b00020; font-weight: 600 }
</style></head><body>
)";

struct Section {
  const char *plot, *title, *text;
};

constexpr Section kSections[] = {
    {"price", "Time against error",
     "Each step of the ladder three times: at the error that it guarantees, at the largest that was "
     "measured, and at the one that 99 % of the points keep. Bars reach from the fastest to the slowest run "
     "that counts. The knee is the step farthest from the straight line between the ends: on one side of "
     "it less error costs little, on the other much; where time falls by less than a fifth there is none. "
     "Time is that of finding the patches, reading them from the file and evaluating the picture."},
    {"stages", "Where the time goes",
     "The same steps in order, stage by stage; database and GeoTIFF are open, with nothing in memory but "
     "what the operating system keeps of their files. The uniform grid stands beside each step with its "
     "coarsest level that is as close to the best; where it is missing, none is."},
    {"shares", "Where the time goes, as parts", "The same, each step by itself."},
    {"errors", "Asked for, guaranteed, measured",
     "The guarantee counts each grid's own accuracy; the measured error is the distance to the best answer "
     "there is, so it can be far below."},
    {"bytes", "Memory against error", "Samples that an answer holds in memory, and those of a uniform grid."},
    {"pixels", "A view: time against error on the screen",
     "The same for a view cut, whose tolerance grows with the distance from the eye. The uniform grid must "
     "keep to the smallest tolerance in view."},
    {"frame", "A frame of the renderer",
     "A whole picture made from nothing: select and query, send patches to the card, blend the tiles, block "
     "errors and factors, draw. The error is that on the screen, of every pixel, measured through its depth. "
     "The uniform grid is only read."},
    {"tessellation", "Tessellation",
     "The card's stages and the mesh that shaders make keep to the error that is asked for; the stages as "
     "published do not promise it."},
    {"sky_directions", "Sky light",
     "Directions in which each place looks for the sky, in a map over the terrain that later frames keep. "
     "Rest: what no other stage of the frame takes."},
    {"side", "Size of the picture", "At the middle of the ladder; both axes are logarithmic."},
    {"smoothness", "Smoothness", "k continuous derivatives: bilinear, bicubic, bicubic spline."},
    {"blend", "Blend", "priority keeps to the bound that was asked for; weighted is the published formula."},
    {"engine", "Engine", "The same surface from the processor and from the graphics card."},
    {"tile", "Tiles of the graphics card",
     "Vertices along each side of a tile that the card evaluates at once."},
    {"threads", "Threads", "Cores that work on the answer."},
    {"tolerance", "Storage tolerance",
     "The grids stored again, allowed to differ from their files by so much, which the bound counts."},
    {"model", "The model behind --explain and budgets",
     "Finding, reading and evaluating are each a sum of counts times costs, fitted to every second step of "
     "the "
     "ladders. The points that the model has not seen show what it is worth."}};

std::string table_of_bargains(const CostReport& c) {
  std::string head = "<tr><th>in</th>", body;
  for (const std::string& name : c.bought) head += "<th>" + name + "</th>";
  std::map<double, std::string> rows;
  for (const Bargain& b : c.bargains) {
    std::string& row = rows[b.ms];
    if (row.empty()) row = fmt::format("<tr><td>{:g} ms</td>", b.ms);
    if (!b.row) {
      row += "<td>–</td>";
      continue;
    }
    const CostRow& r = c.rows[*b.row];
    row += fmt::format("<td>≤ {} m<br><small>measured {} m<br>{} patches</small></td>", figure(*r.bound),
                       figure(r.error.max), r.patches);
  }
  for (const auto& [ms, row] : rows) body += row + "</tr>\n";
  return "<div class=\"wide\"><table>" + head + "</tr>\n" + body + "</table></div>\n";
}

std::string table_row(const std::vector<std::string>& cells, const std::string& tag) {
  std::string row = "<tr>";
  for (const std::string& c : cells) row += fmt::format("<{0}>{1}</{0}>", tag, c);
  return row + "</tr>\n";
}

std::string table_of_rows(const CostReport& c) {
  const auto stage = [](const std::vector<double>& ms) { return ms.empty() ? "" : figure(median(ms)); };
  const auto error = [](const std::optional<double>& e, const std::string& unit) {
    return e ? figure(*e) + " " + unit : "";
  };
  std::string t =
      "<div class=\"wide\"><table>" + table_row({"knob", "value", "asked", "guaranteed", "measured", "99 %",
                                                 "rms", "patches", "MB", "query ms", "fetch ms", "blend ms",
                                                 "tessellate ms", "light ms", "draw ms", "total ms", "runs"},
                                                "th");
  for (const CostRow& r : c.rows)
    t += table_row(
        {r.knob, r.value, error(r.asked, r.unit), error(r.bound, r.unit), error(r.error.max, r.unit),
         figure(r.error.p99), figure(r.error.rms), std::to_string(r.patches), figure(double(r.bytes) / 1e6),
         stage(r.ms.query), stage(r.ms.fetch), stage(r.ms.blend), stage(r.ms.tessellate), stage(r.ms.light),
         stage(r.ms.draw), stage(r.ms.total()), std::to_string(r.ms.total().size())},
        "td");
  return t + "</table></div>\n";
}

std::string verdict(const CostReport& c) {
  const auto bounded =
      std::count_if(c.rows.begin(), c.rows.end(), [](const CostRow& r) { return r.bound.has_value(); });
  if (c.beyond() == 0)
    return fmt::format(
        "<p>Every measured error keeps to its bound: {} settings, at {} points each, or at the pixels of a "
        "frame.</p>\n",
        bounded, c.points);
  return fmt::format(
      "<p class=\"bad\">{} measured errors are beyond their bounds: some grid is less accurate than it "
      "was said to be.</p>\n",
      c.beyond());
}

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) out += c == '&' ? "&amp;" : c == '<' ? "&lt;" : std::string(1, c);
  return out;
}

// An SVG as part of a page has no XML head.
std::string inlined(const std::string& svg) { return svg.substr(svg.find("<svg")); }

}  // namespace

std::string cost_page(const CostReport& c, const std::vector<std::pair<std::string, std::string>>& plots) {
  std::string page = kHead;
  page += "<h1>What accuracy costs in time</h1>\n";
  page += fmt::format(
      "<p>{} x {} heights over {} x {} km, on {}, {} threads{}; medians of the fastest quarter of {} runs or "
      "more. A machine is not "
      "equally fast at all times: beside them settings over generated terrain, the same in every report, "
      "took "
      "{} ms (reference); times of two reports compare by their ratio to it.</p>\n",
      c.side, c.side, figure((c.extent.xmax - c.extent.xmin) / 1e3),
      figure((c.extent.ymax - c.extent.ymin) / 1e3), escaped(c.machine), c.threads,
      c.engine.empty() ? "" : ", graphics card " + escaped(c.engine), c.runs, figure(c.reference()));
  page += verdict(c);
  for (const std::string& n : c.notes) page += "<p>Note: " + escaped(n) + ".</p>\n";
  page +=
      "<h2>What do I get for 1, 5, 16, 33 ms?</h2>\n<p>The finest step of the ladder that keeps to the time: "
      "the "
      "error that it guarantees, and the largest that was measured.</p>\n" +
      table_of_bargains(c);
  for (const Section& s : kSections)
    for (const auto& [name, svg] : plots)
      if (name == s.plot)
        page += fmt::format("<h2>{}</h2>\n<p>{}</p>\n<figure>{}</figure>\n", s.title, s.text, inlined(svg));
  page += "<h2>All figures</h2>\n<p>The same as cost.csv and cost.json.</p>\n" + table_of_rows(c);
  return page + "</body></html>\n";
}

}  // namespace patchwork::cli
