// cost.csv, cost.json, plots and page.
#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "db/error.h"
#include "tools/bench/bench.h"
#include "tools/cost/cost.h"
#include "tools/output_file.h"

namespace patchwork::cli {

namespace {

void write_file(const std::filesystem::path& path, const std::string& text) {
  OutputFile file(path.string());
  std::ofstream out(file.name(), std::ios::binary);
  out << text;
  if (!out.flush()) throw Error(path.string(), "it cannot be written", "is the disk full?");
  file.publish();
}

Json number(const std::optional<double>& v) { return v ? Json(*v) : Json(); }

void put_stage(Json& j, const std::string& name, const std::vector<double>& ms) {
  const bool there = !ms.empty();
  const Spread s = there ? Spread::of(ms) : Spread{};
  j["ms_" + name] = there ? Json(s.median) : Json();
  j["ms_" + name + "_min"] = there ? Json(s.min) : Json();
  j["ms_" + name + "_max"] = there ? Json(s.max) : Json();
}

// Keys in the order of the CSV's columns: first those that programs rely on.
Json json_of(const CostRow& r, double reference) {
  Json j{{"knob", r.knob},           {"value", r.value},         {"error_asked", number(r.asked)},
         {"bound", number(r.bound)}, {"error_max", r.error.max}, {"error_p99", r.error.p99},
         {"error_rms", r.error.rms}, {"patches", r.patches},     {"bytes", r.bytes}};
  Json spreads = Json::object();
  put_stage(spreads, "query", r.ms.query), put_stage(spreads, "fetch", r.ms.fetch);
  put_stage(spreads, "blend", r.ms.blend), put_stage(spreads, "tessellate", r.ms.tessellate);
  put_stage(spreads, "draw", r.ms.draw), put_stage(spreads, "light", r.ms.light);
  put_stage(spreads, "total", r.ms.total());
  for (const char* stage : {"query", "fetch", "blend", "tessellate", "draw", "light", "total"})
    j[std::string("ms_") + stage] = spreads[std::string("ms_") + stage];
  j["bound_p99"] = r.bound ? Json(r.bound_p99) : Json();
  j["of_reference"] = median(r.ms.total()) / reference;
  j["unit"] = r.unit, j["samples"] = r.samples, j["file_bytes"] = r.file_bytes;
  j["runs"] = r.ms.total().size();
  j["predicted_ms"] = number(r.predicted), j["fitted"] = r.fitted, j["beyond"] = r.beyond;
  j.update(spreads);
  return j;
}

// RFC 4180: a field that holds what divides fields stands in quotes.
std::string csv_field(const Json& value) {
  if (value.is_null()) return "";
  if (!value.is_string()) return value.dump();
  std::string text = value.get<std::string>();
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  for (std::size_t at = 0; (at = text.find('"', at)) != std::string::npos; at += 2) text.insert(at, 1, '"');
  return '"' + text + '"';
}

std::string csv_of(const Json& rows) {
  std::string text;
  for (const auto& [key, value] : rows.front().items()) text += (text.empty() ? "" : ",") + key;
  text += "\n";
  for (const Json& row : rows) {
    std::string line;
    bool first = true;
    for (const auto& [key, value] : row.items()) {
      if (!first) line += ",";
      first = false;
      line += csv_field(value);
    }
    text += line + "\n";
  }
  return text;
}

}  // namespace

std::string figure(double v) {
  if (v == 0 || !std::isfinite(v)) return fmt::format("{:g}", v);
  const double size = std::abs(v);
  if (size < 1e-3 || size >= 1e5) return fmt::format("{:.2e}", v);
  const int digits = std::max(0, 2 - int(std::floor(std::log10(size))));
  return fmt::format("{:.{}f}", v, digits);
}

std::vector<std::string> write_cost(const CostReport& report, const std::string& folder) {
  const std::filesystem::path to(folder);
  Json rows = Json::array();
  for (const CostRow& r : report.rows) rows.push_back(json_of(r, report.reference()));
  write_file(to / "cost.json", rows.dump(2) + "\n");
  write_file(to / "cost.csv", csv_of(rows));
  std::vector<std::string> names{"cost.csv", "cost.json"};
  const WorkFolder scratch({});
  const auto plots = draw_cost(report, scratch.path(""));
  for (const auto& [name, svg] : plots) write_file(to / (name + ".svg"), svg), names.push_back(name + ".svg");
  write_file(to / "index.html", cost_page(report, plots));
  names.push_back("index.html");
  return names;
}

}  // namespace patchwork::cli
